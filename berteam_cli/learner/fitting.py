"""Whether the arrays of an island are what compiled updates may take: those look at no bounds."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy.typing as npt


def check_columns(
    columns: Mapping[str, npt.NDArray[Any]],
    one: Mapping[str, npt.NDArray[Any]],
    actions: int,
    free: Collection[str] = (),
) -> None:
    """Checks arrays that a file gave.

    Args:
        columns: (M, ...) of an island, by name.
        one: (1, ...) the same of an island of one member.
        actions: A; those in ``columns["actions"]`` must be of them.
        free: names of arrays whose second axis may have any length.

    Raises:
        ValueError: they do not fit.
    """
    members = {len(columns[name]) for name in one}
    for name, column in one.items():
        given, axes = columns[name], slice(2 if name in free else 1, None)
        same = given.ndim == column.ndim and given.shape[axes] == column.shape[axes]
        if len(members) > 1 or not same or given.dtype != column.dtype:
            raise ValueError(f"its {name} are of another kind of member: {given.dtype} of shape {given.shape}")
    if columns["actions"].size and not 0 <= columns["actions"].min() <= columns["actions"].max() < actions:
        raise ValueError("its members did what is no action of the game")
