"""The population: its islands (settings) and its members (state)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies, joined
from berteam_cli.learner.base import Learner
from berteam_cli.learner.traits import traits_of
from berteam_cli.outcomes import BEHAVIOURS, NOBODY, Bools, Floats, Ints, Outcomes


@dataclass(frozen=True)
class Origin:
    """Where the members of an island come from that another run has.

    Attributes:
        run: its folder, as the config says it.
        epoch: after which they are as they are.
        members: (M,) what they are called there.
    """

    run: str
    epoch: int
    members: tuple[str, ...]


@dataclass(frozen=True)
class Island:
    """Members that learn in the same way and replace each other.

    Attributes:
        name: of the island.
        first: index of its first member in the population.
        size: M, how many members it has.
        learner: how they learn.
        exploits: whether they are never chosen for teams, but play against those who are.
        origin: of members of another run; None of all others.
    """

    name: str
    first: int
    size: int
    learner: Learner[Any]
    exploits: bool = False
    origin: Origin | None = None

    @property
    def members(self) -> slice:
        """Where its members stand in an array over the population."""
        return slice(self.first, self.first + self.size)

    @property
    def numbers(self) -> range:
        """Its members, one after the other."""
        return range(self.first, self.first + self.size)

    @property
    def learns(self) -> bool:
        """Whether its members change."""
        return self.learner.algorithm not in {"fixed", "imported"}


@dataclass(frozen=True)
class Population:
    """What is known of N members; a member is a place that a copy of another may take over.

    Attributes:
        minds: one learner's state for each island.
        fitness: (N,) on the scale of the fitness rule: nats of Elo, or a mean score in [0, 1].
        age: (N,) epochs since the place was last taken over.
        games: (N,) games played since then, a game on several sides counted for each.
        captain_games: (N,) of them as captain.
        parent: (N,) whose copy the member is, NOBODY for those of the beginning.
        behaviour: (N, D) BEHAVIOURS as last measured, NaN before.
        stale: (N,) whether the member's policy changed since its behaviour was measured.
        failed: (N,) epochs in a row in which all its updates were undone, since they gave something not finite.
        traits: (N, H) the member's own settings, of TRAITS; NaN where its learner has none.
        pay: (N, P) by what the weight of each term of the game's reward is multiplied for it; P = 0 where all are paid
            alike.
    """

    minds: tuple[Any, ...]
    fitness: Floats
    age: Ints
    games: Ints
    captain_games: Ints
    parent: Ints
    behaviour: Floats
    stale: Bools
    failed: Ints
    traits: Floats
    pay: Floats

    @property
    def size(self) -> int:
        """N."""
        return len(self.fitness)


ARRAYS = ("fitness", "age", "games", "captain_games", "parent", "behaviour", "stale", "failed", "traits", "pay")


def founded(islands: tuple[Island, ...], fitness: float, rng: Generator, terms: int = 0) -> Population:
    """Returns the population before the first epoch, everyone with the same ``fitness``.

    Args:
        islands: of the population.
        fitness: of everyone.
        rng: where weights are drawn from.
        terms: P, for how many terms of the reward members have factors of their own.
    """
    members = sum(island.size for island in islands)
    streams = rng.spawn(len(islands))
    return Population(
        minds=tuple(i.learner.init(i.size, stream) for i, stream in zip(islands, streams, strict=True)),
        fitness=np.full(members, fitness),
        age=np.zeros(members, dtype=np.int64),
        games=np.zeros(members, dtype=np.int64),
        captain_games=np.zeros(members, dtype=np.int64),
        parent=np.full(members, NOBODY, dtype=np.int64),
        behaviour=np.full((members, len(BEHAVIOURS)), np.nan),
        stale=np.ones(members, dtype=np.bool_),
        failed=np.zeros(members, dtype=np.int64),
        traits=np.repeat([traits_of(i.learner) for i in islands], [i.size for i in islands], axis=0),
        pay=np.ones((members, terms)),
    )


def learners(islands: tuple[Island, ...]) -> list[int]:
    """Returns the members that learn and are chosen for teams: no exploiters."""
    return [n for island in islands if island.learns and not island.exploits for n in island.numbers]


def rated(islands: tuple[Island, ...]) -> Bools:
    """Returns (N,) who is chosen for teams, and so rated: all but exploiters."""
    return ~np.repeat([island.exploits for island in islands], [island.size for island in islands])


def island_of(islands: tuple[Island, ...]) -> Ints:
    """Returns (N,) the island of each member."""
    return np.repeat(np.arange(len(islands)), [island.size for island in islands])


def names(islands: tuple[Island, ...], population: Population) -> list[str]:
    """Returns what every member is called."""
    return [
        name
        for island, mind in zip(islands, population.minds, strict=True)
        for name in island.learner.names(mind, island.name)
    ]


def policies(islands: tuple[Island, ...], population: Population, *, explore: bool) -> Policies:
    """Returns how every member acts; without ``explore`` as it is evaluated."""
    return joined(
        [island.learner.policies(mind, explore=explore) for island, mind in zip(islands, population.minds, strict=True)]
    )


def counted(population: Population, outcomes: Outcomes) -> Population:
    """Returns the population with the games of ``outcomes`` added to its counters."""
    size = population.size
    # A member that holds two places of one team plays one game for that side.
    sides = np.sort(outcomes.lineups.teams.reshape(-1, outcomes.lineups.teams.shape[-1]), axis=1)
    first = np.ones(sides.shape, dtype=np.bool_)
    first[:, 1:] = sides[:, 1:] != sides[:, :-1]
    captains = outcomes.lineups.captains.ravel()
    return replace(
        population,
        games=population.games + np.bincount(sides[first], minlength=size),
        captain_games=population.captain_games + np.bincount(captains[captains != NOBODY], minlength=size),
    )
