"""Adam, each member with its own gradient norm and step count."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.learner.mlp import Singles, compiled

MEAN_DECAY, SQUARE_DECAY = 0.9, 0.999  # β1 and β2, torch's


class Trained(NamedTuple):
    """Weights of an island's members and what Adam remembers of them.

    Attributes:
        weights: (M, W) float32.
        mean: (M, W) float32, decayed mean of the gradients.
        square: (M, W) float32, decayed mean of their squares.
        updates: (M,) int64, gradient steps taken.
    """

    weights: Singles
    mean: Singles
    square: Singles
    updates: npt.NDArray[np.int64]

    def member(self, row: int) -> Trained:
        """Returns views of one member's rows, each with one axis less; ``updates`` keeps its axis."""
        return Trained(self.weights[row], self.mean[row], self.square[row], self.updates[row : row + 1])


def untrained(weights: Singles) -> Trained:
    """Returns ``weights``, shape (M, W), before their first step."""
    return Trained(weights, np.zeros_like(weights), np.zeros_like(weights), np.zeros(len(weights), dtype=np.int64))


class Adam(NamedTuple):
    """The optimizer's settings.

    Attributes:
        learning_rate: step length.
        epsilon: added to the root of the mean square.
        max_grad_norm: a gradient is shortened to this Euclidean norm.
    """

    learning_rate: float
    epsilon: float
    max_grad_norm: float


@compiled
def descend(adam: Adam, member: Trained, gradient: Singles) -> None:
    """Moves one member a step against its gradient.

    Args:
        adam: settings.
        member: as ``Trained.member`` returns it. Changed.
        gradient: (W,).
    """
    total = 0.0
    for j in range(len(gradient)):
        total += gradient[j] * gradient[j]
    shorter = np.float32(min(1.0, adam.max_grad_norm / (math.sqrt(total) + 1e-6)))  # 1e-6 as in torch's clipping
    member.updates[0] += 1
    rate = np.float32(adam.learning_rate / (1.0 - MEAN_DECAY ** member.updates[0]))
    root = np.float32(math.sqrt(1.0 - SQUARE_DECAY ** member.updates[0]))
    rate, epsilon = rate * root, np.float32(adam.epsilon) * root  # m / (√v / root + ε), with one division
    keep, take = np.float32(SQUARE_DECAY), np.float32(1.0 - SQUARE_DECAY)
    weights, mean, square = member.weights, member.mean, member.square
    for j in range(len(gradient)):
        slope = gradient[j] * shorter
        mean[j] += (slope - mean[j]) * np.float32(1.0 - MEAN_DECAY)
        square[j] = square[j] * keep + slope * slope * take
        weights[j] -= rate * mean[j] / (np.sqrt(square[j]) + epsilon)
