"""Updates that give weights or a loss that are not finite are undone at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from berteam_cli.outcomes import Floats


def guarded(columns: Sequence[Any], row: int, losses: int, update: Callable[[], Floats]) -> Floats | None:
    """Returns the figures of an update of one member, or None if it was undone because something is not finite.

    Args:
        columns: arrays whose rows ``row`` the update changes. After an update that is undone they are as before.
        row: the member within its island.
        losses: so many of the first figures must be finite.
        update: changes the member, and returns figures, its losses first.
    """
    before = [column[row].copy() for column in columns]
    with np.errstate(all="ignore"):  # what is not finite is looked for here
        figures = update()
    if np.isfinite(figures[:losses]).all() and all(np.isfinite(column[row]).all() for column in columns):
        return figures
    for column, old in zip(columns, before, strict=True):
        column[row] = old
    return None
