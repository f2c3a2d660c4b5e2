"""What PPO keeps of the games until enough steps are together, and the advantages it makes of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.learner.mlp import Singles, compiled
from berteam_cli.outcomes import Bools, Experience, Ints


class Steps(NamedTuple):
    """Steps of one member, n of them, or of the members of an island (M, n), one game after the other.

    Attributes:
        observations: (n, O) float32, what was seen before the step.
        actions: (n,) int16.
        rewards: (n,) float32; where time ran out, with the discounted value of the last observation.
        values: (n,) float32, value of the observation when the step was made.
        log_probs: (n,) float32, ln of the action's probability then.
        next_values: (n,) float32, value of the observation after the step, 0 after a game's last step.
        ends: (n,) bool, whether the game ended with the step, by its rules or by the clock.
    """

    observations: Singles
    actions: npt.NDArray[np.int16]
    rewards: Singles
    values: Singles
    log_probs: Singles
    next_values: Singles
    ends: Bools


class Seen(NamedTuple):
    """What one player saw in some games, with the observation after each game's last step.

    Attributes:
        observations: (n + G, O) float32 of G games, one after the other.
        actions: (n + G,) int16; without meaning after a game's last step.
        rewards: (n + G,) float32, likewise.
        after: (G,) where the observations after the last steps are.
        timeout: (G,) whether time ran out.
    """

    observations: Singles
    actions: npt.NDArray[np.int16]
    rewards: Singles
    after: Ints
    timeout: Bools


def empty(members: int, length: int, observation_size: int) -> Steps:
    """Returns room for ``length`` steps of each member; all its memory is taken now."""
    shape = (members, length)
    return Steps(
        observations=np.full((*shape, observation_size), 0.0, dtype=np.float32),
        actions=np.full(shape, 0, dtype=np.int16),
        rewards=np.full(shape, 0.0, dtype=np.float32),
        values=np.full(shape, 0.0, dtype=np.float32),
        log_probs=np.full(shape, 0.0, dtype=np.float32),
        next_values=np.full(shape, 0.0, dtype=np.float32),
        ends=np.full(shape, False, dtype=np.bool_),
    )


def seen(experience: Experience, trajectories: list[tuple[int, int]]) -> Seen:
    """Returns what a member saw in its ``trajectories``, (game, player) in order."""
    games = np.array([game for game, _ in trajectories])
    lengths = experience.lengths[games]
    spans = [(game, player, length) for (game, player), length in zip(trajectories, lengths, strict=True)]
    closing = np.zeros(1)  # stands for the action and the reward nobody had after the last step
    actions = [part for g, p, n in spans for part in (experience.actions[g, p, :n], closing)]
    rewards = [part for g, p, n in spans for part in (experience.rewards[g, p, :n], closing)]
    return Seen(
        observations=np.concatenate([experience.observations[g, p, : n + 1] for g, p, n in spans]),
        actions=np.concatenate(actions, dtype=np.int16, casting="unsafe"),
        rewards=np.concatenate(rewards, dtype=np.float32),
        after=np.cumsum(lengths + 1) - 1,
        timeout=~experience.terminated[games],
    )


def stitched(what: Seen, values: Singles, log_probs: Singles, gamma: float) -> Steps:
    """Returns a member's steps of several games, one after the other.

    Args:
        what: it saw.
        values: (n + G,) of the observations.
        log_probs: (n + G,) of the actions.
        gamma: discount of one step.
    """
    acted = np.ones(len(values), dtype=np.bool_)
    acted[what.after] = False
    rewards, next_values, ends = what.rewards.copy(), np.roll(values, -1), np.zeros_like(acted)
    last = what.after - 1
    ends[last] = True
    next_values[last] = 0.0
    rewards[last[what.timeout]] += np.float32(gamma) * values[what.after[what.timeout]]
    columns = (what.observations, what.actions, rewards, values, log_probs, next_values, ends)
    return Steps._make(column[acted] for column in columns)


def append(rollouts: Steps, filled: Ints, row: int, new: Steps, start: int) -> int:
    """Adds steps to one member's rollout until it is full.

    Args:
        rollouts: (M, n_steps) of the island. Changed.
        filled: (M,) steps each rollout holds. Changed.
        row: the member.
        new: its steps.
        start: the first of them to add.

    Returns:
        How many were added.
    """
    at = filled[row]
    count = min(rollouts.actions.shape[1] - at, len(new.actions) - start)
    columns: tuple[Any, ...] = rollouts
    added: tuple[Any, ...] = new
    for kept, column in zip(columns, added, strict=True):
        kept[row, at : at + count] = column[start : start + count]
    filled[row] += count
    return int(count)


@compiled
def advantages(
    rewards: Singles, values: Singles, next_values: Singles, ends: Bools, gamma: float, gae_lambda: float
) -> Singles:
    """Returns (n,) generalised advantages.

    A(t) = d(t) + gamma gae_lambda A(t+1) within a game, where d(t) = r(t) + gamma V(s(t+1)) - V(s(t)). The sum
    begins anew after each game and is cut after the last step given.

    Args:
        rewards: (n,).
        values: (n,).
        next_values: (n,), 0 where a game ended.
        ends: (n,).
        gamma: discount of one step, in [0, 1].
        gae_lambda: in [0, 1]; 0 looks one step ahead, 1 to the end of the game.
    """
    result = np.empty_like(rewards)
    later = 0.0
    for t in range(len(rewards) - 1, -1, -1):
        if ends[t]:
            later = 0.0
        later = rewards[t] + gamma * next_values[t] - values[t] + gamma * gae_lambda * later
        result[t] = later
    return result
