"""Lets a run end in order when somebody asks it to."""

from __future__ import annotations

import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

log = logging.getLogger("berteam")

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@dataclass
class Stop:
    """Whether somebody asked the run to end, and whether it must not yet.

    Attributes:
        asked: somebody did.
        in_epoch: epochs are under way: half of one must not be saved, so the run ends after it.
        file: whoever makes or touches it asks, too, from wherever the run may not hear of a signal; None for none.
        touched: when that was done last before the run began, in ns; 0: it was not there.
    """

    asked: bool = False
    in_epoch: bool = False
    file: Path | None = None
    touched: int = 0

    @contextmanager
    def epochs(self) -> Iterator[None]:
        """Tells that epochs are under way."""
        self.in_epoch = True
        try:
            yield
        finally:
            self.in_epoch = False

    def wanted(self) -> bool:
        """Returns whether the run is to end."""
        return self.asked or when(self.file) not in (0, self.touched)


def when(file: Path | None) -> int:
    """Returns when ``file`` was touched last, in ns; 0 if it is not there."""
    with suppress(OSError):
        return file.stat().st_mtime_ns if file else 0
    return 0


@contextmanager
def stoppable(file: Path | None = None) -> Iterator[Stop]:
    """Lets Ctrl-C, SIGTERM and SIGHUP end the run after its epoch, and at once if repeated, or outside of its epochs.

    Whoever touches ``file`` from now on asks for its end after an epoch, too. SIGHUP stays ignored where it is, as
    nohup has it: such a run outlives its terminal.
    """
    stop = Stop(file=file, touched=when(file))

    def ask(number: int, frame: FrameType | None) -> None:
        if stop.asked or not stop.in_epoch:
            raise KeyboardInterrupt
        stop.asked = True
        log.info("Stopping after this epoch; once more to stop at once.")

    try:
        heard = [n for n in SIGNALS if n == signal.SIGINT or signal.getsignal(n) is not signal.SIG_IGN]
        before = {number: signal.signal(number, ask) for number in heard}
    except ValueError:  # not the main thread: whoever owns that handles signals
        yield stop
        return
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
