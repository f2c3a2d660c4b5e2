"""What a logger is. The tables are written whatever the logger; it only shows the same figures elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

FINISHED, FAILED, KILLED = "finished", "failed", "killed"  # how a run ends


class Logger(Protocol):
    """Takes figures by name, epoch by epoch."""

    def last(self) -> Mapping[str, int]:
        """Returns the last epoch for which each figure is there already, of an earlier start of the same run."""

    def write(self, epoch: int, figures: Mapping[str, float]) -> None:
        """Takes the finite ``figures`` of an epoch, none of which is there already."""

    def flush(self) -> None:
        """Has everything written on the disk."""

    def close(self, ended: str) -> None:
        """Ends; ``ended``: how the run did, FINISHED, FAILED or KILLED."""


class Once:
    """Hands each figure of an epoch to a logger once, however often a run goes on from before it."""

    def __init__(self, logger: Logger) -> None:
        """Takes the logger, which was opened for the run."""
        self.logger, self.known = logger, dict(logger.last())

    def __call__(self, epoch: int, figures: Mapping[str, float]) -> None:
        """Hands on the ``figures`` that are numbers and not there yet."""
        new = {
            name: float(value)
            for name, value in figures.items()
            if math.isfinite(value) and epoch > self.known.get(name, -1)
        }
        if new:
            self.logger.write(epoch, new)
            self.known |= dict.fromkeys(new, epoch)
