"""The rules."""

from __future__ import annotations

import numpy as np
from numba import njit

HANDS = ("rock", "paper", "scissors")
"""A hand beats the one before it; rock beats scissors."""


@njit(cache=True, nogil=True)
def duels_won(ours: np.ndarray, theirs: np.ndarray) -> int:
    """Returns how many of all duels between two teams the first one wins.

    Args:
        ours: (T,) index into HANDS of each member's hand.
        theirs: (T,) the same of the other team.
    """
    won = 0
    for a in ours:
        for b in theirs:
            if (a - b) % 3 == 1:
                won += 1
    return won
