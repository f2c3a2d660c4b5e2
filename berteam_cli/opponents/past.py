"""The pool of the past: members as they were, and which of them are met.

Prioritised fictitious self-play as in AlphaStar (Vinyals et al. 2019, Nature 575, Methods): who is hard to beat is met
more often.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.opponents.base import PAST, PAST_EXPLOITER, Guest, Whose
from berteam_cli.opponents.record import Record
from berteam_cli.optimizer.fitness import proportional
from berteam_cli.outcomes import NOBODY, Floats, Ints
from berteam_cli.population import Island, Population, learners, policies
from berteam_cli.records import team_name


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Members as they were.

    Attributes:
        epoch: after which they were frozen.
        island: index of the island of exploiters they are of; NOBODY for members that are chosen for teams.
        members: (K,) their places in the population.
        policies: K rows, how they acted in training games.
        record: of the games against them.
        checksum: of their file; 0 as long as they have none.
    """

    epoch: int
    island: int
    members: Ints
    policies: Policies
    record: Record = field(default_factory=Record)
    checksum: int = 0

    @property
    def key(self) -> tuple[int, int]:
        """What tells it from others."""
        return self.epoch, self.island

    @property
    def kind(self) -> str:
        """What a team of it is as an opponent."""
        return PAST if self.island == NOBODY else PAST_EXPLOITER

    @property
    def whose(self) -> Whose:
        """What its teams are as guests."""
        return self.kind, *self.key


@dataclass(frozen=True)
class Past:
    """Settings of the pool.

    Attributes:
        games: of an epoch that are against it.
        snapshot_every: epochs between two snapshots.
        snapshot_members: so many of the fittest are frozen; None: all that learn.
        pool_size: snapshots that are kept.
        draw: "uniform" or "prioritised".
        power: of the weight (1 - p)^power; p is the estimated chance to beat the snapshot.
        mix_uniform: share of prioritised draws in which all are alike.
        prior_games: games that an estimate begins with.
        half_life: epochs after which a game counts half in it; 0: in full for ever.
        prior: mean score of the games that an estimate begins with.
    """

    games: int
    snapshot_every: int
    snapshot_members: int | None
    pool_size: int
    draw: str
    power: float
    mix_uniform: float
    prior_games: float
    half_life: float
    prior: float

    def frozen(self, islands: tuple[Island, ...], population: Population, epoch: int) -> Snapshot:
        """Returns the members that learn and are chosen for teams, or the fittest of them, as they act now."""
        able = np.array(learners(islands))
        fittest_first = able[np.argsort(-population.fitness[able], kind="stable")]
        return taken(islands, population, np.sort(fittest_first[: self.snapshot_members]), epoch, NOBODY)

    def invited(
        self, pool: tuple[Snapshot, ...], first: int, team_size: int, sides: Ints, rng: Generator
    ) -> tuple[Ints, list[Policies], list[Guest]]:
        """Returns the teams of the past that are met.

        A team is of one snapshot; each of its places is given to any of that snapshot's members alike.

        Args:
            pool: at least one snapshot.
            first: row of the first frozen member in the table of all who play.
            team_size: T.
            sides: (games,) where they stand.
            rng: the only source of chance.

        Returns:
            (games, T) rows, the policies of these rows in order, and the guests.
        """
        drawn = rng.choice(len(pool), size=len(sides), p=self.chances(pool))
        teams, tables, guests = np.empty((len(sides), team_size), dtype=np.int64), [], []
        places = [rng.integers(len(pool[k].members), size=team_size) for k in drawn]
        for k in np.unique(drawn):
            games = np.flatnonzero(drawn == k)
            used, rows = np.unique(np.stack([places[g] for g in games]), return_inverse=True)
            teams[games] = first + rows.reshape(len(games), team_size)
            first += len(used)
            tables.append(chosen_rows(pool[k].policies, used))
        for k, row, side in zip(drawn, places, sides, strict=True):
            name = f"{pool[k].epoch}:{team_name(pool[k].members[row])}"
            guests.append(Guest(pool[k].kind, name, int(side), *pool[k].key))
        return teams, tables, guests

    def chances(self, pool: Sequence[Snapshot]) -> Floats:
        """Returns (K,) how likely each snapshot is drawn."""
        uniform = np.full(len(pool), 1 / len(pool))
        if self.draw == "uniform":
            return uniform
        beaten = np.array([self.estimate(snapshot) for snapshot in pool])
        return self.mix_uniform * uniform + (1 - self.mix_uniform) * proportional((1 - beaten) ** self.power)

    def estimate(self, snapshot: Snapshot) -> float:
        """Returns the estimated chance to beat a snapshot."""
        return snapshot.record.chance(self.prior_games, self.prior)


def thinned(pool: tuple[Snapshot, ...], most: int) -> tuple[Snapshot, ...]:
    """Returns at most ``most`` >= 2 snapshots of ``pool``, which is in order, each kind spread over its time.

    A kind are the population's own snapshots, or those of one island of exploiters. As long as there are too many, the
    one goes whose neighbours of its kind are nearest to each other, of several one of exploiters, and of these the
    oldest. So exploiters that often begin anew push out each other, not the population's own past, whose first and last
    stay.
    """
    kept = list(pool)
    while len(kept) > most:
        gaps = np.full(len(kept), np.inf)
        for kind in {x.island for x in kept}:
            alike = [k for k, x in enumerate(kept) if x.island == kind]
            for before, k, after in zip(alike, alike[1:], alike[2:], strict=False):
                gaps[k] = kept[after].epoch - kept[before].epoch
        del kept[min(range(len(kept)), key=lambda k: (gaps[k], kept[k].island == NOBODY, k))]
    return tuple(kept)


def taken(islands: tuple[Island, ...], population: Population, members: Ints, epoch: int, island: int) -> Snapshot:
    """Returns a snapshot of ``members``, (K,), that shares no memory with the population."""
    rows = chosen_rows(policies(islands, population, explore=True), members)
    return Snapshot(epoch, island, members, rows)


def chosen_rows(table: Policies, rows: Ints) -> Policies:
    """Returns copies of ``rows``, (K,), of ``table``."""
    return Policies._make(np.ascontiguousarray(column[rows]) for column in table)
