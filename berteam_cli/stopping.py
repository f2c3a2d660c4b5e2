"""Lets a run end in order when somebody asks it to."""

from __future__ import annotations

import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

log = logging.getLogger("berteam")

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@dataclass
class Stop:
    """Whether somebody asked the run to end, and whether it must not yet.

    Attributes:
        asked: somebody did.
        in_epoch: an epoch is under way: its half must not be saved, so the run ends after it.
    """

    asked: bool = False
    in_epoch: bool = False


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Lets Ctrl-C, SIGTERM and SIGHUP end the run after its epoch, at once between epochs, and at once if repeated.

    SIGHUP stays ignored where it is, as nohup has it: such a run outlives its terminal.
    """
    stop = Stop()

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
