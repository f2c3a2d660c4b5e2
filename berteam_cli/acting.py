"""How members act: one table of policies that compiled games read.

A network is evaluated one observation at a time in a fixed order of additions, so an action never depends on
which other games or members happen to be computed beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from berteam_cli.arithmetic import exp, multiply_row, tanh

FIXED, SAMPLED, GREEDY = 0, 1, 2  # kinds of policy
DEEPEST = 6  # hidden layers a network may have


class Policies(NamedTuple):
    """The policies of K members, as arrays.

    Attributes:
        kind: (K,) int8, FIXED, SAMPLED (softmax over the outputs) or GREEDY (highest output).
        fixed: (K,) int16, index of the game's fixed policy; meaningless for networks.
        sizes: (K, DEEPEST + 2) int32, width of each layer from observation to actions, 0 after the last.
        tanh: (K,) bool, whether hidden layers use tanh, else ReLU.
        epsilon: (K,) float32, chance of a uniformly random action instead of the policy's own.
        weights: (K, W) float32, for each layer its matrix (in, out) row by row, then its bias; zeros behind.
        pay: (K, P) float64, by what the weight of each term of the game's reward is multiplied for who acts so; P = 0
            where all are paid alike.
    """

    kind: npt.NDArray[np.int8]
    fixed: npt.NDArray[np.int16]
    sizes: npt.NDArray[np.int32]
    tanh: npt.NDArray[np.bool_]
    epsilon: npt.NDArray[np.float32]
    weights: npt.NDArray[np.float32]
    pay: npt.NDArray[np.float64]


def fixed_policies(indices: npt.ArrayLike) -> Policies:
    """Returns one row for each of the game's fixed policies in ``indices``."""
    fixed = np.asarray(indices, dtype=np.int16)
    return Policies(
        kind=np.full(len(fixed), FIXED, dtype=np.int8),
        fixed=fixed,
        sizes=np.zeros((len(fixed), DEEPEST + 2), dtype=np.int32),
        tanh=np.zeros(len(fixed), dtype=np.bool_),
        epsilon=np.zeros(len(fixed), dtype=np.float32),
        weights=np.zeros((len(fixed), 0), dtype=np.float32),
        pay=np.zeros((len(fixed), 0)),
    )


def networks(
    kind: int,
    layers: list[tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]],
    *,
    tanh: bool,
    epsilon: npt.ArrayLike = 0.0,
) -> Policies:
    """Returns K policies of one architecture.

    Args:
        kind: SAMPLED or GREEDY.
        layers: for each layer its matrices (K, in, out) and biases (K, out), from observation to actions.
        tanh: whether hidden layers use tanh, else ReLU.
        epsilon: (K,) or one number in [0, 1].
    """
    members = len(layers[0][0])
    widths = [layers[0][0].shape[1]] + [bias.shape[1] for _, bias in layers]
    sizes = np.zeros((members, DEEPEST + 2), dtype=np.int32)
    sizes[:, : len(widths)] = widths
    flat = [part.reshape(members, -1) for layer in layers for part in layer]
    return Policies(
        kind=np.full(members, kind, dtype=np.int8),
        fixed=np.zeros(members, dtype=np.int16),
        sizes=sizes,
        tanh=np.full(members, tanh, dtype=np.bool_),
        epsilon=np.broadcast_to(np.asarray(epsilon, dtype=np.float32), (members,)).copy(),
        weights=np.ascontiguousarray(np.concatenate(flat, axis=1), dtype=np.float32),
        pay=np.zeros((members, 0)),
    )


def joined(tables: list[Policies]) -> Policies:
    """Returns the rows of all ``tables``, one table after the other; a table without factors of pay gets ones."""
    widest, factors = max(t.weights.shape[1] for t in tables), max(t.pay.shape[1] for t in tables)
    weights = [np.pad(t.weights, ((0, 0), (0, widest - t.weights.shape[1]))) for t in tables]
    pay = [np.pad(t.pay, ((0, 0), (0, factors - t.pay.shape[1])), constant_values=1.0) for t in tables]
    columns = [np.concatenate(column) for column in zip(*(t[:-2] for t in tables), strict=True)]
    return Policies._make((*columns, np.concatenate(weights), np.concatenate(pay)))


def noisy(policies: Policies, chance: float) -> Policies:
    """Returns ``policies`` whose actions are uniformly random ones with so much ``chance``, in [0, 1]."""
    return policies._replace(epsilon=np.full(len(policies.kind), chance, dtype=np.float32))


@njit(cache=True, nogil=True, error_model="numpy")
def act(policies: Policies, k: int, observation: np.ndarray, work: np.ndarray, chance: float, choice: float) -> int:
    """Returns the action of policy ``k``, a network, on one observation.

    Args:
        policies: the table.
        k: row of a SAMPLED or GREEDY policy.
        observation: (O,) float32.
        work: (2 * widest layer,) float32 scratch, or longer; changed.
        chance: in [0, 1), decides whether the action is a random one.
        choice: in [0, 1), decides which action is drawn.
    """
    sizes, weights = policies.sizes, policies.weights
    x, y = 0, len(work) // 2  # places in work where a layer's inputs and outputs begin
    wide = int(sizes[k, 0])
    for i in range(wide):
        work[i] = observation[i]
    at, layer, depth = k * weights.shape[1], 1, sizes.shape[1]
    while layer < depth and sizes[k, layer] > 0:
        out = int(sizes[k, layer])
        bias = at + wide * out
        multiply_row(work, x, weights, at, bias, work, y, wide, out)
        if layer + 1 < depth and sizes[k, layer + 1] > 0:
            if policies.tanh[k]:
                tanh(work, y, out)
            else:
                for j in range(out):
                    work[y + j] = max(work[y + j], np.float32(0.0))
        x, y = y, x
        wide, at = out, bias + out
        layer += 1
    if chance < policies.epsilon[k]:
        return min(int(choice * wide), wide - 1)
    if policies.kind[k] == GREEDY:
        return highest(work, x, wide)
    return drawn(work, x, wide, choice)


@njit(cache=True, nogil=True)
def highest(values: np.ndarray, first: int, count: int) -> int:
    """Returns the first index of the largest of ``values[first : first + count]``, counted from ``first``."""
    best = 0
    for j in range(1, count):
        if values[first + j] > values[first + best]:
            best = j
    return best


@njit(cache=True, nogil=True)
def drawn(logits: np.ndarray, first: int, count: int, choice: float) -> int:
    """Returns an index drawn from softmax(``logits[first : first + count]``) by the number ``choice`` in [0, 1).

    Changes these ``logits``.
    """
    likeliest = highest(logits, first, count)
    top = logits[first + likeliest]
    for j in range(first, first + count):
        logits[j] -= top
    exp(logits, first, count)
    total = 0.0
    for j in range(first, first + count):
        total += logits[j]
    left = choice * total
    for j in range(count):
        left -= logits[first + j]
        if left < 0.0:
            return j
    return likeliest  # rounding left a crumb behind the last action
