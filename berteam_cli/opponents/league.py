"""The past, scripted policies and exploiters together; each may be absent."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies, joined
from berteam_cli.opponents.base import Choose, Guest, Guests, Met, Whose, hosted
from berteam_cli.opponents.exploiters import Attempt, Exploiters, anew
from berteam_cli.opponents.past import Past, Snapshot, taken, thinned
from berteam_cli.opponents.record import Record
from berteam_cli.opponents.scripted import Scripted
from berteam_cli.outcomes import Ints
from berteam_cli.population import Island, Population

log = logging.getLogger("berteam")


@dataclass(frozen=True, eq=False)
class LeagueState:
    """What changes.

    Attributes:
        pool: the snapshots, in the order in which they were taken.
        attempts: of the islands of exploiters.
    """

    pool: tuple[Snapshot, ...] = ()
    attempts: tuple[Attempt, ...] = ()


@dataclass(frozen=True, eq=False)
class League:
    """Brings opponents of up to three kinds.

    Attributes:
        islands: of the population.
        sides: S.
        team_size: T.
        past, scripted, exploiters: of each kind; None: there are none.
    """

    islands: tuple[Island, ...]
    sides: int
    team_size: int
    past: Past | None = None
    scripted: Scripted | None = None
    exploiters: Exploiters | None = None

    @property
    def games(self) -> int:
        """G, games of an epoch that are against them."""
        return sum(kind.games for kind in (self.past, self.scripted, self.exploiters) if kind)

    def most_snapshots(self, epochs: int) -> int:
        """Returns how many snapshots the pool may hold in a run of so many ``epochs``."""
        if self.past is None:
            return 0
        exploiting = len(self.exploiters.begun()) if self.exploiters else 0
        return min(self.past.pool_size, 1 + epochs // self.past.snapshot_every + epochs * exploiting)

    def begun(self, population: Population) -> LeagueState:
        """Returns the state before the first epoch: the pool holds the members of the beginning."""
        pool = (self.past.frozen(self.islands, population, 0),) if self.past else ()
        return LeagueState(pool, self.exploiters.begun() if self.exploiters else ())

    def invited(self, state: LeagueState, members: int, choose: Choose, rng: Generator) -> Guests:
        """Returns who is met in an epoch; see Opponents.invited."""
        lineups = choose(self.games, rng)
        sides = rng.integers(self.sides, size=self.games)
        teams: list[Ints] = []
        tables: list[Policies] = [fixed_policies([])]
        guests: list[Guest] = []

        def seats(games: int) -> Ints:
            return sides[len(guests) : len(guests) + games]

        if self.past:
            who, added, named = self.past.invited(state.pool, members, self.team_size, seats(self.past.games), rng)
            teams, tables, guests = [who], [*tables, *added], named
        if self.scripted:
            first = members + sum(len(table.kind) for table in tables)
            who, added, named = self.scripted.invited(first, self.team_size, seats(self.scripted.games), rng)
            teams, tables, guests = [*teams, who], [*tables, *added], [*guests, *named]
        if self.exploiters:
            who, named = self.exploiters.invited(self.islands, self.team_size, seats(self.exploiters.games), rng)
            teams, guests = [*teams, who], [*guests, *named]
        return Guests(hosted(lineups, np.concatenate(teams), sides), joined(tables), tuple(guests))

    def renewed(
        self, state: LeagueState, met: Met, population: Population, epoch: int, rng: Generator
    ) -> tuple[Population, LeagueState]:
        """Returns the population and the state after the games of ``epoch``; see Opponents.renewed."""
        state = self.counted(state, met)
        pool, attempts = list(state.pool), list(state.attempts)
        if self.past and epoch % self.past.snapshot_every == 0:
            pool.append(self.past.frozen(self.islands, population, epoch))
        for k, attempt in enumerate(attempts if self.exploiters else []):
            assert self.exploiters is not None, "there are attempts of nobody"
            if not self.exploiters.ends(attempt, epoch):
                continue
            island, score = self.islands[attempt.island], 1 - self.exploiters.beaten(attempt)
            if self.past:
                pool.append(taken(self.islands, population, np.array(island.numbers), epoch, attempt.island))
            population = anew(self.islands, population, attempt.island, rng)
            attempts[k] = Attempt(attempt.island, epoch)
            log.info(
                "Exploiters of island %s begin anew after epoch %d, with a score of %.2f.", island.name, epoch, score
            )
        kept = thinned(tuple(pool), self.past.pool_size) if self.past else ()
        return population, LeagueState(kept, tuple(attempts))

    def counted(self, state: LeagueState, met: Met) -> LeagueState:
        """Returns the state with the games of an epoch in the records."""
        beaten: dict[Whose, list[float]] = {}
        for guest, score in zip(met.teams, met.beaten, strict=True):
            beaten.setdefault(guest.whose, []).append(float(score))

        def after(known: Snapshot | Attempt, half_life: float) -> Record:
            scores = beaten.get(known.whose, [])
            return known.record.after(sum(scores), len(scores), half_life)

        pool, attempts = state.pool, state.attempts
        if self.past:
            pool = tuple(replace(x, record=after(x, self.past.half_life)) for x in pool)
        if self.exploiters:
            attempts = tuple(replace(x, record=after(x, self.exploiters.half_life)) for x in attempts)
        return LeagueState(pool, attempts)

    def standings(self, state: LeagueState) -> dict[Whose, tuple[float, float]]:
        """Returns how likely guests would be drawn now, and the estimated chance to beat them; see Opponents."""
        known: dict[Whose, tuple[float, float]] = {}
        if self.past:
            chances = self.past.chances(state.pool).tolist()
            known |= {x.whose: (p, self.past.estimate(x)) for x, p in zip(state.pool, chances, strict=True)}
        if self.exploiters:
            known |= {x.whose: (math.nan, self.exploiters.beaten(x)) for x in state.attempts}
        return known

    def remarks(self) -> list[str]:
        """Returns whom the run is trained against, beside itself."""
        said = []
        if self.past:
            said.append("past members")
        if self.scripted:
            said.append(f"scripted: {', '.join(self.scripted.names)}")
        if self.exploiters:
            said.append(f"exploiters: {', '.join(self.islands[i].name for i in self.exploiters.islands)}")
        return said

    def tensors(self, state: LeagueState) -> dict[str, Any]:
        """Returns all that ``state`` holds, frozen policies aside, as named tensors."""
        pool = [(*x.key, x.checksum) for x in state.pool]
        attempts = [(x.island, x.began) for x in state.attempts]
        return {
            "pool": torch.tensor(pool, dtype=torch.int64).reshape(-1, 3),
            "pool_records": torch.tensor([x.record for x in state.pool], dtype=torch.float64).reshape(-1, 2),
            "attempts": torch.tensor(attempts, dtype=torch.int64).reshape(-1, 2),
            "attempt_records": torch.tensor([x.record for x in state.attempts], dtype=torch.float64).reshape(-1, 2),
        }
