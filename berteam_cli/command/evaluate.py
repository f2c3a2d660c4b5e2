"""berteam evaluate: how strong a run's teams are, what its selector knows of them, and how its members behave."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.random import Generator

from berteam_cli.command.inspect import printed
from berteam_cli.config_commands import EvaluateConfig
from berteam_cli.errors import InputError
from berteam_cli.evaluation.calibration import deciles
from berteam_cli.evaluation.conditioning import conditioning_rows, encounters
from berteam_cli.evaluation.ending import elo_rows
from berteam_cli.evaluation.equilibria import exploitability, total_variation
from berteam_cli.evaluation.figures import Replayed, figures, replayed
from berteam_cli.evaluation.likeness import likeness
from berteam_cli.evaluation.manners import Manners, composition, member_rows, team_rows
from berteam_cli.evaluation.points import Points, point_rows, reference_points, why_not
from berteam_cli.evaluation.reference import reference
from berteam_cli.evaluation.regression import FEWEST, regression
from berteam_cli.evaluation.sheet import forget
from berteam_cli.evaluation.strength import Match, Strength
from berteam_cli.evaluation.truth import choose_teams
from berteam_cli.folder import Manifest, logging_to, read_manifest
from berteam_cli.holding import held
from berteam_cli.population import names, policies
from berteam_cli.reading import how_far, last_state
from berteam_cli.records import COLUMNS, EVALUATION, SHEETS, team_name, team_names, write_table
from berteam_cli.selector.base import TeamDistribution, measured
from berteam_cli.selector.embeddings import Embedding
from berteam_cli.selector.independent import with_all_teams
from berteam_cli.stored import write_config
from berteam_cli.terminal import berteam, console, end, say
from berteam_cli.training import EVALUATION as CHANCE
from berteam_cli.training import Parts, Run, generator
from berteam_cli.trust import trusted

ENCOUNTERS = 40  # with each fixed team, to tell what having seen it is worth
PLAYED, MEMBERS, REPLAYED, PAYOFFS, MET = SHEETS
UNSHOWN = ("games", "wins", "draws", "losses", "predicted_elo", "rank_low", "rank_high")

TABLES = (
    *("elo", "members", "teams", "composition", "regression", "figures", "calibration"),
    *("reference_points", "embeddings", "neighbours", "conditioning", "encounters"),
)

Tables = dict[str, list[tuple[Any, ...]]]


def evaluate(config: EvaluateConfig, text: str, out: Path | None) -> float:
    """Writes and prints what a run came to, into its folder ``evaluation``; returns the selector's expected Elo.

    Args:
        config: checked.
        text: the same as yaml.
        out: nothing: the tables go into the run's folder.

    Raises:
        InputError: there is no such run, it has no checkpoint, or its folder cannot be written.
        RunError: it failed.
        KeyboardInterrupt: it was interrupted; what is played is kept.
    """
    folder = Path(config.run)
    parts, run = last_state(folder, config.workers, trusted(config.trust))
    far = how_far(folder, run.epoch)
    place = folder / EVALUATION
    look = Look(config, parts, run, place)
    with held(place), logging_to(place):
        say(f"{folder} {far}")
        manifest = Manifest.begun(place, run=str(folder), **of_tables(place))
        with manifest.until_the_end(again="The same command goes on from there."):
            tables, facts = look.all()
            for name in TABLES:
                path = place / f"{name}.csv"
                if name in tables:
                    write_table(path, COLUMNS[name], tables[name])
                else:  # of an evaluation that had more to say
                    path.unlink(missing_ok=True)
            write_config(place, text)
            manifest.add(seed=config.seed, epoch=run.epoch, evaluated=far, **facts)
            for sheet in SHEETS:
                forget(place / sheet)
    files = [f"{name}.csv" for name in TABLES if name in tables]
    end(place, files, berteam("report", [folder]))
    return next(row[2] for row in tables["figures"] if row[1] == "expected_elo")


def of_tables(place: Path) -> dict[str, Any]:
    """Returns what the manifest in ``place`` says of the tables there, which stay with it until others are whole."""
    try:
        told = read_manifest(place)
    except InputError:
        return {}
    return {name: told[name] for name in ("seed", "epoch", "evaluated", "teams", "rated", "reference") if name in told}


@dataclass(frozen=True)
class Look:
    """A look at a run.

    Attributes:
        config: of the command.
        parts, run: what is looked at.
        place: where the tables go.
    """

    config: EvaluateConfig
    parts: Parts
    run: Run
    place: Path

    def all(self) -> tuple[Tables, dict[str, Any]]:
        """Returns the rows of all tables, and what the manifest should say."""
        config, parts, run = self.config, self.parts, self.run
        # A stream for each part, so that none changes with what another draws.
        listing, rating, behaving, again, drawing, playing, meeting = generator(config.seed, CHANCE, run.epoch).spawn(7)
        learned = self.learned(listing)
        known = reference(parts.games, config.reference_teams)
        match = Match(parts.games, policies(parts.optimizer.islands, run.population, explore=False), known)
        found, facts = self.strength(match, learned, rating)
        fresh = replayed(match, found.truth, config.replay_games, again, self.place / REPLAYED)
        tables = self.known_of(found, learned, fresh, drawing)
        behaviour = np.full(run.population.size, np.nan)
        if match.counts_events:
            behaved = match.of_members(config.aggression_games, behaving, self.place / MEMBERS)
            behaviour = behaved.aggression
            tables |= self.manners(behaved, found, learned, behaving)
        else:
            say(f"Games of {parts.games.env.name} count no events, so nobody is aggressive or defensive.")
        tables |= self.points(learned, playing)
        if isinstance(parts.selector, Embedding):
            tables |= likeness(run, parts, behaviour)
            self.show("Cosine between members' embeddings, mean over the pairs of a group", tables, "embeddings")
        else:
            say("The selector has no embeddings of members to compare.")
        if parts.selector.answers and parts.selector.field.sides == 2:
            tables |= conditioning_rows(run.epoch, encounters(run, parts, known, ENCOUNTERS, meeting, self.place / MET))
            title = f"Elo of the choice before and after a first game, {ENCOUNTERS} encounters with each fixed team"
            self.show(title, tables, "conditioning")
        return tables, facts

    def learned(self, rng: Generator) -> TeamDistribution:
        """Returns the distribution over teams; if it is exact, of all there can be, unless they are very many."""
        field = self.parts.selector.field
        found = measured(self.parts.selector, self.run.selection, rng)
        if found.samples:
            say(
                f"The chances of teams are estimated from {found.samples:,} drawn ones (selector.exact_limit), "
                f"so there is no regression and no calibration."
            )
            return found
        few = field.teams <= self.config.teams_at_most
        return with_all_teams(found, field) if few else found

    def strength(self, match: Match, learned: TeamDistribution, rng: Generator) -> tuple[Strength, dict[str, Any]]:
        """Returns how strong the teams are, and what the manifest should say of how that was measured."""
        selector, most = self.parts.selector, self.config.teams_at_most
        choosing, playing = rng.spawn(2)
        chosen = choose_teams(learned, lambda count: selector.sample(self.run.selection, count, choosing), 1, most)
        teams = selector.field.teams
        if len(chosen) < teams:
            say(f"{len(chosen):,} of {teams:,} possible teams are rated (teams_at_most={most:,}).")
        title = f"Rating {len(chosen):,} teams"
        found = match.strength(chosen, self.config.games_per_pair, playing, title, self.place / PLAYED)
        return found, {"teams": teams, "rated": len(chosen), "reference": match.reference.source}

    def known_of(self, found: Strength, learned: TeamDistribution, fresh: Replayed, rng: Generator) -> Tables:
        """Returns and shows the rows that tell how strong the teams are, and what the selector knows of it."""
        truth, exact = found.truth, learned.samples == 0
        called = names(self.parts.optimizer.islands, self.run.population)
        tables: Tables = {"elo": list(elo_rows(truth, called, found.samples, exact=exact))}
        self.show("Strongest teams", tables, "elo", UNSHOWN)
        tables["figures"] = self.dated(figures(found, learned, fresh, rng))
        self.show("Figures", tables, "figures", whole=True)
        if exact and len(truth.elos) >= FEWEST:
            fitted = regression(truth.elos, truth.chosen.probability, found.noise, rng)
            tables["regression"] = self.dated((name, *value) for name, value in fitted.items())
            self.show("Probability of a team on its Elo", tables, "regression", whole=True)
        if exact:
            tables["calibration"] = self.dated(deciles(found))
            self.show("Tenths of the teams, the most probable first", tables, "calibration", whole=True)
        return tables

    def manners(self, behaved: Manners, found: Strength, learned: TeamDistribution, rng: Generator) -> Tables:
        """Returns and shows the rows that tell how members and teams behave; the game counts events."""
        members = member_rows(self.run, self.parts, behaved, rng)
        tables: Tables = {"members": members, "composition": self.dated(composition(learned, behaved.aggression))}
        if found.manners is not None:
            tables["teams"] = self.dated(team_rows(found.truth.chosen.teams, found.manners, behaved.aggression))
        self.show("Members", tables, "members", ("island", "wall_hits", "games"))
        self.show("Teams that are chosen", tables, "composition", whole=True)
        return tables

    def points(self, learned: TeamDistribution, rng: Generator) -> Tables:
        """Returns and shows the rows of reference_points.csv, or says why there are none."""
        reason = why_not(self.parts, learned, self.config.most)
        if reason:
            say(f"{reason}, so there are no reference points.")
            return {}
        points = reference_points(self.run, self.parts, learned, self.config.payoff_games, rng, self.place / PAYOFFS)
        tables: Tables = {"reference_points": point_rows(self.run, self.parts, points)}
        self.show("Teams, the most probable first", tables, "reference_points")
        console().print(printed("Mixes: exploitability, total variation from what was learnt", mixes(points)))
        say(f"Of all Nash equilibria of wins less losses this is {points.equilibrium.which}.")
        unbeaten = team_names(points.learned.teams[~points.played.wins.any(axis=0)])
        top = self.config.top
        listed = ", ".join(unbeaten[:top]) + (f" and {len(unbeaten) - top} more" if len(unbeaten) > top else "")
        say(f"Teams that never lost: {listed or 'none'}.")
        return tables

    def dated(self, rows: Iterable[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
        """Returns ``rows`` with the epoch in front."""
        return [(self.run.epoch, *row) for row in rows]

    def show(self, title: str, tables: Tables, name: str, leave: Sequence[str] = (), *, whole: bool = False) -> None:
        """Prints the first rows of a table, as many as the config says, or the ``whole`` of it."""
        table = pd.DataFrame(tables[name], columns=COLUMNS[name]).drop(columns=[*leave, "epoch"], errors="ignore")
        console().print(printed(title, table if whole else table.head(self.config.top)))


def mixes(points: Points) -> pd.DataFrame:
    """Returns each mix as a whole."""
    learned, surplus = points.learned.probability, points.played.zero_sum
    rows = [
        (
            *(name, exploitability(mix, surplus), total_variation(mix, learned)),
            *(team_name(points.learned.teams[mix.argmax()]), mix.max()),
        )
        for name, mix in points.mixes.items()
    ]
    return pd.DataFrame(rows, columns=["mix", "exploitability", "from learned", "first team", "its share"])
