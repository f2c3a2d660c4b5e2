"""What a copy of a member gets that its parent has not: layers of a second parent, and noise."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Protocol, runtime_checkable

import torch
from numpy.random import Generator
from torch import Tensor


@runtime_checkable
class Breedable(Protocol):
    """A learner whose members' networks can be taken apart into layers."""

    @property
    def spans(self) -> list[slice]:
        """Where each layer, its matrix and its bias, lies in a row of weights; of all networks of a member."""

    def genes(self, state: Any) -> list[Tensor]:
        """Returns (M, W) tensors that share the memory of ``state``: the weights first, then what goes with each."""


def spans(*networks: tuple[int, ...]) -> list[slice]:
    """Returns where each layer lies in a row of weights.

    Args:
        networks: of each, one behind the other in the row, the widths of its layers from observation to output.
    """
    found, at = [], 0
    for wide, out in (pair for sizes in networks for pair in pairwise(sizes)):
        found.append(slice(at, at + (wide + 1) * out))
        at += (wide + 1) * out
    return found


def copied(genes: Sequence[Tensor], row: int) -> list[Tensor]:
    """Returns copies of row ``row`` of each of ``genes``."""
    return [column[row].clone() for column in genes]


def cross(genes: Sequence[Tensor], layers: list[slice], child: int, other: Sequence[Tensor], rng: Generator) -> None:
    """Takes each layer of ``child`` from another parent with a chance of a half, with all that goes with it.

    Args:
        genes: of the island. Row ``child`` is changed.
        layers: where each lies in a row.
        child: the member, a copy of its first parent.
        other: the row of the second parent in each of ``genes``.
        rng: draws one number for each layer.
    """
    for layer, second in zip(layers, rng.integers(2, size=len(layers)), strict=True):
        for column, theirs in zip(genes, other, strict=True) if second else ():
            column[child, layer] = theirs[layer]


def mutate(weights: Tensor, layers: list[slice], child: int, size: float, rng: Generator) -> None:
    """Adds Gaussian noise to the weights of ``child``.

    Args:
        weights: (M, W) of the island. Row ``child`` is changed.
        layers: where each lies in a row.
        child: the member.
        size: standard deviation, as a share of the root mean square weight of each layer.
        rng: draws one number for each weight.
    """
    for layer in layers:
        row = weights[child, layer]
        deviation = size * row.double().square().mean().sqrt().item()
        row += torch.from_numpy(deviation * rng.standard_normal(len(row))).to(row)
