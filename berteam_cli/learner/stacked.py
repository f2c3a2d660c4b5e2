"""Networks of many members in one batch of torch products, for devices that compiled functions cannot run on.

The rows of a tensor are members; no sum ever goes over two of them, so each member's loss, gradient, gradient norm and
Adam are its own. ``mlp`` and ``adam`` say the same one member at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np
import torch
from torch import Tensor

from berteam_cli.learner.adam import MEAN_DECAY, SQUARE_DECAY, Adam
from berteam_cli.learner.mlp import layers

S = TypeVar("S", bound=Any)  # a NamedTuple with a field ``trained``

OnDevice: TypeAlias = Any
"""A NamedTuple of a compiled learner, such as Trained or Steps, whose columns are tensors here and not arrays."""


def outputs(weights: Tensor, sizes: tuple[int, ...], smooth: bool, x: Tensor) -> Tensor:
    """Returns the outputs (K, n, out) of K networks.

    Args:
        weights: (K, W).
        sizes: width of each layer from observation to output.
        smooth: whether hidden layers use tanh, else ReLU.
        x: (K, n, in), what each of them sees.
    """
    parts = layers(weights, sizes)
    for depth, (matrix, bias) in enumerate(parts, start=1):
        x = torch.baddbmm(bias[:, None], x, matrix)
        if depth < len(parts):
            x = x.tanh() if smooth else x.relu()
    return x


def descend(adam: Adam, trained: OnDevice, gradient: Tensor, active: Tensor) -> None:
    """Moves K members a step against their gradients; see ``adam.descend``.

    Args:
        adam: settings of the optimizer.
        trained: tensors of K rows. Changed.
        gradient: (K, W).
        active: (K,) bool, who moves; the others stay as they are.
    """
    weights, mean, square, updates = trained
    gradient = gradient * (adam.max_grad_norm / (gradient.norm(dim=1, keepdim=True) + 1e-6)).clamp(max=1.0)
    updates += active
    times = updates.clamp(min=1).double()[:, None]
    rate = (adam.learning_rate / (1.0 - MEAN_DECAY**times)).float()
    root = (1.0 - SQUARE_DECAY**times).sqrt().float()
    moves = active[:, None]
    new_mean = torch.where(moves, mean + (gradient - mean) * (1.0 - MEAN_DECAY), mean)
    new_square = torch.where(moves, square * SQUARE_DECAY + gradient * gradient * (1.0 - SQUARE_DECAY), square)
    mean.copy_(new_mean)
    square.copy_(new_square)
    weights -= torch.where(moves, rate * mean / (square.sqrt() / root + adam.epsilon), 0.0)


def acting(state: S) -> S:
    """Returns ``state``, of a stacked learner, with its weights on the processor, where games are played."""
    return state._replace(trained=state.trained._replace(weights=state.trained.weights.cpu().numpy()))


def taken(columns: Sequence[Tensor], rows: Tensor) -> list[Tensor]:
    """Returns copies of the ``rows`` of each column."""
    return [column[rows] for column in columns]


def put_where_finite(columns: Sequence[Tensor], rows: Tensor, new: Sequence[Tensor], figures: Tensor) -> list[bool]:
    """Writes rows back to their columns unless something of a member is not finite; returns for each whether it was.

    Args:
        columns: of M members. Changed.
        rows: (K,) members.
        new: for each column its K rows.
        figures: (K, ...) such as the loss.
    """
    sound = torch.stack([x.reshape(len(rows), -1).isfinite().all(dim=1) for x in (*new, figures)]).all(dim=0)
    for column, values in zip(columns, new, strict=True):
        column[rows[sound]] = values[sound]
    return [bool(x) for x in sound.tolist()]


def on(device: str, array: np.ndarray) -> Tensor:
    """Returns ``array`` as a tensor on ``device``."""
    return torch.from_numpy(np.ascontiguousarray(array)).to(device)
