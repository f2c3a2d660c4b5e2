"""A game put aside and taken up again: the whole state of one game as named arrays, which ``numpy.savez`` writes."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mctf.patrols import ROUND_POINTS
from mctf.rules import Rules
from mctf.state import State

RULES = "rules"
"""Name of the array that holds the rules; all others are fields of ``State``."""
MAY_BE_NAN = ("reach", "direction")
"""Fields that hold NaN where nothing was written yet, or nothing that the next step reads."""


def saved(state: State, b: int, rules: Rules) -> dict[str, NDArray[Any]]:
    """Returns a copy of game ``b``: each field of ``State`` without its first axis, and the rules' numbers."""
    arrays = {name: np.array(array[b]) for name, array in zip(State._fields, state, strict=True)}
    return arrays | {RULES: np.array(list(_numbers(rules).values()))}


def restore(snapshot: Mapping[str, ArrayLike], state: State, b: int, rules: Rules) -> None:
    """Makes game ``b`` what it was when ``saved`` returned ``snapshot``.

    Args:
        snapshot: of ``saved``, or as ``numpy.load`` reads it.
        state: changed, unless an error is raised.
        b: game.
        rules: the game's constants.

    Raises:
        ValueError: the snapshot is none, is of a game of another shape or of other rules, or holds numbers that no
            game has.
    """
    if not isinstance(snapshot, Mapping):
        raise ValueError(f"the snapshot must be named arrays as of save, but is {type(snapshot).__name__}.")
    names = {RULES, *State._fields}
    if set(snapshot) != names:
        lacks, besides = sorted(names - set(snapshot)), sorted(set(snapshot) - names, key=str)
        raise ValueError(f"the snapshot must be named arrays as of save, but lacks {lacks} and has {besides} besides.")
    _check_rules(np.asarray(snapshot[RULES]), rules)
    arrays = {name: np.asarray(snapshot[name]) for name in State._fields}
    for name, array in arrays.items():
        row = getattr(state, name)[b]
        if array.shape != row.shape or array.dtype != row.dtype:
            raise ValueError(
                f"the snapshot's {name} must have shape {row.shape} of {row.dtype}, "
                f"but has {array.shape} of {array.dtype}."
            )
        _check_numbers(name, array, rules)
    for name, array in arrays.items():
        getattr(state, name)[b] = array


def _numbers(rules: Rules) -> dict[str, float]:
    """Returns all rules as numbers, by name."""
    numbers: dict[str, float] = {}
    for name, value in rules._asdict().items():
        values = value if isinstance(value, tuple) else (value,)
        numbers |= {name if len(values) == 1 else f"{name}[{i}]": float(each) for i, each in enumerate(values)}
    return numbers


def _check_rules(given: NDArray[Any], rules: Rules) -> None:
    here = _numbers(rules)
    if given.shape != (len(here),) or given.dtype.kind not in "fiu":
        raise ValueError(
            f"the snapshot's rules must be numbers of shape ({len(here)},), but has {given.shape} of {given.dtype}."
        )
    for (name, number), other in zip(here.items(), given.tolist(), strict=True):
        if number != other:
            raise ValueError(
                f"the snapshot must be of a game of the same rules, but {name} was {other:g}, not {number:g}."
            )


def _check_numbers(name: str, array: NDArray[Any], rules: Rules) -> None:
    """Raises a ValueError for numbers with which a kernel would run on for ever or read what is not there."""
    if name in MAY_BE_NAN or array.dtype.kind == "b":
        return
    if not np.isfinite(array).all():
        raise ValueError(f"the snapshot's {name} must be finite, but has {array[~np.isfinite(array)].flat[0]}.")
    low, high = {
        "heading": (-180.0, 180.0),
        "goal": (0, len(ROUND_POINTS) - 1),
        "tagged_opponent": (-1, rules.blue_size + rules.red_size - 1),
    }.get(name, (-np.inf, np.inf))
    if not ((array >= low) & (array <= high)).all():
        raise ValueError(f"the snapshot's {name} must be in [{low}, {high}], but has {array.min()}..{array.max()}.")
