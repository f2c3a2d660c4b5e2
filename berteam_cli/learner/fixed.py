"""Members that are fixed policies of the game: they play and learn nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies
from berteam_cli.learner.base import Learning
from berteam_cli.outcomes import Experience, Ints
from berteam_cli.workers import Workers


@dataclass(frozen=True)
class Fixed:
    """Settings of an island of fixed policies; its state is (M,) the index of each member's policy.

    Attributes:
        indices: of the game's fixed policies, one for each member.
        policies_by_name: all fixed policies of the game, in its order.
    """

    indices: tuple[int, ...]
    policies_by_name: tuple[str, ...]

    algorithm: ClassVar[str] = "fixed"
    buffer: ClassVar[str] = ""

    def init(self, members: int, rng: Generator) -> Ints:
        """Returns the policies' indices; draws nothing."""
        if members != len(self.indices):
            raise ValueError(f"members must be {len(self.indices)}, one for each of indices, but is {members}.")
        return np.array(self.indices, dtype=np.int64)

    def policies(self, state: Ints, *, explore: bool) -> Policies:
        """Returns the fixed policies, which are the same whether they ``explore`` or not."""
        return fixed_policies(state)

    def state_bytes(self, members: int) -> int:
        """Returns the bytes of the indices."""
        return 8 * members

    def names(self, state: Ints, island: str) -> list[str]:
        """Returns the names of the policies."""
        return [self.policies_by_name[index] for index in state]

    def learn(
        self, state: Ints, experience: Experience, first: int, rng: Generator, workers: Workers
    ) -> list[Learning]:
        """Returns how many steps each member made."""
        played = experience.trajectories(first, len(state))
        return [
            Learning(row, steps=sum(int(experience.lengths[game]) for game, _ in games))
            for row, games in played.items()
        ]

    def copy(self, state: Ints, child: int, parent: int) -> None:
        """Makes ``child`` play as ``parent`` does."""
        state[child] = state[parent]

    def tensors(self, state: Ints) -> dict[str, Any]:
        """Returns the indices."""
        return {"indices": torch.from_numpy(state)}

    def restored(self, tensors: dict[str, Any]) -> Ints:
        """Returns the state that ``tensors`` gave these."""
        return tensors["indices"].numpy().copy()
