"""How aggressive members and teams are, and how much of a distribution is on teams of either manner."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.optimizer.aggression import aggression
from berteam_cli.outcomes import Floats, Ints, Outcomes
from berteam_cli.population import island_of, names
from berteam_cli.rating.bootstrap import RESAMPLES, interval
from berteam_cli.records import team_names
from berteam_cli.selector.base import TeamDistribution
from berteam_cli.training import Parts, Run

DEFENSIVE, NEUTRAL, AGGRESSIVE = "defensive", "neutral", "aggressive"
BALANCED, OTHER = "balanced", "other"


@dataclass(frozen=True)
class Manners:
    """How K teams behave in games of two sides, G games each.

    Attributes:
        ratios: (K, G) aggression in each game.
        made: tags, times_tagged, captures, grabs and wall_hits, (K,) each: means per game, of the team as a whole.
        copies: (K, G) how often each game was played; 0 of those that are copies of an earlier one.
    """

    ratios: Floats
    made: dict[str, Floats]
    copies: Ints

    @property
    def aggression(self) -> Floats:
        """(K,) mean over the games; above 1 is aggressive, below defensive."""
        return self.ratios.mean(axis=1)

    def interval(self, rng: Generator) -> tuple[Floats, Floats]:
        """Returns (K,) the ends of the 95 % intervals of the aggression, from drawing games anew (bootstrap).

        A game and its copies are drawn together.
        """
        drawn = [resampled(*team, rng) for team in zip(self.ratios, self.copies, strict=True)]
        return interval(np.stack(drawn, axis=1))


def resampled(ratios: Floats, copies: Ints, rng: Generator) -> Floats:
    """Returns (R,) means of (G,) ``ratios`` of games drawn anew, which have so many ``copies``."""
    first = np.flatnonzero(copies)
    times = rng.multinomial(len(first), np.full(len(first), 1 / len(first)), size=RESAMPLES) * copies[first]
    return times @ ratios[first] / times.sum(axis=1)


def manners(outcomes: Outcomes, copies: Ints) -> Manners:
    """Returns how K teams behaved that are side 0 in the record of every game, equally many in a row.

    Args:
        outcomes: of K G games.
        copies: (K, G) how often each was played; see ``Manners``.
    """
    teams = len(copies)
    counts = {name: outcomes.event(name)[:, 0] for name in ("tags", "captures", "grabs", "wall_hits")}
    counts["times_tagged"] = outcomes.event("tags")[:, 1]
    return Manners(
        aggression(outcomes).reshape(teams, -1),
        {name: count.reshape(teams, -1).mean(axis=1) for name, count in counts.items()},
        copies,
    )


def group(value: float) -> str:
    """Returns what a member of this aggression is called."""
    return NEUTRAL if value == 1 else AGGRESSIVE if value > 1 else DEFENSIVE


def kinds(teams: Ints, members: Floats) -> list[str]:
    """Returns what each of (K, T) ``teams`` is called: as its ``members``, (N,) of aggression, if all are alike.

    A team of several manners, or of members who are neither, is balanced.
    """
    found = []
    for team in members[teams]:
        called = {group(value) for value in team}
        found.append(called.pop() if len(called) == 1 and called != {NEUTRAL} else BALANCED)
    return found


def composition(distribution: TeamDistribution, members: Floats) -> list[tuple[str, int, float]]:
    """Returns each kind of team with how many teams are listed of it, and how likely one of them is chosen.

    Args:
        distribution: over teams; what it does not list is a kind of its own, of unknown teams.
        members: (N,) their aggression.
    """
    called = np.array(kinds(distribution.teams, members), dtype=object)
    rows = [
        (kind, int((called == kind).sum()), float(distribution.probability[called == kind].sum()))
        for kind in (DEFENSIVE, BALANCED, AGGRESSIVE)
    ]
    if distribution.samples:
        rows.append((OTHER, 0, distribution.other))
    return rows


def member_rows(run: Run, parts: Parts, behaved: Manners, rng: Generator) -> list[tuple[Any, ...]]:
    """Returns the rows of members.csv, of teams made only of one member each."""
    islands = parts.optimizer.islands
    called, home, shown = names(islands, run.population), island_of(islands), behaved.aggression
    low, high = behaved.interval(rng)
    made = [behaved.made[name] for name in ("tags", "times_tagged", "captures", "grabs", "wall_hits")]
    games = behaved.ratios.shape[1]
    return [
        (
            *(run.epoch, n, called[n], islands[home[n]].name, shown[n], low[n], high[n]),
            *(*(count[n] for count in made), group(shown[n]), games),
        )
        for n in range(len(shown))
    ]


def team_rows(teams: Ints, behaved: Manners, members: Floats) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of teams.csv without the epoch; ``members`` is (N,) their aggression."""
    games = behaved.ratios.shape[1]
    for row in zip(team_names(teams), behaved.aggression, kinds(teams, members), strict=True):
        yield (*row, games)
