"""The real command in a process of its own that starts at once: everything is imported, then it is forked."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from berteam_cli import cli

Prepare = Callable[[], None]


def nothing() -> None:
    """Prepares nothing."""


@dataclass(frozen=True)
class Child:
    """A command under way.

    Attributes:
        pid: of its process.
        said: file with what it prints, on both streams.
    """

    pid: int
    said: Path

    def kill(self, number: int = signal.SIGKILL) -> None:
        """Sends a signal."""
        os.kill(self.pid, number)

    def ended(self) -> int:
        """Waits and returns the exit code; a signal's is negative."""
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])

    def ended_within(self, seconds: float) -> int | None:
        """Waits so long at most and returns the exit code, None if it still goes on."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                return os.waitstatus_to_exitcode(status)
            time.sleep(0.002)
        return None


def started(place: Path, *words: str, prepare: Prepare = nothing) -> Child:
    """Starts ``berteam words`` in folder ``place``, after it has called ``prepare``."""
    said = place / "said.txt"
    pid = os.fork()
    if pid:
        return Child(pid, said)
    code = 99
    try:
        os.chdir(place)
        out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(out, 1)
        os.dup2(out, 2)
        sys.argv = ["berteam", *words]
        prepare()
        cli.main()
        code = 0
    except SystemExit as stopped:
        code = stopped.code if isinstance(stopped.code, int) else 98
    except KeyboardInterrupt:  # before the command was under way
        code = 130
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def finished(place: Path, *words: str, prepare: Prepare = nothing) -> tuple[int, str]:
    """Runs ``berteam words`` to its end; returns its exit code and what it printed."""
    child = started(place, *words, prepare=prepare)
    code = child.ended()
    return code, child.said.read_text(encoding="utf-8", errors="replace")
