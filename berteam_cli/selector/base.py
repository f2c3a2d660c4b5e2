"""What the loop asks of a selector, and what all selectors share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Floats, Ints, Lineups, Outcomes

S = TypeVar("S")


@dataclass(frozen=True)
class Field:
    """Among whom a selector chooses.

    Attributes:
        island_of: (N,) the island of each member.
        team_size: T, places in a team.
        sides: S, teams in a game.
    """

    island_of: Ints
    team_size: int
    sides: int = 2

    @property
    def members(self) -> int:
        """N, the size of the population."""
        return len(self.island_of)


@dataclass(frozen=True)
class TeamDistribution:
    """How likely each team is chosen.

    Attributes:
        teams: (K, T) members in ascending order, each team once, in lexicographic order.
        probability: (K,) of the unordered team.
        other: probability of all teams that are not listed.
        samples: how many teams were drawn to estimate it; 0 where it is exact.
    """

    teams: Ints
    probability: Floats
    other: float = 0.0
    samples: int = 0

    @property
    def entropy(self) -> float:
        """Entropy over the listed teams, in nats; ``other`` counts as one team."""
        chances = np.append(self.probability, self.other)
        chances = chances[chances > 0]
        return float(-(chances * np.log(chances)).sum())


@dataclass(frozen=True)
class Selecting:
    """What a selector did in one epoch.

    Attributes:
        updates: gradient steps.
        loss: their mean loss, NaN without any.
        buffer: teams it learns from now.
    """

    updates: int = 0
    loss: float = float("nan")
    buffer: int = 0


class Selector(Protocol[S]):
    """Chooses who plays together; keeps settings only, all that it learns is in ``S``."""

    field: Field

    def init(self, rng: Generator) -> S:
        """Returns the state before the first game."""

    def select(self, state: S, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns the teams and captains of ``games`` games.

        Args:
            state: what was learnt so far.
            games: B.
            ages: (N,) epochs since each member was last replaced.
            rng: the only source of chance.
        """

    def sample(self, state: S, count: int, rng: Generator) -> Ints:
        """Returns (count, T) teams as the selector would make them of its own will: no noise, no given captains."""

    def distribution(self, state: S) -> TeamDistribution:
        """Returns how likely each unordered team is, exactly. Asks for one row for each possible team."""

    def captains(self, state: S) -> Floats:
        """Returns (N,) how likely each member is the first to be chosen for a team."""

    def learn(self, state: S, outcomes: Outcomes, rng: Generator) -> tuple[S, Selecting]:
        """Returns the state after the games of one epoch; ``state`` itself stays as it was."""

    def tensors(self, state: S) -> dict[str, Any]:
        """Returns all that ``state`` holds as named torch tensors (no copies), for a checkpoint."""

    def restored(self, tensors: dict[str, Any]) -> S:
        """Returns the state that ``tensors`` gave these."""


def team_count(members: int, team_size: int) -> int:
    """Returns the number of unordered teams, members repeating."""
    return math.comb(members + team_size - 1, team_size)


def unordered_teams(members: int, team_size: int) -> Ints:
    """Returns (K, T) every unordered team, members ascending, in lexicographic order."""
    count = team_count(members, team_size)
    flat = np.fromiter(
        (m for team in combinations_with_replacement(range(members), team_size) for m in team),
        dtype=np.int64,
        count=count * team_size,
    )
    return flat.reshape(count, team_size)


def orderings(teams: Ints) -> Floats:
    """Returns (K,) in how many orders the members of each of ``teams``, (K, T) ascending, can stand."""
    size = teams.shape[1]
    counts = np.ones(len(teams))
    run = np.ones(len(teams))  # how long the current run of equal members is
    for place in range(1, size):
        run = np.where(teams[:, place] == teams[:, place - 1], run + 1, 1)
        counts *= run
    return math.factorial(size) / counts


SAMPLES = 20_000  # teams drawn where they are too many to list


def measured(selector: Selector[Any], state: Any, most: int, rng: Generator) -> TeamDistribution:
    """Returns the distribution over teams: exact if there are at most ``most``, else that of SAMPLES drawn ones.

    A sampled distribution lists the ``most`` most frequent teams; the rest is its ``other``. It is sampled too where
    the ordered teams, whose number decides what an exact one costs, are more than 20 for each of ``most``.
    """
    field = selector.field
    ordered = field.members**field.team_size
    if team_count(field.members, field.team_size) <= most and ordered <= 20 * most:
        return selector.distribution(state)
    drawn = np.sort(selector.sample(state, SAMPLES, rng), axis=1)
    teams, counts = np.unique(drawn, axis=0, return_counts=True)
    listed = np.sort(np.argsort(-counts, kind="stable")[:most])
    probability = counts[listed] / SAMPLES
    return TeamDistribution(teams[listed], probability, max(0.0, 1.0 - float(probability.sum())), SAMPLES)
