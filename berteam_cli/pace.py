"""How long a run will take."""

from __future__ import annotations

import logging
import math
import time

from berteam_cli.terminal import PACE

log = logging.getLogger(PACE)

WARM_UP = 2  # epochs that may compile something, and tell nothing of the others
FIRST_WORD = 4  # epochs until the first estimate


class Pace:
    """Tells how long the run will take, first after a few epochs and then now and then.

    Attributes:
        each: seconds that an epoch takes, NaN before that is known.
        at: when the last epoch ended, on the monotonic clock.
    """

    def __init__(self, done: int, epochs: int) -> None:
        """Starts with ``done`` of ``epochs`` epochs behind."""
        self.done, self.epochs = done, epochs
        self.begun = self.told = self.at = time.monotonic()
        self.each = math.nan

    def tell(self, done: int, games: int) -> None:
        """Logs the time left after ``done`` epochs of ``games`` games each, at most every ten seconds."""
        self.at, behind = time.monotonic(), done - self.done
        if behind == WARM_UP:
            self.begun = self.at
        if behind > WARM_UP:
            self.each = (self.at - self.begun) / (behind - WARM_UP)
        if behind < FIRST_WORD or (behind > FIRST_WORD and done < self.epochs and self.at - self.told < 10):
            return
        left = self.each * (self.epochs - done)
        if behind == FIRST_WORD and done < self.epochs:
            log.info("%d epochs of %d games: about %s (%.2f s an epoch).", self.epochs, games, spoken(left), self.each)
        else:
            log.info("epoch %d of %d, %.2f s each, %s left", done, self.epochs, self.each, spoken(left))
        self.told = self.at


def spoken(seconds: float) -> str:
    """Returns a time as it is read: 40 s, 12 min, 3.4 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
