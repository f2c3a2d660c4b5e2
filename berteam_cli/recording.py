"""From a run to the rows of its tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from berteam_cli.archiving import archive_of, archive_rows, cell_rows
from berteam_cli.evaluation.exploiting import Exploiting
from berteam_cli.evaluation.sight import Sight
from berteam_cli.evaluation.watching import Watching
from berteam_cli.learner.base import LEARNING_FIGURES
from berteam_cli.opponents.base import Guest, Met, Opponents
from berteam_cli.optimizer.perturbing import reward_factors
from berteam_cli.outcomes import NOBODY, SIDES, Outcomes
from berteam_cli.population import island_of, names
from berteam_cli.records import (
    ARCHIVE_TABLES,
    BY_SIDE_TABLE,
    COLUMNS,
    OPPONENTS_TABLE,
    SIDES_TABLE,
    WATCHED_TABLE,
    Tables,
    team_name,
    team_names,
)
from berteam_cli.selector.base import TeamDistribution, measured
from berteam_cli.training import RECORDS, Clock, Parts, Report, Run, generator

Row = tuple[Any, ...]


def also_growing(parts: Parts, *, watched: bool) -> list[str]:
    """Returns the tables that only runs of such ``parts`` have, or such as are ``watched`` while they go on."""
    several, apart, met = parts.games.env.sides > 2, parts.selector.by_side, parts.opponents.games > 0
    asked = ((SIDES_TABLE, several), (BY_SIDE_TABLE, apart), (WATCHED_TABLE, watched), (OPPONENTS_TABLE, met))
    found = [name for name, there in asked if there]
    return found if archive_of(parts) is None else [*found, *ARCHIVE_TABLES]


@dataclass(frozen=True)
class Recorder:
    """Writes a run into its tables.

    Attributes:
        tables: of the run folder.
        parts: of the run.
        every: epochs between two records of members and distributions.
        exploiting: measures how exploitable a distribution is.
        watching: looks at how the run fares against fixed teams; None: nobody does.
    """

    tables: Tables
    parts: Parts
    every: int
    exploiting: Exploiting
    watching: Watching | None = None

    def epoch(self, run: Run, report: Report) -> tuple[dict[str, float], TeamDistribution | None, Sight | None]:
        """Records an epoch, and after every ``every``-th one the state it led to.

        Returns:
            The figures of that state, NaN where it was not recorded, its distribution over teams, and what was seen of
            it against fixed teams, if it was looked at.
        """
        clock = Clock()
        selecting = report.selecting
        entropy = effective = exploited = math.nan
        distribution = None
        if run.epoch % self.every == 0:
            distribution = self.state(run)
            entropy = distribution.entropy
            effective = math.exp(entropy)
            exploited = self.exploiting.of(run, distribution)
        self.tables.add("games", game_rows(run.epoch, report.outcomes))
        if self.parts.games.env.sides > 2:
            self.tables.add(SIDES_TABLE, side_rows(run.epoch, report.outcomes))
        if self.parts.opponents.games:
            self.tables.add(OPPONENTS_TABLE, opponent_rows(run, report.met, self.parts.opponents))
        self.tables.add("learning", self.learning_rows(run, report))
        self.tables.add("generations", self.generation_rows(run, report))
        figures = (selecting.loss, selecting.updates, selecting.buffer, effective, entropy, exploited)
        self.tables.add("selector", [(run.epoch, *figures, selecting.skipped)])
        clock.lap("record_s")
        sight = self.watched(run)
        if sight is not None:
            clock.lap("evaluate_s")
        seconds = (
            {"evaluate_s": 0.0} | report.seconds | clock.laps | {"epoch": run.epoch, "env_steps": report.env_steps}
        )
        self.tables.add("timing", [tuple(seconds[column] for column in COLUMNS["timing"])])
        return {"effective_teams": effective, "entropy": entropy, "exploitability": exploited}, distribution, sight

    def watched(self, run: Run, *, last: bool = False) -> Sight | None:
        """Looks at the run, if that is due, and records what is seen; after the ``last`` epoch if it was not due."""
        if self.watching is None or self.watching.due(run.epoch) == last:
            return None
        sight = self.watching.look(run)
        self.tables.add(WATCHED_TABLE, sight.rows())
        return sight

    def distribution(self, run: Run) -> TeamDistribution:
        """Returns the distribution over teams after ``run.epoch`` epochs."""
        rng = generator(self.parts.seed, RECORDS, run.epoch)
        return measured(self.parts.selector, run.selection, rng)

    def last(self, run: Run) -> Sight | None:
        """Records the state after the last epoch and what is seen of it, unless that is done; returns what is seen."""
        if run.epoch % self.every:
            self.state(run)
        return self.watched(run, last=True)

    def state(self, run: Run) -> TeamDistribution:
        """Records the members and the distributions over teams, captains and islands; returns that over teams."""
        distribution = self.distribution(run)
        self.tables.add("agents", self.agent_rows(run))
        self.tables.add("team_distribution", distribution_rows(run.epoch, distribution))
        if self.parts.selector.by_side:
            self.tables.add(BY_SIDE_TABLE, self.by_side_rows(run))
        if archive_of(self.parts) is not None:
            self.tables.add("archive", archive_rows(run, self.parts))
            self.tables.add("archive_cells", cell_rows(run, self.parts))
        captains = self.parts.selector.captains(run.selection)
        self.tables.add("captain_distribution", ((run.epoch, n, chance) for n, chance in enumerate(captains)))
        islands = self.parts.optimizer.islands
        shares = np.bincount(island_of(islands), weights=captains, minlength=len(islands))
        self.tables.add(
            "island_distribution", ((run.epoch, i.name, share) for i, share in zip(islands, shares, strict=True))
        )
        return distribution

    def by_side_rows(self, run: Run) -> Iterator[Row]:
        """Returns one row for each side and each team listed for it."""
        rng = generator(self.parts.seed, RECORDS, run.epoch)
        for side in range(self.parts.selector.field.sides):
            distribution = measured(self.parts.selector, run.selection, rng, side=side)
            for epoch, *row in distribution_rows(run.epoch, distribution):
                yield (epoch, SIDES[side], *row)

    def agent_rows(self, run: Run) -> Iterator[Row]:
        """Returns one row for each member."""
        people = run.population
        fitness = self.parts.optimizer.fitness.shown(people.fitness)
        called = names(self.parts.optimizer.islands, people)
        aggression, advance, spread = people.behaviour.T
        for island in self.parts.optimizer.islands:
            for n in island.numbers:
                yield (
                    *(run.epoch, n, called[n], island.name, island.learner.algorithm, fitness[n]),
                    *(people.age[n], people.games[n], people.captain_games[n], people.parent[n], aggression[n]),
                    *(*people.traits[n], reward_factors(self.parts.optimizer.terms, people.pay[n])),
                    *(advance[n], spread[n]),
                )

    def learning_rows(self, run: Run, report: Report) -> Iterator[Row]:
        """Returns one row for each member that had steps or updates."""
        for i, learnt in report.learnt:
            island = self.parts.optimizer.islands[i]
            figures = (getattr(learnt, name) for name in LEARNING_FIGURES)
            yield (run.epoch, island.first + learnt.row, island.learner.algorithm, *figures)

    def generation_rows(self, run: Run, report: Report) -> Iterator[Row]:
        """Returns one row for each replacement."""
        for x in report.replaced:
            name = self.parts.optimizer.islands[x.island].name
            yield (
                *(run.epoch, name, x.removed, x.parent, x.removed_fitness, x.parent_fitness),
                *(x.removed_age, x.reason, x.second_parent),
            )


def distribution_rows(epoch: int, distribution: TeamDistribution) -> Iterator[Row]:
    """Returns one row for each listed team, and one for all others of a sampled distribution."""
    listed = len(distribution.teams)
    errors = np.zeros(listed) if distribution.error is None else distribution.error
    for team, chance, error in zip(team_names(distribution.teams), distribution.probability, errors, strict=True):
        yield epoch, team, chance, error
    if distribution.samples:
        yield epoch, "other", distribution.other, math.nan


def game_rows(epoch: int, outcomes: Outcomes) -> Iterator[Row]:
    """Returns one row for each game, of its first two sides."""
    lineups = outcomes.lineups
    captures, grabs, tags, walls = (outcomes.event(x)[:, :2] for x in ("captures", "grabs", "tags", "wall_hits"))
    for b in range(len(lineups)):
        yield (
            *(epoch, b, team_name(lineups.teams[b, 0]), team_name(lineups.teams[b, 1])),
            *(*lineups.captains[b, :2], *outcomes.scores[b, :2], outcomes.steps[b]),
            *(*captures[b], *grabs[b], *tags[b], outcomes.seeds[b], *walls[b]),
        )


def side_rows(epoch: int, outcomes: Outcomes) -> Iterator[Row]:
    """Returns one row for each side of each game."""
    lineups, scores = outcomes.lineups, outcomes.scores
    for b, s in np.ndindex(scores.shape):
        yield epoch, b, SIDES[s], team_name(lineups.teams[b, s]), lineups.captains[b, s], scores[b, s]


def opponent_rows(run: Run, met: Met, opponents: Opponents) -> Iterator[Row]:
    """Returns one row for each opponent that the selector's teams met, with what they scored; as it stands after."""
    scores: dict[Guest, list[float]] = {}
    standings = opponents.standings(run.league)
    for met_there, beaten in zip(met.teams, met.beaten, strict=True):
        scores.setdefault(met_there._replace(side=NOBODY), []).append(float(beaten))
    for guest, games in scores.items():
        wins, losses = games.count(1.0), games.count(0.0)
        taken = "" if guest.epoch == NOBODY else guest.epoch
        counts = (len(games), wins, len(games) - wins - losses, losses)
        yield (run.epoch, guest.kind, guest.name, taken, *counts, *standings.get(guest.whose, (math.nan, math.nan)))
