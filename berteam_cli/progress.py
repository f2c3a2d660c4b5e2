"""Tells how far long work is: a bar on a terminal, elsewhere a line now and then."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from berteam_cli.pace import spoken
from berteam_cli.terminal import console, interactive

log = logging.getLogger("berteam")

PATIENCE_S = 2.0  # what is done sooner needs no telling
SILENCE_S = 10.0  # between two lines where there is no terminal


@contextmanager
def progress(title: str, total: int, unit: str = "games") -> Iterator[Callable[[int], None]]:
    """Gives a function that is told how many more of ``total`` units are done.

    Nothing is said of work that is done within two seconds.

    Args:
        title: what is done, such as "Rating 28 teams".
        total: units of it.
        unit: what they are, in the plural.
    """
    teller = _Bar(title, total, unit) if interactive() else _Lines(title, total, unit)
    try:
        yield teller.tell
    finally:
        teller.end()


class _Lines:
    """Log lines."""

    def __init__(self, title: str, total: int, unit: str) -> None:
        self.title, self.total, self.unit = title, total, unit
        self.done = 0
        self.begun = time.monotonic()
        self.due = self.begun + PATIENCE_S

    def tell(self, more: int) -> None:
        self.done += more
        at = time.monotonic()
        if at < self.due or self.done >= self.total:
            return
        rate = self.done / (at - self.begun)
        left = spoken((self.total - self.done) / rate) if rate > 0 else "unknown time"
        said = (self.title, f"{self.done:,}", f"{self.total:,}", self.unit, f"{rate:,.0f}", left)
        log.info("%s: %s of %s %s, %s a second, %s left", *said)
        self.due = at + SILENCE_S

    def end(self) -> None:
        pass


class _Bar:
    """A bar, from the third second on."""

    def __init__(self, title: str, total: int, unit: str) -> None:
        self.begun = time.monotonic()
        self.bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn(unit),
            TextColumn("{task.fields[rate]}"),
            TimeRemainingColumn(elapsed_when_finished=True),
            console=console(),
            refresh_per_second=4,
            transient=True,
        )
        self.task = self.bar.add_task(title, total=total, rate="")
        self.shown = False

    def tell(self, more: int) -> None:
        spent = time.monotonic() - self.begun
        done = self.bar.tasks[0].completed + more
        self.bar.update(self.task, advance=more, rate=f"{done / max(spent, 1e-9):,.0f}/s")
        if not self.shown and spent >= PATIENCE_S:
            self.bar.start()
            self.shown = True

    def end(self) -> None:
        if self.shown:
            self.bar.stop()
