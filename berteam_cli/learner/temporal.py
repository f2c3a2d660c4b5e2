"""The gradient steps of DQN: temporal differences of one or more steps against a target network."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from berteam_cli.learner.adam import Adam, Trained, descend
from berteam_cli.learner.mlp import Singles, backward, compiled, forward, n_values
from berteam_cli.learner.replay import Replay
from berteam_cli.outcomes import Floats, Ints


def schedule(
    before: int, after: int, train_freq: int, gradient_steps: int, learning_starts: int, target_update_interval: int
) -> tuple[int, Ints]:
    """Returns how many gradient steps a member takes, and when its target is renewed.

    Both follow from the number of steps it has made, as if it had learnt while it played: gradient steps after
    each multiple of ``train_freq`` beyond ``learning_starts``, a new target at each multiple of
    ``target_update_interval``, the target first.

    Args:
        before: steps it had made before the epoch.
        after: steps it has made now.
        train_freq: steps of the game from one learning to the next.
        gradient_steps: gradient steps of each learning.
        learning_starts: steps before the first learning.
        target_update_interval: steps between new targets.

    Returns:
        The number k of gradient steps; and (k + 1,) how often the target is renewed before each of them, and at
        the end.
    """
    begin = max(before, learning_starts) // train_freq + 1
    learnings = np.repeat(np.arange(begin, after // train_freq + 1) * train_freq, gradient_steps)
    times = np.concatenate([[before], learnings, [after]])
    return len(learnings), np.diff(times // target_update_interval)


FIGURES = ("loss", "q_value")


class Difference(NamedTuple):
    """Settings of the temporal difference.

    Attributes:
        gamma: discount of one step.
        n_steps: rewards of so many steps are added up before the target network is asked.
        tau: share of its way to the network's weights that the target goes when it is renewed; 1 all of it.
        smooth: whether hidden layers use tanh, else ReLU.
    """

    gamma: float
    n_steps: int
    tau: float
    smooth: bool


@compiled
def learn_steps(
    difference: Difference,
    adam: Adam,
    member: Trained,
    target: Singles,
    sizes: Ints,
    ring: Replay,
    newest: int,
    batches: Ints,
    renewals: Ints,
) -> Floats:
    """Takes gradient steps on the smooth absolute error of Q; returns (len(FIGURES),) means.

    Args:
        difference: settings of the error.
        adam: settings of the optimizer.
        member: as ``Trained.member`` returns it. Changed.
        target: (W,) weights of the target network. Changed where renewed.
        sizes: widths of the network's layers.
        ring: the member's.
        newest: where in the ring the member's last step is.
        batches: (k, n) places in the ring, for each gradient step.
        renewals: (k + 1,) how often the target is renewed before each gradient step, and at the end.
    """
    steps, n = batches.shape
    gradient = np.empty_like(member.weights)
    values = np.empty(n_values(sizes, n), np.float32)
    slope = np.empty((n, sizes[-1]), np.float32)
    goals, discounts, last = np.empty(n, np.float32), np.empty(n, np.float32), np.empty(n, np.int64)
    figures = np.zeros(len(FIGURES))
    for k in range(steps):
        follow(target, member.weights, difference.tau, renewals[k])
        at = batches[k]
        add_rewards(difference, ring, newest, at, goals, discounts, last)
        future = forward(target, sizes, difference.smooth, ring.next_observations[last], values)
        for i in range(n):
            if not ring.terminated[last[i]]:
                goals[i] += discounts[i] * future[i].max()
        observations = ring.observations[at]
        q = forward(member.weights, sizes, difference.smooth, observations, values)
        slope[:] = 0.0
        for i in range(n):
            action = ring.actions[at[i]]
            error = q[i, action] - goals[i]
            far = abs(error)
            slope[i, action] = min(max(error, np.float32(-1.0)), np.float32(1.0)) / n
            figures[0] += (0.5 * error * error if far < 1.0 else far - 0.5) / n
            figures[1] += q[i, action] / n
        backward(member.weights, sizes, difference.smooth, observations, values, slope, gradient)
        descend(adam, member, gradient)
    follow(target, member.weights, difference.tau, int(renewals[steps]))
    return figures / max(steps, 1)


@compiled
def follow(target: Singles, weights: Singles, tau: float, times: int) -> None:
    """Moves ``target``, shape (W,), a share ``tau`` of its way to ``weights``, so many times."""
    if times == 0:
        return
    stays = (1.0 - tau) ** times
    for j in range(len(target)):
        target[j] = target[j] * np.float32(stays) + weights[j] * np.float32(1.0 - stays)


@compiled
def add_rewards(
    difference: Difference, ring: Replay, newest: int, at: Ints, goals: Singles, discounts: Singles, last: Ints
) -> None:
    """Adds up discounted rewards from the steps ``at``, shape (n,), on, until the game or what is known of it ends.

    Args:
        difference: its ``n_steps`` is how many at most.
        ring: the member's.
        newest: where in the ring the member's last step is.
        at: where the first steps are.
        goals: (n,). Changed to the sums.
        discounts: (n,). Changed to the discounts of what comes after.
        last: (n,). Changed to where the last steps are.
    """
    for i in range(len(at)):
        discounts[i], last[i] = 1.0, at[i]
        goals[i] = ring.rewards[at[i]]
        for _ in range(1, difference.n_steps):
            if ring.ends[last[i]] or last[i] == newest:
                break
            discounts[i] *= np.float32(difference.gamma)
            last[i] = (last[i] + 1) % len(ring.rewards)
            goals[i] += discounts[i] * ring.rewards[last[i]]
        discounts[i] *= np.float32(difference.gamma)
