"""-q: nothing but errors, and as the last line where the command wrote."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

WORDS = ("-q", "--quiet")


class Written:
    """Where the command of this process writes."""

    place: Path | None = None


def written(place: Path) -> None:
    """Notes the folder or the file that the command writes.

    The first one counts: a command that has others do parts of its work, as a sweep and `berteam reproduce` do, says
    its own before theirs.
    """
    if Written.place is None:
        Written.place = place


@contextmanager
def hushed() -> Iterator[None]:
    """Sends the standard output nowhere, that of child processes too; at the end prints what was ``written``.

    Errors are seen, as they go to standard error. What the command prints elsewhere needs no conditions for this.
    """
    Written.place = None
    sys.stdout.flush()
    real, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.close(nowhere)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(real, 1)
        os.close(real)
        if Written.place is not None:
            print(Written.place, flush=True)
