"""What the loop asks of those who bring other opponents, and the games against these."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies
from berteam_cli.outcomes import NOBODY, Floats, Ints, Lineups, Outcomes
from berteam_cli.population import Population

PAST, PAST_EXPLOITER, SCRIPTED, EXPLOITER = "past", "past_exploiter", "scripted", "exploiter"  # what an opponent is

Choose = Callable[[int, Generator], Lineups]
"""Returns the line-ups of so many games as the selector makes them."""


Whose = tuple[str, int, int]
"""Kind, epoch and island of a guest: what it shares with all who are rated together with it."""


class Guest(NamedTuple):
    """The team of one game that the selector did not choose.

    Attributes:
        kind: PAST, PAST_EXPLOITER, SCRIPTED or EXPLOITER.
        name: of the team, as opponents.csv writes it.
        side: where it stands.
        epoch: after which its members were frozen; NOBODY where they were not.
        island: index of its members' island where all are of one of exploiters; else NOBODY.
    """

    kind: str
    name: str
    side: int
    epoch: int = NOBODY
    island: int = NOBODY

    @property
    def whose(self) -> Whose:
        """With whom it is rated."""
        return self.kind, self.epoch, self.island


@dataclass(frozen=True)
class Guests:
    """Who is met beside the population in one epoch.

    Attributes:
        lineups: G games, in each a guest on one side and teams of the selector on all others.
        policies: rows that follow those of the population's N members in the table of all who play.
        teams: (G,) the guests.
    """

    lineups: Lineups
    policies: Policies
    teams: tuple[Guest, ...]


@dataclass(frozen=True)
class Met:
    """What came of the games against guests."""

    teams: tuple[Guest, ...]
    outcomes: Outcomes

    @property
    def beaten(self) -> Floats:
        """(G,) what each guest's score lacks to 1: 1 where it lost, 0 where it won."""
        sides = [guest.side for guest in self.teams]
        return 1.0 - self.outcomes.scores[np.arange(len(sides)), np.array(sides, dtype=np.int64)]


class Opponents(Protocol):
    """Brings other opponents than the population's teams; keeps settings only."""

    @property
    def games(self) -> int:
        """G, games of an epoch that are against them."""

    def begun(self, population: Population) -> Any:
        """Returns the state before the first epoch."""

    def invited(self, state: Any, members: int, choose: Choose, rng: Generator) -> Guests:
        """Returns who is met in an epoch.

        Args:
            state: of those who bring them.
            members: N, of the population.
            choose: the selector's teams that meet them.
            rng: the only source of chance.
        """

    def renewed(
        self, state: Any, met: Met, population: Population, epoch: int, rng: Generator
    ) -> tuple[Population, Any]:
        """Returns the population and the state after the games of ``epoch``, counted from 1.

        Members may be frozen, and those who exploit the others may begin anew.
        """

    def standings(self, state: Any) -> dict[Whose, tuple[float, float]]:
        """Returns how likely guests would be drawn now, NaN if by no chances, and the estimated chance to beat them."""

    def remarks(self) -> list[str]:
        """Returns what a reader of the run should know of whom it was trained against, a sentence each."""

    def tensors(self, state: Any) -> dict[str, Any]:
        """Returns all that ``state`` holds, frozen policies aside, as named torch tensors, for a checkpoint."""


def nobody(sides: int, team_size: int) -> Guests:
    """Returns no guests in no games."""
    none = np.zeros((0, sides), dtype=np.int64)
    lineups = Lineups(np.zeros((0, sides, team_size), dtype=np.int64), none, np.zeros((0, sides)))
    return Guests(lineups, fixed_policies([]), ())


def hosted(lineups: Lineups, teams: Ints, sides: Ints) -> Lineups:
    """Returns ``lineups`` in which guests, (G, T), take the places of the teams on ``sides``, (G,).

    A guest has no captain, and the selector's chance of it is not known.
    """
    games = np.arange(len(sides))
    who, captains, chances = lineups.teams.copy(), lineups.captains.copy(), lineups.log_chances.copy()
    who[games, sides], captains[games, sides], chances[games, sides] = teams, NOBODY, np.nan
    return Lineups(who, captains, chances)
