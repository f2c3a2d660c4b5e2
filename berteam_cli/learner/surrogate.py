"""The clipped surrogate loss of PPO and the update that follows it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.arithmetic import exp
from berteam_cli.learner.adam import Adam, Trained, descend
from berteam_cli.learner.mlp import Singles, backward, compiled, forward, n_values, weight_count
from berteam_cli.outcomes import Floats

FIGURES = ("loss", "policy_loss", "value_loss", "entropy", "approx_kl", "clip_fraction")
LOSSES = 3  # the first figures, which must be finite
KL = FIGURES.index("approx_kl")


class Surrogate(NamedTuple):
    """Settings of the loss.

    With r an action's probability over the one it had when it was chosen, A its advantage, H the entropy, V the
    value and R the return, the loss of a minibatch is
    -mean(min(r A, clip(r, 1 - c, 1 + c) A)) - entropy_coef mean(H) + value_coef mean((V - R)²). With a clip_range_vf,
    V is what it was when the step was made plus its change since then, clipped to ± clip_range_vf.

    Attributes:
        clip_range: c > 0.
        clip_range_vf: how far a value may move, infinity for no limit.
        target_kl: the update ends before the gradient step in which the policy's divergence from the one that acted is
            above 1.5 times this; infinity for never.
        entropy_coef: weight of the entropy.
        value_coef: weight of the squared error.
        normalize_advantage: whether A gets mean 0 and standard deviation 1 in each minibatch.
    """

    clip_range: float
    clip_range_vf: float
    target_kl: float
    entropy_coef: float
    value_coef: float
    normalize_advantage: bool


class Sample(NamedTuple):
    """Steps of one member to learn from.

    Attributes:
        observations: (n, O) float32.
        actions: (n,) int16, what was done.
        log_probs: (n,) float32, ln of the probability it had then.
        advantages: (n,) float32.
        values: (n,) float32, of the observations then.
        returns: (n,) float32, advantages plus those values.
    """

    observations: Singles
    actions: npt.NDArray[np.int16]
    log_probs: Singles
    advantages: Singles
    values: Singles
    returns: Singles


@compiled
def policy_slope(loss: Surrogate, logits: Singles, sample: Sample, slope: Singles, figures: Floats) -> None:
    """Writes the derivative of the loss with respect to the policy's outputs.

    Args:
        loss: settings.
        logits: (n, A). Changed to ln of the actions' probabilities.
        sample: what they belong to; its advantages are used as they are.
        slope: (n, A). Changed.
        figures: (len(FIGURES),). Changed: those of the policy are added, summed over the steps.
    """
    n, actions = logits.shape
    zero, one, count, entropy_coef = np.float32(0.0), np.float32(1.0), np.float32(n), np.float32(loss.entropy_coef)
    low, high = np.float32(1.0 - loss.clip_range), np.float32(1.0 + loss.clip_range)
    normalise(logits, slope)
    for i in range(n):
        logs, chances = logits[i], slope[i]
        entropy = zero
        for j in range(actions):
            entropy -= chances[j] * logs[j]
        taken, advantage = sample.actions[i], sample.advantages[i]
        log_ratio = logs[taken] - sample.log_probs[i]
        ratio = np.exp(log_ratio)
        bounded = min(ratio, high) if advantage > 0.0 else max(ratio, low)
        gain = advantage * bounded  # the smaller of the two terms

        # where the bound holds, the loss is constant; d ln p(a) / d logits = [a] - p
        toward = -gain / count if bounded == ratio else zero
        for j in range(actions):
            slope[i, j] = chances[j] * ((logs[j] + entropy) * entropy_coef / count - toward)
        slope[i, taken] += toward

        figures[0] -= gain + entropy_coef * entropy
        figures[1] -= gain
        figures[3] += entropy
        figures[KL] += ratio - one - log_ratio
        figures[5] += abs(ratio - one) > loss.clip_range


@compiled
def value_slope(loss: Surrogate, values: Singles, sample: Sample, slope: Singles, figures: Floats) -> None:
    """Writes the derivative of the loss with respect to the values (n, 1), and adds the figures to their sums."""
    n = len(values)
    reach = np.float32(loss.clip_range_vf)
    for i in range(n):
        moved = values[i, 0] - sample.values[i]
        free = abs(moved) <= reach
        value = values[i, 0] if free else sample.values[i] + math.copysign(reach, moved)
        error = value - sample.returns[i]
        slope[i, 0] = 2.0 * loss.value_coef * error / n if free else 0.0  # where the bound holds, it is constant
        figures[0] += loss.value_coef * error * error
        figures[2] += error * error


@compiled
def normalise(logits: Singles, chances: Singles) -> None:
    """Writes the softmax of each row of ``logits``, shape (n, A), to ``chances``, and its logarithms to ``logits``."""
    n, actions = logits.shape
    for i in range(n):
        top = logits[i, 0]
        for j in range(1, actions):
            top = max(top, logits[i, j])
        for j in range(actions):
            logits[i, j] -= top
            chances[i, j] = logits[i, j]
    exp(chances.reshape(n * actions), 0, n * actions)
    for i in range(n):
        total = np.float32(0.0)
        for j in range(actions):
            total += chances[i, j]
        shift = np.log(total)
        for j in range(actions):
            chances[i, j] /= total
            logits[i, j] -= shift


@compiled
def log_chances(logits: Singles, actions: npt.NDArray[np.int16]) -> Singles:
    """Returns (n,) ln of the probabilities of ``actions``, shape (n,); ``logits``, shape (n, A), are changed."""
    normalise(logits, np.empty_like(logits))
    result = np.empty(len(logits), np.float32)
    for i in range(len(logits)):
        result[i] = logits[i, actions[i]]
    return result


@compiled
def standardise(advantages: Singles) -> None:
    """Gives ``advantages``, shape (n,), mean 0 and standard deviation 1; one alone stays as it is."""
    n = len(advantages)
    if n < 2:
        return
    mean = 0.0
    for i in range(n):
        mean += advantages[i] / n
    variance = 0.0
    for i in range(n):
        variance += (advantages[i] - mean) ** 2 / (n - 1)
    for i in range(n):
        advantages[i] = (advantages[i] - mean) / (math.sqrt(variance) + 1e-8)


@compiled
def one_update(
    loss: Surrogate,
    adam: Adam,
    member: Trained,
    policy_sizes: npt.NDArray[np.int64],
    value_sizes: npt.NDArray[np.int64],
    smooth: bool,
    rollout: Sample,
    orders: npt.NDArray[np.int64],
    minibatch_size: int,
) -> Floats:
    """Lets one member learn from a full rollout; returns (len(FIGURES),) means over the minibatches.

    The mean of the divergence is over those of the last pass only, as in Stable-Baselines3.

    Args:
        loss: settings of the loss.
        adam: settings of the optimizer.
        member: as ``Trained.member`` returns it, the policy network's weights before the value network's. Changed.
        policy_sizes: widths of the policy network's layers.
        value_sizes: widths of the value network's layers.
        smooth: whether hidden layers use tanh, else ReLU.
        rollout: n steps.
        orders: for each pass a permutation of them. Its last minibatch may be smaller.
        minibatch_size: steps of one gradient step.
    """
    passes, n = orders.shape
    policy_count = weight_count(policy_sizes)
    policy, value = member.weights[:policy_count], member.weights[policy_count:]
    gradient = np.empty_like(member.weights)
    values = np.empty(n_values(policy_sizes, minibatch_size) + n_values(value_sizes, minibatch_size), np.float32)
    figures, sums = np.zeros(len(FIGURES)), np.empty(len(FIGURES))
    seen, seen_in_pass, near = 0, 0, True
    k = 0
    while k < passes and near:
        figures[KL], seen_in_pass = 0.0, 0
        start = 0
        while start < n and near:
            sample = drawn(rollout, orders[k, start : start + minibatch_size])
            x, count = sample.observations, len(sample.actions)
            cut = n_values(policy_sizes, count)
            of_policy, of_value = values[:cut], values[cut:]
            sums[:] = 0.0
            if loss.normalize_advantage:
                standardise(sample.advantages)
            logits = forward(policy, policy_sizes, smooth, x, of_policy)
            policy_slopes = np.empty_like(logits)
            policy_slope(loss, logits, sample, policy_slopes, sums)
            outputs = forward(value, value_sizes, smooth, x, of_value)
            value_slopes = np.empty_like(outputs)
            value_slope(loss, outputs, sample, value_slopes, sums)
            figures += sums / count
            seen += 1
            seen_in_pass += 1
            near = not sums[KL] / count > 1.5 * loss.target_kl
            if near:
                backward(policy, policy_sizes, smooth, x, of_policy, policy_slopes, gradient[:policy_count])
                backward(value, value_sizes, smooth, x, of_value, value_slopes, gradient[policy_count:])
                descend(adam, member, gradient)
            start += minibatch_size
        k += 1
    divergence = figures[KL] / seen_in_pass
    figures /= seen
    figures[KL] = divergence
    return figures


@compiled
def drawn(rollout: Sample, at: npt.NDArray[np.int64]) -> Sample:
    """Returns copies of the steps ``at`` of a rollout."""
    return Sample(
        rollout.observations[at],
        rollout.actions[at],
        rollout.log_probs[at],
        rollout.advantages[at],
        rollout.values[at],
        rollout.returns[at],
    )
