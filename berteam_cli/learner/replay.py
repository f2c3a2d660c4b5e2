"""The steps a DQN member remembers: a ring for each member of an island."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.learner.mlp import Singles
from berteam_cli.outcomes import Bools, Experience, Ints


class Replay(NamedTuple):
    """Steps of an island's members, or of one of them without the first axis, R in each ring.

    Step number t of a member, counted from its first, lies at t modulo R.

    Attributes:
        observations: (M, R, O) float32, seen before the step.
        next_observations: (M, R, O) float32, seen after it.
        actions: (M, R) int16.
        rewards: (M, R) float32.
        terminated: (M, R) bool, whether the rules ended the game with the step; when time runs out they do not.
        ends: (M, R) bool, whether the game ended with the step, by its rules or by the clock.
    """

    observations: Singles
    next_observations: Singles
    actions: npt.NDArray[np.int16]
    rewards: Singles
    terminated: Bools
    ends: Bools

    def member(self, row: int) -> Replay:
        """Returns views of one member's ring."""
        return Replay(*(column[row] for column in self))


def empty(members: int, length: int, observation_size: int) -> Replay:
    """Returns rings of ``length`` steps; all their memory is taken now, so that a run that begins can also end."""
    shape = (members, length)
    return Replay(
        observations=np.full((*shape, observation_size), 0.0, dtype=np.float32),
        next_observations=np.full((*shape, observation_size), 0.0, dtype=np.float32),
        actions=np.full(shape, 0, dtype=np.int16),
        rewards=np.full(shape, 0.0, dtype=np.float32),
        terminated=np.full(shape, False, dtype=np.bool_),
        ends=np.full(shape, False, dtype=np.bool_),
    )


def remember(ring: Replay, collected: int, experience: Experience, game: int, player: int) -> int:
    """Writes one trajectory over a member's oldest steps.

    Args:
        ring: of one member. Changed.
        collected: how many steps the member made before.
        experience: all games.
        game: the game.
        player: its player.

    Returns:
        How many steps the member has made now.
    """
    at, new = latest(len(ring.actions), collected, experience, game, player)
    columns: tuple[Any, ...] = ring
    for kept, column in zip(columns, new, strict=True):
        kept[at] = column
    return collected + int(experience.lengths[game])


def latest(room: int, collected: int, experience: Experience, game: int, player: int) -> tuple[Ints, Replay]:
    """Returns where the steps of one trajectory go in a ring of ``room`` steps, (n,), and the steps."""
    length = int(experience.lengths[game])
    steps = np.arange(max(0, length - room), length)  # of more than fit, the last ones stay
    ends = steps == length - 1
    return (collected + steps) % room, Replay(
        experience.observations[game, player, steps],
        experience.observations[game, player, steps + 1],
        experience.actions[game, player, steps],
        experience.rewards[game, player, steps],
        ends & experience.terminated[game],
        ends,
    )
