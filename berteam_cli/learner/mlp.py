"""Small multilayer perceptrons, forwards and backwards, compiled.

The weights of one member lie in one row: for each layer its matrix (in, out) row by row, then its bias, as in
``acting.Policies``. A member's whole update is one compiled call that leaves the interpreter, so members learn
side by side on threads, and what one learns never depends on who learns beside it. (Batched torch products were
tried: their many short calls wait for the interpreter's lock, and a second worker gained nothing.)
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from numba import njit
from numpy.random import Generator

Singles = npt.NDArray[np.float32]

# Sums may be reordered to fill vector registers, in one way for each machine; NaN and infinity stay what they are.
FAST = {"reassoc", "contract", "nsz"}
compiled = njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")


@compiled
def weight_count(sizes: npt.NDArray[np.int64]) -> int:
    """Returns W, how many weights a network with layers of these widths has."""
    return ((sizes[:-1] + 1) * sizes[1:]).sum()


def layers(weights: Singles, sizes: tuple[int, ...]) -> list[tuple[Singles, Singles]]:
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
def add_product(a: Singles, b: Singles, c: Singles) -> None:
    """Adds the matrix product ``a`` times ``b`` to ``c``, which is changed.

    Args:
        a: (m, k), in any layout.
        b: (k, n), row by row.
        c: (m, n), row by row.
    """
    inner = b.shape[0]
    for i in range(c.shape[0]):
        row = c[i]
        k = 0
        while k + 8 <= inner:  # eight rows of b for each pass over the row of c, which saves loads and stores of it
            a0, a1, a2, a3 = a[i, k], a[i, k + 1], a[i, k + 2], a[i, k + 3]
            a4, a5, a6, a7 = a[i, k + 4], a[i, k + 5], a[i, k + 6], a[i, k + 7]
            b0, b1, b2, b3 = b[k], b[k + 1], b[k + 2], b[k + 3]
            b4, b5, b6, b7 = b[k + 4], b[k + 5], b[k + 6], b[k + 7]
            for j in range(len(row)):
                low = a0 * b0[j] + a1 * b1[j] + a2 * b2[j] + a3 * b3[j]
                row[j] += low + (a4 * b4[j] + a5 * b5[j] + a6 * b6[j] + a7 * b7[j])
            k += 8
        while k < inner:
            last, left = b[k], a[i, k]
            for j in range(len(row)):
                row[j] += left * last[j]
            k += 1


@compiled
def tanh(x: Singles) -> None:
    """Replaces ``x``, shape (n,), by its hyperbolic tangent, to within 2e-7.

    A quotient of polynomials (the coefficients are Eigen's), since a call for each number fills no vector register.
    """
    for j in range(len(x)):
        v = min(max(x[j], np.float32(-7.905311)), np.float32(7.905311))  # beyond it the quotient is 1
        w = v * v
        p = np.float32(-2.76076847742355e-16) * w + np.float32(2.00018790482477e-13)
        p = p * w + np.float32(-8.60467152213735e-11)
        p = p * w + np.float32(5.12229709037114e-08)
        p = p * w + np.float32(1.48572235717979e-05)
        p = p * w + np.float32(6.37261928875436e-04)
        p = p * w + np.float32(4.89352455891786e-03)
        q = np.float32(1.19825839466702e-06) * w + np.float32(1.18534705686654e-04)
        q = q * w + np.float32(2.26843463243900e-03)
        q = q * w + np.float32(4.89352518554385e-03)
        x[j] = v * p / q


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
        for i in range(n):
            for j in range(out):
                above[i, j] = weights[bias + j]
        add_product(below, weights[at:bias].reshape((wide, out)), above)
        if layer + 1 < len(sizes):
            flat = values[start : start + n * out]
            if smooth:
                tanh(flat)
            else:
                for j in range(len(flat)):
                    flat[j] = max(flat[j], np.float32(0.0))
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
    gradient[:] = 0.0
    for layer in range(len(sizes) - 1, 0, -1):
        wide, out = sizes[layer - 1], sizes[layer]
        start -= n * out
        bias = at - out
        at = bias - wide * out
        for i in range(n):
            for j in range(out):
                gradient[bias + j] += slope[i, j]
        matrix = gradient[at:bias].reshape((wide, out))
        if layer == 1:
            add_product(x.T, slope, matrix)
            return
        flat = values[start - n * wide : start]
        add_product(flat.reshape((n, wide)).T, slope, matrix)
        lower = np.zeros((n, wide), dtype=np.float32)
        add_product(slope, np.ascontiguousarray(weights[at:bias].reshape((wide, out)).T), lower)
        flat_slope = lower.reshape(n * wide)
        if smooth:
            for j in range(n * wide):
                flat_slope[j] *= np.float32(1.0) - flat[j] * flat[j]
        else:
            for j in range(n * wide):
                flat_slope[j] = flat_slope[j] if flat[j] > 0.0 else np.float32(0.0)
        slope = lower


@compiled
def n_values(sizes: npt.NDArray[np.int64], n: int) -> int:
    """Returns how many numbers ``forward`` needs for the values of ``n`` observations."""
    return n * (sizes.sum() - sizes[0])
