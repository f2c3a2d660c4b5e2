"""The gradient steps of DQN: one-step temporal differences against a target network."""

from __future__ import annotations

import numpy as np

from berteam_cli.learner.adam import Adam, Trained, descend
from berteam_cli.learner.mlp import Singles, backward, compiled, forward, n_values
from berteam_cli.learner.replay import Replay
from berteam_cli.outcomes import Bools, Floats, Ints


def schedule(
    before: int, after: int, train_freq: int, gradient_steps: int, learning_starts: int, target_update_interval: int
) -> tuple[int, Bools]:
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
        The number k of gradient steps; and (k + 1,) whether the target is renewed before each of them, and at
        the end.
    """
    begin = max(before, learning_starts) // train_freq + 1
    learnings = np.repeat(np.arange(begin, after // train_freq + 1) * train_freq, gradient_steps)
    times = np.concatenate([[before], learnings, [after]])
    return len(learnings), np.diff(times // target_update_interval) > 0


@compiled
def learn_steps(
    adam: Adam,
    member: Trained,
    target: Singles,
    sizes: Ints,
    ring: Replay,
    batches: Ints,
    renewals: Bools,
    gamma: float,
) -> Floats:
    """Takes gradient steps on the smooth absolute error of Q; returns the means of loss and of Q.

    Args:
        adam: settings of the optimizer.
        member: as ``Trained.member`` returns it. Changed.
        target: (W,) weights of the target network. Changed where renewed.
        sizes: widths of the network's layers.
        ring: the member's.
        batches: (k, n) places in the ring, for each gradient step.
        renewals: (k + 1,) whether the target is renewed before each gradient step, and at the end.
        gamma: discount of one step.
    """
    steps, n = batches.shape
    gradient = np.empty_like(member.weights)
    values = np.empty(n_values(sizes, n), np.float32)
    slope = np.empty((n, sizes[-1]), np.float32)
    goals = np.empty(n, np.float32)
    figures = np.zeros(2)
    for k in range(steps):
        if renewals[k]:
            target[:] = member.weights
        at = batches[k]
        future = forward(target, sizes, False, ring.next_observations[at], values)
        for i in range(n):
            goals[i] = ring.rewards[at[i]]
            if not ring.terminated[at[i]]:
                goals[i] += np.float32(gamma) * future[i].max()
        observations = ring.observations[at]
        q = forward(member.weights, sizes, False, observations, values)
        slope[:] = 0.0
        for i in range(n):
            action = ring.actions[at[i]]
            error = q[i, action] - goals[i]
            far = abs(error)
            slope[i, action] = min(max(error, np.float32(-1.0)), np.float32(1.0)) / n
            figures[0] += (0.5 * error * error if far < 1.0 else far - 0.5) / n
            figures[1] += q[i, action] / n
        backward(member.weights, sizes, False, observations, values, slope, gradient)
        descend(adam, member, gradient)
    if renewals[steps]:
        target[:] = member.weights
    return figures / max(steps, 1)
