"""The members of the highest fitness play together: the baseline that knows nothing of how members fit together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.random import Generator
from scipy.optimize import linear_sum_assignment

from berteam_cli.outcomes import Bools, Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector.base import Selecting
from berteam_cli.selector.listed import Listed, Mixture


@dataclass(frozen=True, eq=False)
class BestMembers(Listed):
    """Chooses the team of different members with the largest sum of fitness; its state is (N,) the fitness.

    As long as all are equally fit, as before the first epoch, every place is given to all alike.
    """

    def init(self, rng: Generator) -> Floats:
        """Returns equal fitness."""
        return np.zeros(self.field.members)

    def mixture(self, state: Floats) -> Mixture | None:
        """Returns the best team alone."""
        if (state == state[0]).all():
            return None
        return Mixture(fittest(state, self.field.allowed)[np.newaxis], np.ones(1))

    def select(self, state: Floats, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns games of the best team against itself, and of random ones."""
        return self.drawn_games(state, games, rng)

    def learn(
        self, state: Floats, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[Floats, Selecting]:
        """Returns the fitness."""
        return fitness.copy(), Selecting()

    def tensors(self, state: Floats) -> dict[str, Any]:
        """Returns ``state`` as tensors."""
        return {"fitness": torch.from_numpy(state)}

    def restored(self, tensors: dict[str, Any]) -> Floats:
        """Returns the state that gave ``tensors``."""
        return tensors["fitness"].numpy()


def fittest(fitness: Floats, allowed: Bools) -> Ints:
    """Returns (T,) the team of different members with the largest sum of fitness, of equally fit ones the first.

    Where the places cannot be filled with different members, as few as possible stand at more than one.

    Args:
        fitness: (N,).
        allowed: (T, N) who may stand at each place.
    """
    # The sets that can stand are the bases of a matroid, so their order by fitness is all that matters: the set of the
    # smallest sum of ranks has the largest sum of fitness, and no two sets are equally good.
    size, members = allowed.shape
    if (allowed == allowed[0]).all() and allowed[0].sum() >= size:
        order = np.argsort(-fitness, kind="stable")
        return np.sort(order[allowed[0][order]][:size])
    ranks = np.empty(members)
    ranks[np.argsort(-fitness, kind="stable")] = np.arange(members)
    for copies in range(-(-size // members), size + 1):
        # A second copy of a member costs more than any team without one.
        costs = ranks + members * size * np.arange(copies)[:, np.newaxis]  # (copies, N)
        table = np.where(allowed[:, np.newaxis], costs, np.inf).reshape(size, -1)
        try:
            return linear_sum_assignment(table)[1] % members
        except ValueError:  # there is no such team
            continue
    raise ValueError("a place is left without anybody")
