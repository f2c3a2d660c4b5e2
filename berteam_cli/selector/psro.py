"""A mixture of the teams found so far that no other of them beats; after PSRO (Lanctot et al. 2017) and Team-PSRO.

The teams found so far play a matrix game, whose payoffs are estimated from the games of the run; a solver tells in what
mixture to play them. Beside them candidates are tried against that mixture, and the best of them joins.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.evaluation.equilibria import nash, projected_replicator
from berteam_cli.outcomes import Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector.base import Selecting
from berteam_cli.selector.listed import Listed, Mixture, fresh, new_among, picked, places_of, random_teams

SOLVERS = ("uniform", "nash", "replicator")


@dataclass(frozen=True)
class PsroState:
    """What is known of the teams.

    Attributes:
        found: (K, T) teams of the mixture.
        strategy: (K,) the mixture.
        candidates: (C, T) teams that are tried.
        gains: (K + C, K + C) antisymmetric, wins minus losses of the row against the column, found teams first.
        games: (K + C, K + C) symmetric, how many.
        epochs: learnt from so far.
    """

    found: Ints
    strategy: Floats
    candidates: Ints
    gains: Floats
    games: Floats
    epochs: int

    @property
    def teams(self) -> Ints:
        """(K + C, T) the found teams and then the candidates."""
        return np.concatenate([self.found, self.candidates])

    @property
    def payoff(self) -> Floats:
        """(K, K) mean gain of each found team against each, as if every two had drawn once beside their games."""
        size = len(self.found)
        return self.gains[:size, :size] / (self.games[:size, :size] + 1.0)

    @property
    def trials(self) -> Floats:
        """(C,) games of each candidate against found teams."""
        return self.games[len(self.found) :, : len(self.found)].sum(axis=1)


@dataclass(frozen=True, eq=False)
class Psro(Listed):
    """Plays the solution of the matrix game between the teams found so far.

    Attributes:
        start: found teams at first, random ones.
        solver: "uniform", all found teams alike; "nash", by a linear programme; or "replicator", projected replicator
            dynamics.
        gamma: share that the replicator dynamics spread over all found teams.
        expand_every: epochs after which a candidate joins.
        candidates: teams tried meanwhile: half of them random, half like a team of the mixture but for one place.
        capacity: most teams found; above, the one that is played least is forgotten.
        half_life: epochs after which a game counts half; 0 for always in full.
    """

    start: int
    solver: str
    gamma: float
    expand_every: int
    candidates: int
    capacity: int
    half_life: float

    def __post_init__(self) -> None:
        """Refuses settings that exclude each other."""
        if self.solver not in SOLVERS:
            raise ValueError(f"selector.solver must be one of {', '.join(SOLVERS)}, but is {self.solver}.")
        if self.start > self.capacity:
            raise ValueError(f"selector.start must be at most selector.capacity, {self.capacity}, but is {self.start}.")

    def init(self, rng: Generator) -> PsroState:
        """Returns random teams, all as likely, that have not played."""
        nobody = np.zeros((0, self.field.team_size), dtype=np.int64)
        found = fresh(self.field, self.start, nobody, rng)
        strategy = np.full(len(found), 1 / len(found))
        candidates = self._tried(found, strategy, rng)
        nothing = np.zeros((len(found) + len(candidates),) * 2)
        return PsroState(found, strategy, candidates, nothing, nothing.copy(), 0)

    def mixture(self, state: PsroState) -> Mixture:
        """Returns the solution."""
        return Mixture(state.found, state.strategy)

    def select(self, state: PsroState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns games between found teams that met least, and as many of candidates against the mixture."""
        size, tried = len(state.found), (games + int(rng.integers(2))) // 2
        if not len(state.candidates):
            tried = 0
        elif size == 1:  # nobody to meet
            tried = games
        met = least_met(state.games[:size, :size], games - tried, self.field.sides, rng)
        against = picked(state.strategy, tried * (self.field.sides - 1), rng).reshape(tried, self.field.sides - 1)
        candidates = size + least_tried(state.trials, tried, rng)
        schedule = np.concatenate([met, np.column_stack([candidates, against])])
        return self.scheduled_games(state.teams, schedule, rng)

    def learn(
        self, state: PsroState, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[PsroState, Selecting]:
        """Returns the state with the games counted, every ``expand_every`` epochs a new team, and a new mixture.

        ``Selecting.updates`` counts teams that joined, ``buffer`` the teams found; ``loss`` is how much the best of
        them wins from the mixture by the estimated payoffs.
        """
        kept = 0.5 ** (1 / self.half_life) if self.half_life else 1.0
        gains, games = counted(state.gains * kept, state.games * kept, state.teams, outcomes)
        after = replace(state, gains=gains, games=games, epochs=state.epochs + 1)
        joined = 0
        if after.epochs % self.expand_every == 0:
            after, joined = self._expanded(after, rng)
        after = replace(after, strategy=self._solved(after.payoff))
        lost = float((after.payoff @ after.strategy).max())
        return after, Selecting(joined, lost, len(after.found))

    def tensors(self, state: PsroState) -> dict[str, Any]:
        """Returns ``state`` as tensors."""
        arrays = ("found", "strategy", "candidates", "gains", "games")
        return {name: torch.from_numpy(getattr(state, name)) for name in arrays} | {
            "epochs": torch.tensor(state.epochs)
        }

    def restored(self, tensors: dict[str, Any]) -> PsroState:
        """Returns the state that gave ``tensors``."""
        held = {name: tensor.numpy() for name, tensor in tensors.items() if name != "epochs"}
        return PsroState(**held, epochs=int(tensors["epochs"]))

    def _solved(self, payoff: Floats) -> Floats:
        """Returns (K,) the mixture."""
        if self.solver == "nash":
            return nash(payoff).strategy
        if self.solver == "replicator":
            return projected_replicator(payoff, exploration=self.gamma, step=0.2, steps=500)[0]
        return np.full(len(payoff), 1 / len(payoff))

    def _expanded(self, state: PsroState, rng: Generator) -> tuple[PsroState, int]:
        """Returns ``state`` with the best candidate among the found, and new candidates; and whether one joined.

        Nobody joins where no candidate won more than it lost. Equally good ones join in random order.
        """
        size = len(state.found)
        trials = state.trials
        mean = np.divide(state.gains[size:, :size].sum(axis=1), trials, out=np.zeros_like(trials), where=trials > 0)
        kept, strategy = np.arange(size), state.strategy
        joins = len(mean) > 0 and mean.max() > 0
        if joins:
            if size == self.capacity:
                kept = np.delete(kept, strategy.argmin())
            best = np.lexsort((rng.random(len(mean)), -mean))[0]
            kept = np.append(kept, size + best)
            strategy = np.append(strategy, 0.0)[np.minimum(kept, size)]
        found = state.teams[kept]
        candidates = self._tried(found, strategy, rng)
        grown = len(kept) + len(candidates)
        gains, games = np.zeros((grown, grown)), np.zeros((grown, grown))
        gains[: len(kept), : len(kept)] = state.gains[np.ix_(kept, kept)]
        games[: len(kept), : len(kept)] = state.games[np.ix_(kept, kept)]
        return PsroState(found, strategy, candidates, gains, games, state.epochs), int(joins)

    def _tried(self, found: Ints, strategy: Floats, rng: Generator) -> Ints:
        """Returns (C, T) new candidates; fewer where there are hardly any other teams."""
        near = self.candidates // 2
        likely = found[picked(strategy, 4 * near, rng)]
        changed = new_among(self._changed(likely, rng), near, found)
        others = fresh(self.field, self.candidates - len(changed), np.concatenate([found, changed]), rng)
        return np.concatenate([changed, others])

    def _changed(self, teams: Ints, rng: Generator) -> Ints:
        """Returns ``teams``, (J, T), each with somebody drawn anew for one place."""
        rows, place = np.arange(len(teams)), rng.integers(self.field.team_size, size=len(teams))
        changed = teams.copy()
        changed[rows, place] = random_teams(self.field, len(teams), rng)[rows, place]
        return changed


def counted(gains: Floats, games: Floats, teams: Ints, outcomes: Outcomes) -> tuple[Floats, Floats]:
    """Returns ``gains`` and ``games``, (M, M), with what ``outcomes`` say of the ``teams``, (M, T).

    Any two sides of a game count as one meeting, and what one scores more than the other as its gain.
    """
    gains, games = gains.copy(), games.copy()
    which = places_of(outcomes.lineups.teams, teams)
    for a, b in combinations(range(which.shape[1]), 2):
        known = (which[:, a] >= 0) & (which[:, b] >= 0) & (which[:, a] != which[:, b])
        first, second = which[known, a], which[known, b]
        gain = outcomes.scores[known, a] - outcomes.scores[known, b]
        np.add.at(gains, (first, second), gain)
        np.add.at(gains, (second, first), -gain)
        np.add.at(games, (first, second), 1.0)
        np.add.at(games, (second, first), 1.0)
    return gains, games


def least_met(met: Floats, games: int, sides: int, rng: Generator) -> Ints:
    """Returns (B, S) different teams for each game, those first that met least; the same again where they are too few.

    Args:
        met: (K, K) symmetric, how often any two have met.
        games: B.
        sides: S.
        rng: for the order of those that met equally often.
    """
    lots = np.triu(rng.random(met.shape), 1)
    met = met + lots + lots.T
    np.fill_diagonal(met, np.inf)
    chosen = np.zeros((games, sides), dtype=np.int64)
    for b in range(games):
        together = list(np.unravel_index(met.argmin(), met.shape))
        while len(together) < sides:
            together.append(met[:, together].sum(axis=1).argmin())
        chosen[b] = together
        met[np.ix_(together, together)] += 1.0
    return chosen


def least_tried(trials: Floats, games: int, rng: Generator) -> Ints:
    """Returns (B,) the candidate of each game, those first that played least."""
    trials = trials + rng.random(len(trials))
    chosen = np.zeros(games, dtype=np.int64)
    for b in range(games):
        chosen[b] = trials.argmin()
        trials[chosen[b]] += 1.0
    return chosen
