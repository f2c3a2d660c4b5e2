"""From a run to the rows of its tables."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from berteam_cli.evaluation.exploiting import Exploiting
from berteam_cli.learner.base import LEARNING_FIGURES
from berteam_cli.outcomes import Outcomes
from berteam_cli.population import island_of, names
from berteam_cli.records import COLUMNS, Tables, team_name, team_names
from berteam_cli.selector.base import TeamDistribution, measured
from berteam_cli.training import RECORDS, Clock, Parts, Report, Run, generator

Row = tuple[Any, ...]


@dataclass(frozen=True)
class Recorder:
    """Writes a run into its tables.

    Attributes:
        tables: of the run folder.
        parts: of the run.
        every: epochs between two records of members and distributions.
        most_teams: above so many possible teams their distribution is sampled.
        exploiting: measures how exploitable a distribution is.
    """

    tables: Tables
    parts: Parts
    every: int
    most_teams: int
    exploiting: Exploiting

    def epoch(self, run: Run, report: Report) -> None:
        """Records an epoch, and after every ``every``-th one the state it led to."""
        clock = Clock()
        selecting = report.selecting
        entropy = effective = exploited = math.nan
        if run.epoch % self.every == 0:
            distribution = self.state(run)
            entropy = distribution.entropy
            effective = math.exp(entropy)
            exploited = self.exploiting.of(run, distribution)
        self.tables.add("games", game_rows(run.epoch, report.outcomes))
        self.tables.add("learning", self.learning_rows(run, report))
        self.tables.add("generations", self.generation_rows(run, report))
        figures = (selecting.loss, selecting.updates, selecting.buffer, effective, entropy, exploited)
        self.tables.add("selector", [(run.epoch, *figures)])
        clock.lap("record_s")
        seconds = report.seconds | clock.laps | {"epoch": run.epoch, "env_steps": report.env_steps}
        self.tables.add("timing", [tuple(seconds[column] for column in COLUMNS["timing"])])

    def distribution(self, run: Run) -> TeamDistribution:
        """Returns the distribution over teams after ``run.epoch`` epochs."""
        rng = generator(self.parts.seed, RECORDS, run.epoch)
        return measured(self.parts.selector, run.selection, self.most_teams, rng)

    def last(self, run: Run) -> None:
        """Records the state after the last epoch, unless that is done."""
        if run.epoch % self.every:
            self.state(run)

    def state(self, run: Run) -> TeamDistribution:
        """Records the members and the distributions over teams, captains and islands; returns that over teams."""
        distribution = self.distribution(run)
        self.tables.add("agents", self.agent_rows(run))
        rows = [(run.epoch, *row) for row in zip(team_names(distribution.teams), distribution.probability, strict=True)]
        if distribution.samples:
            rows.append((run.epoch, "other", distribution.other))
        self.tables.add("team_distribution", rows)
        captains = self.parts.selector.captains(run.selection)
        self.tables.add("captain_distribution", ((run.epoch, n, chance) for n, chance in enumerate(captains)))
        islands = self.parts.optimizer.islands
        shares = np.bincount(island_of(islands), weights=captains, minlength=len(islands))
        self.tables.add(
            "island_distribution", ((run.epoch, i.name, share) for i, share in zip(islands, shares, strict=True))
        )
        return distribution

    def agent_rows(self, run: Run) -> Iterator[Row]:
        """Returns one row for each member."""
        people = run.population
        fitness = self.parts.optimizer.fitness.shown(people.fitness)
        called = names(self.parts.optimizer.islands, people)
        for island in self.parts.optimizer.islands:
            for n in range(island.first, island.first + island.size):
                yield (
                    *(run.epoch, n, called[n], island.name, island.learner.algorithm, fitness[n]),
                    *(people.age[n], people.games[n], people.captain_games[n], people.parent[n], people.behaviour[n]),
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
                *(x.removed_age, x.reason),
            )


def game_rows(epoch: int, outcomes: Outcomes) -> Iterator[Row]:
    """Returns one row for each game."""
    lineups = outcomes.lineups
    captures, grabs, tags, walls = (outcomes.event(x) for x in ("captures", "grabs", "tags", "wall_hits"))
    for b in range(len(lineups)):
        yield (
            *(epoch, b, team_name(lineups.teams[b, 0]), team_name(lineups.teams[b, 1])),
            *(*lineups.captains[b], *outcomes.scores[b], outcomes.steps[b]),
            *(*captures[b], *grabs[b], *tags[b], outcomes.seeds[b], *walls[b]),
        )
