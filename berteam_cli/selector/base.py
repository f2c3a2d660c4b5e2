"""What the loop asks of a selector, and what all selectors share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Bools, Experience, Floats, Ints, Lineups, Outcomes

S = TypeVar("S")

NEGLIGIBLE = 1e-9  # probability that rounding leaves


@dataclass(frozen=True)
class Field:
    """Among whom a selector chooses.

    Attributes:
        island_of: (N,) the island of each member.
        team_size: T, places in a team.
        sides: S, teams in a game.
        valid: (T, N) who may stand at each place, at least one member for each; None: everybody anywhere.
        exact_limit: up to so many unordered teams the chances of all of them are told exactly.
    """

    island_of: Ints
    team_size: int
    sides: int = 2
    valid: Bools | None = None
    exact_limit: int = 5000

    @property
    def members(self) -> int:
        """N, the size of the population."""
        return len(self.island_of)

    @property
    def teams(self) -> int:
        """How many unordered teams there are of members who may stand at some place; at most, where places differ."""
        return team_count(int(self.allowed.any(axis=0).sum()), self.team_size)

    @property
    def allowed(self) -> Bools:
        """(T, N) who may stand at each place."""
        everybody = np.ones((self.team_size, self.members), dtype=np.bool_)
        return everybody if self.valid is None else self.valid

    @property
    def alike(self) -> bool:
        """Whether the same members may stand at all places."""
        return bool((self.allowed == self.allowed[0]).all())


@dataclass(frozen=True)
class TeamDistribution:
    """How likely each team is chosen.

    Attributes:
        teams: (K, T) members in ascending order, each team once, in lexicographic order.
        probability: (K,) of the unordered team.
        other: probability of all teams that are not listed.
        samples: how many teams were drawn to estimate it; 0 where it is exact.
        error: (K,) standard error of each probability; None where it is exact.
    """

    teams: Ints
    probability: Floats
    other: float = 0.0
    samples: int = 0
    error: Floats | None = None

    @property
    def entropy(self) -> float:
        """Entropy over all teams, in nats; NaN where they are not all listed, each with its exact chance.

        Shares of drawn teams do not tell it: of many teams most are drawn once or never.
        """
        if self.samples or self.other > NEGLIGIBLE:
            return math.nan
        chances = self.probability[self.probability > 0]
        return float(-(chances * np.log(chances)).sum()) + 0.0  # a sure team has 0, not -0


@dataclass(frozen=True)
class Selecting:
    """What a selector did in one epoch.

    Attributes:
        updates: gradient steps.
        skipped: updates that were due, with nothing to learn from.
        loss: their mean loss, NaN without any.
        buffer: teams it learns from now.
    """

    updates: int = 0
    loss: float = float("nan")
    buffer: int = 0
    skipped: int = 0


class Plain:
    """What holds of selectors that say nothing else: they neither look at games nor answer them."""

    @property
    def observes(self) -> bool:
        """Returns False: it does not look at games."""
        return False

    @property
    def seen_bytes(self) -> int:
        """Returns 0: it remembers nothing of what players saw."""
        return 0

    @property
    def answers(self) -> bool:
        """Returns False: it chooses each team by itself."""
        return False

    @property
    def by_side(self) -> bool:
        """Returns False: a team's chance is the same on every side."""
        return False

    def lists(self, state: Any) -> bool:
        """Returns False: it chooses from all teams there can be."""
        return False

    def remarks(self) -> list[str]:
        """Returns nothing to remark."""
        return []


class Selector(Protocol[S]):
    """Chooses who plays together; keeps settings only, all that it learns is in ``S``."""

    @property
    def field(self) -> Field:
        """Among whom it chooses."""

    @property
    def observes(self) -> bool:
        """Whether ``learn`` wants to know what the players saw."""

    @property
    def seen_bytes(self) -> int:
        """Bytes that it takes to remember what they saw."""

    @property
    def answers(self) -> bool:
        """Whether every second game of an epoch is against the opponents of the one before.

        The team for it is chosen by ``answer``, on what was seen of them.
        """

    @property
    def by_side(self) -> bool:
        """Whether a team's chance depends on the side it plays.

        Then ``sample`` and ``distribution`` take a ``side``, and without one mean a team for each side in turn.
        """

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
        """Returns how likely each unordered team is, exactly. Lists every team whose chance is not 0."""

    def lists(self, state: S) -> bool:
        """Returns whether it chooses from a list of teams, whose chances are known however many there could be."""

    def likeliest(self, state: S, count: int, rng: Generator) -> TeamDistribution:
        """Returns the ``count`` most probable unordered teams, or those that a search among very many finds."""

    def captains(self, state: S) -> Floats:
        """Returns (N,) how likely each member is the first to be chosen for a team."""

    def learn(
        self, state: S, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[S, Selecting]:
        """Returns the state after the games of one epoch; ``state`` itself stays as it was.

        Args:
            state: what was learnt so far.
            outcomes: of the epoch's B games; where the selector answers, the second half answers the first.
            seen: what the players saw in them; without rows unless the selector observes or somebody learns.
            fitness: (N,) of the members, on the scale of the fitness rule.
            rng: the only source of chance.
        """

    def tensors(self, state: S) -> dict[str, Any]:
        """Returns all that ``state`` holds as named torch tensors (no copies), for a checkpoint."""

    def restored(self, tensors: dict[str, Any]) -> S:
        """Returns the state that ``tensors`` gave these."""

    def remarks(self) -> list[str]:
        """Returns what a reader of the run's log should know of how this selector was set, a sentence each."""


class Answering(Selector[S], Protocol[S]):
    """A selector that may choose a team for a second game against an opponent, on what was seen in the first."""

    def answer(self, state: S, lineups: Lineups, seen: Experience, ages: Ints, rng: Generator) -> Lineups:
        """Returns a second game for each of ``lineups``, in which one side chooses anew and the others stay.

        Side b % S of game b chooses. Its ``log_chances`` are those of the new team; those of teams that stay are NaN.
        """


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
    return math.factorial(teams.shape[1]) / repeats(teams).prod(axis=1)


def log_orderings(teams: Ints) -> Floats:
    """Returns (K,) ln of ``orderings``, for teams of any size."""
    return math.lgamma(teams.shape[1] + 1) - np.log(repeats(teams)).sum(axis=1)


def repeats(teams: Ints) -> Floats:
    """Returns (K, T) how many times the member at each place of ``teams``, ascending, has stood so far."""
    run = np.ones(teams.shape)
    for place in range(1, teams.shape[1]):
        run[:, place] = np.where(teams[:, place] == teams[:, place - 1], run[:, place - 1] + 1, 1)
    return run


SAMPLES = 20_000  # teams drawn where they are too many to list
PLACES_ASKED = 200_000  # or fewer, where teams are large: a drawn team costs a network T^2 places


def sample_size(team_size: int) -> int:
    """Returns how many teams are drawn to estimate a distribution."""
    return max(20, min(SAMPLES, PLACES_ASKED // team_size**2))


def exactly(field: Field) -> bool:
    """Returns whether the chances of all teams are told exactly.

    They are where there are at most ``field.exact_limit``, unless the ordered partial teams that a network must be
    asked about, T N^(T - 1), are more than 20 for each of ``exact_limit``.
    """
    asked = field.team_size * field.members ** (field.team_size - 1)
    return team_count(field.members, field.team_size) <= field.exact_limit and asked <= 20 * field.exact_limit


def measured(selector: Selector[Any], state: Any, rng: Generator, **side: int) -> TeamDistribution:
    """Returns the distribution over teams: exact where ``exactly`` says so, else that of drawn ones.

    With ``side`` it is that for one side, of a selector that tells them apart. A sampled distribution lists the
    ``exact_limit`` most frequent teams with the standard errors of their shares; the rest is its ``other``.
    """
    if exactly(selector.field) or selector.lists(state):
        return selector.distribution(state, **side)
    samples = sample_size(selector.field.team_size)
    drawn = np.sort(selector.sample(state, samples, rng, **side), axis=1)
    teams, counts = np.unique(drawn, axis=0, return_counts=True)
    listed = np.sort(np.argsort(-counts, kind="stable")[: selector.field.exact_limit])
    share = counts[listed] / samples
    error = np.sqrt(share * (1 - share) / samples)
    return TeamDistribution(teams[listed], share, max(0.0, 1.0 - float(share.sum())), samples, error)


def most_probable(distribution: TeamDistribution, count: int) -> TeamDistribution:
    """Returns the ``count`` most probable teams of an exact ``distribution``; the rest is its ``other``."""
    top = np.sort(np.argsort(-distribution.probability, kind="stable")[:count])
    chances = distribution.probability[top]
    return TeamDistribution(distribution.teams[top], chances, max(0.0, 1.0 - float(chances.sum())))
