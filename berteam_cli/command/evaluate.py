"""berteam evaluate: a run beside where choosing among its teams ends in theory, and its members beside each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.random import Generator
from rich.console import Console

from berteam_cli.command.inspect import printed
from berteam_cli.config_commands import EvaluateConfig
from berteam_cli.env.mctf import Mctf
from berteam_cli.errors import InputError
from berteam_cli.evaluation.conditioning import Encounters, encounters
from berteam_cli.evaluation.equilibria import (
    Equilibrium,
    exploitability,
    fixed_point,
    nash,
    replicator,
    total_variation,
)
from berteam_cli.evaluation.payoffs import Payoffs, payoffs
from berteam_cli.evaluation.reference import reference, reference_teams
from berteam_cli.optimizer.aggression import aggression
from berteam_cli.outcomes import Floats
from berteam_cli.population import island_of, names, policies
from berteam_cli.reading import last_state
from berteam_cli.records import COLUMNS, EVALUATION, team_name, write_table
from berteam_cli.selector.base import TeamDistribution, measured, team_count
from berteam_cli.selector.embeddings import Embedding, cosines, groups, mean_cosine, nearest
from berteam_cli.selector.independent import anybody, distribution, with_all_teams
from berteam_cli.training import PAYOFFS, Parts, Probes, Run, generator, key

STEPS = 10_000  # of the replicator, after which it has settled
NEIGHBOURS = 5
OPPONENTS, ENCOUNTERS = 28, 40  # at most so many fixed teams are met, so many times each
PROBES, PROBE_TEAMS = 2, 28  # games against each of so many teams of fixed policies, to tell aggression

Tables = dict[str, list[tuple[Any, ...]]]


def evaluate(config: EvaluateConfig, text: str, out: Path | None) -> float:
    """Writes and prints the reference points of a run and the likeness of its members; returns NaN.

    Args:
        config: checked.
        text: the same as yaml.
        out: nothing: the tables go into the run's folder.

    Raises:
        InputError: there is no such run, it has no checkpoint, or its folder cannot be written.
    """
    folder = Path(config.run)
    parts, run = last_state(folder)
    console = Console(width=None if Console().is_terminal else 120)
    console.print(f"{folder} after epoch {run.epoch}", highlight=False)
    playing, looking, meeting = generator(parts.seed, PAYOFFS, run.epoch).spawn(3)
    tables: Tables = {}
    learned = learned_mix(run, parts, config.most, playing)
    if isinstance(learned, str):
        console.print(f"{learned}, so there are no reference points.", highlight=False)
    else:
        points = reference_points(run, parts, learned, config.payoff_games, playing)
        tables["reference_points"] = point_rows(run, parts, points)
        show_points(console, tables["reference_points"], points, config.top)
    if isinstance(parts.selector, Embedding):
        tables |= likeness(run, parts, looking)
        rows = [row[1:] for row in tables["embeddings"]]
        title = "Cosine between members' embeddings, mean over the pairs of a group"
        console.print(printed(title, pd.DataFrame(rows, columns=COLUMNS["embeddings"][1:])))
    else:
        console.print("The selector has no embeddings of members to compare.", highlight=False)
    if parts.selector.answers and parts.selector.field.sides == 2:
        found = encounters(run, parts, reference(parts.games, OPPONENTS), ENCOUNTERS, meeting)
        tables |= conditioning_rows(run, found)
        rows = [row[1:] for row in tables["conditioning"]]
        title = f"Elo of the choice before and after a first game, {ENCOUNTERS} encounters with each fixed team"
        console.print(printed(title, pd.DataFrame(rows, columns=COLUMNS["conditioning"][1:])))
    for path in written(folder / EVALUATION, tables):
        console.print(str(path), highlight=False, soft_wrap=True)
    return math.nan


def written(place: Path, tables: Tables) -> list[Path]:
    """Writes ``tables`` into the folder ``place``; returns their paths.

    Raises:
        InputError: it cannot be written.
    """
    paths = [place / f"{name}.csv" for name in tables]
    try:
        place.mkdir(exist_ok=True)
        for path, (name, rows) in zip(paths, tables.items(), strict=True):
            write_table(path, COLUMNS[name], rows)
    except OSError as error:
        raise InputError(f"{place} cannot be written: {error.strerror or error}.") from error
    return paths


@dataclass(frozen=True)
class Points:
    """Mixes of a run's K teams: what it learnt, and where choosing ends in theory.

    Attributes:
        played: what came of their games.
        learned: the run's distribution.
        fixed: the fixed point of learning from weighted winners.
        replicated: the limit of learning from winners without weights.
        equilibrium: the Nash equilibrium of wins less losses.
    """

    played: Payoffs
    learned: TeamDistribution
    fixed: Floats
    replicated: Floats
    equilibrium: Equilibrium

    @property
    def mixes(self) -> dict[str, Floats]:
        """(K,) each, by name."""
        named = {"learned": self.learned.probability, "fixed_point": self.fixed, "replicator": self.replicated}
        return named | {"nash": self.equilibrium.strategy}


def learned_mix(run: Run, parts: Parts, most: int, rng: Generator) -> TeamDistribution | str:
    """Returns the exact distribution over teams that ``run`` learnt, or why its teams do not play each other."""
    field = parts.selector.field
    teams = team_count(field.members, field.team_size)
    if field.sides != 2:
        return f"Games of {field.sides} sides have no payoff matrix"
    if teams > most:
        return f"{teams:,} possible teams are more than most={most:,}"
    learned = measured(parts.selector, run.selection, rng)
    if learned.samples:
        return "The teams are too many for an exact distribution (selector.exact_limit)"
    return with_all_teams(learned, field)


def reference_points(run: Run, parts: Parts, learned: TeamDistribution, games_per_pair: int, rng: Generator) -> Points:
    """Returns the reference points of all teams of ``run``, after each played each."""
    acting = policies(parts.optimizer.islands, run.population, explore=False)
    played = payoffs(parts.games, acting, learned.teams, games_per_pair, rng)
    # In proportion to the orders in which the members of each team may stand.
    orders = distribution(anybody(parts.selector.field), parts.selector.field).probability
    limit = replicator(played.wins, orders / orders.sum(), STEPS)[-1]
    return Points(played, learned, fixed_point(played.wins, orders), limit, nash(played.zero_sum))


def point_rows(run: Run, parts: Parts, points: Points) -> list[tuple[Any, ...]]:
    """Returns the rows of reference_points.csv, the most probable team first."""
    called = names(parts.optimizer.islands, run.population)
    surplus = points.played.zero_sum
    against_mix = surplus @ points.learned.probability
    rows = []
    for k in np.argsort(-points.learned.probability, kind="stable"):
        team = points.learned.teams[k]
        mixes = (mix[k] for mix in points.mixes.values())
        rows.append(
            (
                *(run.epoch, team_name(team), " + ".join(called[m] for m in team), *mixes),
                *(against_mix[k], surplus[k].min(), points.played.wins[:, k].max()),
            )
        )
    return rows


def show_points(console: Console, rows: list[tuple[Any, ...]], points: Points, top: int) -> None:
    """Prints the reference points: team by team, then each mix as a whole."""
    teams = pd.DataFrame(rows, columns=COLUMNS["reference_points"]).drop(columns="epoch")
    console.print(printed("Teams, the most probable first", teams.head(top)))
    learned, surplus = points.learned.probability, points.played.zero_sum
    mixes = pd.DataFrame(
        [
            (
                *(name, exploitability(mix, surplus), total_variation(mix, learned)),
                *(team_name(points.learned.teams[mix.argmax()]), mix.max()),
            )
            for name, mix in points.mixes.items()
        ],
        columns=["mix", "exploitability", "from learned", "first team", "its share"],
    )
    console.print(printed("Mixes: exploitability, total variation from what was learnt", mixes))
    console.print(f"Of all Nash equilibria of wins less losses this is {points.equilibrium.which}.", highlight=False)
    unbeaten = [team_name(points.learned.teams[k]) for k in np.flatnonzero(~points.played.wins.any(axis=0))]
    listed = ", ".join(unbeaten[:top]) + (f" and {len(unbeaten) - top} more" if len(unbeaten) > top else "")
    console.print(f"Teams that never lost: {listed or 'none'}.", highlight=False)


def conditioning_rows(run: Run, found: Encounters) -> Tables:
    """Returns the rows of conditioning.csv and encounters.csv."""
    opponents = [team_name(team) for team in found.reference.teams]
    means = zip(opponents, found.before.mean(axis=1), found.after.mean(axis=1), strict=True)
    each = found.before.shape[1]
    return {
        "conditioning": [(run.epoch, choice, *elo) for choice, elo in found.elos().items()],
        "encounters": [(run.epoch, opponent, each, before, after) for opponent, before, after in means],
    }


def likeness(run: Run, parts: Parts, rng: Generator) -> Tables:
    """Returns the rows of embeddings.csv and neighbours.csv."""
    islands = parts.optimizer.islands
    similarity = cosines(parts.selector.embeddings(run.selection))
    home = [islands[i] for i in island_of(islands)]
    labels = [x.name for x in home], [x.learner.algorithm for x in home]
    found = groups(*labels, run.population.fitness, behaviour(run, parts, rng))
    mean = mean_cosine(similarity, found["all"])
    rows = []
    for name, chosen in found.items():
        size, cosine = int(chosen.sum()), mean_cosine(similarity, chosen)
        rows.append((run.epoch, name, size, size * (size - 1) // 2, cosine, cosine - mean))
    return {"embeddings": rows, "neighbours": list(neighbour_rows(run, parts, similarity))}


def neighbour_rows(run: Run, parts: Parts, similarity: Floats) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of neighbours.csv."""
    called = names(parts.optimizer.islands, run.population)
    for n, others in enumerate(nearest(similarity, NEIGHBOURS)):
        for rank, other in enumerate(others, start=1):
            yield run.epoch, n, called[n], rank, other, called[other], similarity[n, other]


def behaviour(run: Run, parts: Parts, rng: Generator) -> Floats:
    """Returns (N,) the aggression of each member, as a team made only of it; NaN in games that count no events."""
    env, people = parts.games.env, run.population
    if not isinstance(env, Mctf):
        return np.full(people.size, np.nan)
    opponents = reference_teams(env.standard_policies, env.team_size, PROBE_TEAMS)
    each = len(opponents) * PROBES
    teams = np.arange(people.size).repeat(each)[:, np.newaxis].repeat(env.team_size, axis=1)
    others = np.tile(np.repeat(opponents, PROBES, axis=0), (people.size, 1))
    outcomes = Probes(parts, key(rng)).play(people, teams, others, each)
    return aggression(outcomes).reshape(people.size, each).mean(axis=1)
