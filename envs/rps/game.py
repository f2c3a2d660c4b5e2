"""The rules."""

from __future__ import annotations

import numpy as np
from numba import njit

HANDS = ("rock", "paper", "scissors")
"""A hand beats the one before it; rock beats scissors."""


@njit(cache=True, nogil=True)
def hands_beaten(ours: np.ndarray, theirs: np.ndarray) -> int:
    """Returns how many hands of a team are beaten by any hand of the others.

    Args:
        ours: (T,) index into HANDS of each member's hand.
        theirs: (any,) the same of all members of the other teams.
    """
    beaten = 0
    for a in ours:
        for b in theirs:
            if (b - a) % 3 == 1:
                beaten += 1
                break
    return beaten
