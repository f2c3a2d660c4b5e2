"""Small multilayer perceptrons, forwards and backwards, compiled.

The weights of one member lie in one row: for each layer its matrix (in, out) row by row, then its bias, as in
``acting.Policies``. A member's whole update is one compiled call that leaves the interpreter, so members learn
side by side on threads, and what one learns never depends on who learns beside it. (Batched torch products were
tried: their many short calls wait for the interpreter's lock, and a second worker gained nothing.)
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import numpy.typing as npt
from numba import njit
from numpy.random import Generator

from berteam_cli.arithmetic import multiply, tanh

if TYPE_CHECKING:
    from torch import Tensor

Singles = npt.NDArray[np.float32]
Weights = TypeVar("Weights", Singles, "Tensor")

# Sums may be reordered to fill vector registers, in one way for each machine; NaN and infinity stay what they are.
FAST = {"reassoc", "contract", "nsz"}
compiled = njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")


@compiled
def weight_count(sizes: npt.NDArray[np.int64]) -> int:
    """Returns W, how many weights a network with layers of these widths has."""
    return ((sizes[:-1] + 1) * sizes[1:]).sum()


def layers(weights: Weights, sizes: tuple[int, ...]) -> list[tuple[Weights, Weights]]:
    """Returns for each layer its matrices (K, in, out) and biases (K, out), as views.

    Args:
        weights: (K, W), one row for each member.
        sizes: width of each layer from observation to output.
    """
    parts, at = [], 0
    for wide, out in pairwise(sizes):
        bias = at + wide * out
        parts.append((weights[:, at:bias].reshape(-1, wide, out), weights[:, bias : bias + out]))
        at = bias + out
    return parts


def orthogonal(sizes: tuple[int, ...], gain: float, members: int, rng: Generator) -> Singles:
    """Returns (members, W) weights: orthogonal matrices and zero biases, as Stable-Baselines3 begins PPO.

    Args:
        sizes: width of each layer from observation to output.
        gain: factor of the last layer's matrix; that of the hidden layers is √2.
        members: how many networks.
        rng: where the weights are drawn from.
    """
    parts = []
    for layer, (wide, out) in enumerate(pairwise(sizes), start=2):
        q, r = np.linalg.qr(rng.standard_normal((members, max(wide, out), min(wide, out))))
        q *= np.sign(np.diagonal(r, axis1=1, axis2=2))[:, np.newaxis, :]  # else q would not be uniform
        matrix = q if wide >= out else q.transpose(0, 2, 1)
        factor = gain if layer == len(sizes) else math.sqrt(2.0)
        parts += [factor * matrix.reshape(members, -1), np.zeros((members, out))]
    return np.concatenate(parts, axis=1).astype(np.float32)


def uniform(sizes: tuple[int, ...], members: int, rng: Generator) -> Singles:
    """Returns (members, W) weights, all ~ U(-1/√in, 1/√in), as torch begins a linear layer."""
    parts = [rng.uniform(-1.0, 1.0, (members, (wide + 1) * out)) / math.sqrt(wide) for wide, out in pairwise(sizes)]
    return np.concatenate(parts, axis=1).astype(np.float32)


@compiled
def forward(weights: Singles, sizes: npt.NDArray[np.int64], smooth: bool, x: Singles, values: Singles) -> Singles:
    """Returns the outputs (n, out) of one network, a view of ``values``.

    Args:
        weights: (W,).
        sizes: width of each layer from observation to output.
        smooth: whether hidden layers use tanh, else ReLU.
        x: (n, in).
        values: at least n * sum(sizes[1:]) numbers. Changed: the values of each layer, one layer after the other.
    """
    n, at, start = len(x), 0, 0
    below = x
    for layer in range(1, len(sizes)):
        wide, out = sizes[layer - 1], sizes[layer]
        bias = at + wide * out
        above = values[start : start + n * out].reshape((n, out))
        multiply(below, weights[at:bias].reshape((wide, out)), weights[bias : bias + out], above)
        if layer + 1 < len(sizes):
            if smooth:
                tanh(values, start, n * out)
            else:
                for j in range(start, start + n * out):
                    values[j] = max(values[j], np.float32(0.0))
        below = above
        at = bias + out
        start += n * out
    return below


@compiled
def backward(
    weights: Singles,
    sizes: npt.NDArray[np.int64],
    smooth: bool,
    x: Singles,
    values: Singles,
    slope: Singles,
    gradient: Singles,
) -> None:
    """Writes the gradient of a loss with respect to the weights of one network.

    Args:
        weights: (W,).
        sizes: width of each layer from observation to output.
        smooth: whether hidden layers use tanh, else ReLU.
        x: (n, in), what ``forward`` was given.
        values: what it left.
        slope: (n, out) derivative of the loss with respect to the outputs.
        gradient: (W,). Changed.
    """
    n, at, start = len(x), len(weights), n_values(sizes, len(x))
    widest = sizes.max()
    ones, zeros = np.ones((1, n), np.float32), np.zeros(widest, np.float32)
    transposed, lower = np.empty(widest * widest, np.float32), np.empty((2, n * widest), np.float32)
    for layer in range(len(sizes) - 1, 0, -1):
        wide, out = sizes[layer - 1], sizes[layer]
        start -= n * out
        bias = at - out
        at = bias - wide * out
        multiply(ones, slope, zeros, gradient[bias : bias + out].reshape((1, out)))
        matrix = gradient[at:bias].reshape((wide, out))
        if layer == 1:
            multiply(x.T, slope, zeros, matrix)
            return
        flat = values[start - n * wide : start]
        multiply(flat.reshape((n, wide)).T, slope, zeros, matrix)
        turned = transposed[: wide * out].reshape((out, wide))
        transpose(weights[at:bias].reshape((wide, out)), turned)
        flat_slope = lower[layer % 2, : n * wide]
        multiply(slope, turned, zeros, flat_slope.reshape((n, wide)))
        if smooth:
            for j in range(n * wide):
                flat_slope[j] *= np.float32(1.0) - flat[j] * flat[j]
        else:
            for j in range(n * wide):
                flat_slope[j] = flat_slope[j] if flat[j] > 0.0 else np.float32(0.0)
        slope = flat_slope.reshape((n, wide))


@compiled
def transpose(matrix: Singles, turned: Singles) -> None:
    """Writes ``matrix``, shape (m, n), to ``turned``, shape (n, m)."""
    for j in range(matrix.shape[1]):
        for i in range(matrix.shape[0]):
            turned[j, i] = matrix[i, j]


@compiled
def n_values(sizes: npt.NDArray[np.int64], n: int) -> int:
    """Returns how many numbers ``forward`` needs for the values of ``n`` observations."""
    return n * (sizes.sum() - sizes[0])
