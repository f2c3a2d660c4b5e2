"""What the optimizers ask of a learner."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Protocol, TypeVar

from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.outcomes import Experience
from berteam_cli.workers import Workers

S = TypeVar("S")


@dataclass(frozen=True)
class Learning:
    """What one member learnt in one epoch; NaN where the algorithm has no such figure.

    Attributes:
        row: the member within its island.
        updates: gradient steps of this epoch.
        loss: mean of the total loss over them.
        policy_loss, value_loss, entropy, approx_kl, clip_fraction: PPO's figures.
        q_value: mean of Q of the actions taken; DQN's figure.
        epsilon: chance of a random action after the epoch; DQN's figure.
        steps: transitions that arrived in this epoch.
        failures: updates of this epoch that were undone, since they gave weights or a loss that are not finite.
    """

    row: int
    updates: int = 0
    loss: float = float("nan")
    policy_loss: float = float("nan")
    value_loss: float = float("nan")
    entropy: float = float("nan")
    approx_kl: float = float("nan")
    clip_fraction: float = float("nan")
    q_value: float = float("nan")
    epsilon: float = float("nan")
    steps: int = 0
    failures: int = 0


LEARNING_FIGURES = tuple(field.name for field in fields(Learning))[1:]


class Learner(Protocol[S]):
    """How the members of one island learn; keeps settings only.

    The state ``S`` holds stacked arrays whose first axis is the member within the island: weights, the
    optimizer's moments, buffers, counters. ``learn`` and ``copy`` change it in place, since a copy of the
    replay buffers for every epoch would cost more than the learning.
    """

    @property
    def algorithm(self) -> str:
        """What learns, as the config calls it."""

    @property
    def buffer(self) -> str:
        """The setting that says how many steps a member keeps; empty where it keeps none."""

    def init(self, members: int, rng: Generator) -> S:
        """Returns the state of ``members`` members that have not learnt yet."""

    def policies(self, state: S, *, explore: bool) -> Policies:
        """Returns how the members act; without ``explore`` as they are evaluated."""

    def state_bytes(self, members: int) -> int:
        """Returns how much memory the state of so many members takes."""

    def names(self, state: S, island: str) -> list[str]:
        """Returns what to call the members of ``island``; a copy of a fixed policy has that policy's name."""

    def learn(self, state: S, experience: Experience, first: int, rng: Generator, workers: Workers) -> list[Learning]:
        """Lets members ``first`` and following learn from their trajectories in ``experience``.

        Changes ``state``. The result does not depend on ``workers``.
        """

    def copy(self, state: S, child: int, parent: int) -> None:
        """Makes member ``child`` of the island a copy of ``parent``: weights, moments, counters.

        Changes ``state``. Experience of an on-policy member is dropped, a replay buffer is copied with it.
        """

    def tensors(self, state: S) -> dict[str, Any]:
        """Returns all that ``state`` holds as named torch tensors (no copies), for a checkpoint."""

    def restored(self, tensors: dict[str, Any]) -> S:
        """Returns the state that ``tensors`` gave these, which may share their memory."""
