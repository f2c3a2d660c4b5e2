"""What is printed: by one console, so that lines and live views do not write over each other."""

from __future__ import annotations

import functools
import io
import logging
import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from contextlib import suppress
from multiprocessing import current_process
from pathlib import Path
from typing import TextIO, cast

from rich.console import Console

from berteam_cli.errors import shown

WIDTH = 140  # of what no terminal shows: tables in a file or a pipe
PACE = "berteam.pace"  # the log's part that a live view shows better


class Output(io.TextIOBase):
    """The standard output. If it has gone, or its disk is full, no more is printed, and the work goes on."""

    @property
    def stream(self) -> TextIO:
        """Where it goes, past the stand-in that a live view of rich makes of it."""
        return cast(TextIO, getattr(sys.stdout, "rich_proxied_file", sys.stdout))

    @property
    def encoding(self) -> str:  # type: ignore[override]
        """Of the stream; rich draws with what it has."""
        return self.stream.encoding

    def fileno(self) -> int:
        """Returns the stream's number."""
        return self.stream.fileno()

    def isatty(self) -> bool:
        """Returns whether it is a terminal."""
        return self.stream.isatty()

    def write(self, text: str) -> int:
        """Writes ``text``, if it can be."""
        try:
            return self.stream.write(text)
        except OSError as error:
            self.gone(error)
            return len(text)

    def flush(self) -> None:
        """Writes what is held back, if it can be."""
        try:
            self.stream.flush()
        except OSError as error:
            self.gone(error)

    def gone(self, error: OSError) -> None:
        """Sends all that follows nowhere; tells why, unless the reader of a pipe has just seen enough."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.fileno())
        os.close(nowhere)
        if not isinstance(error, BrokenPipeError):
            with suppress(OSError):
                print(f"berteam: The output cannot be written: {error.strerror}. The work goes on.", file=sys.stderr)


@functools.cache
def console() -> Console:
    """Returns where everything is printed."""
    output = cast(TextIO, Output())
    known = Console(file=output)
    return known if known.is_terminal else Console(file=output, width=WIDTH)


def interactive() -> bool:
    """Returns whether a person looks on: a terminal that can go back over its lines, and no other process's.

    FORCE_COLOR alone makes no terminal of a pipe. The jobs of a sweep that run side by side would draw over each other.
    """
    there = console()
    return there.is_interactive and there.file.isatty() and current_process().name == "MainProcess"


class Printed(logging.Handler):
    """Prints the log, above a live view if there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        """Prints a line; the pace only where no live view tells it."""
        if record.name != PACE or not interactive():
            for line in self.format(record).split("\n"):
                say(line)


def say(sentence: str) -> None:
    """Prints a sentence on one line, as it is, whatever signs are in the names in it."""
    console().print(shown(sentence), markup=False, highlight=False, soft_wrap=True)


def end(folder: Path, files: Iterable[str], *then: str) -> None:
    """Prints a command's last lines: the files it has left, and what to do next.

    Args:
        folder: where they are.
        files: their names.
        then: what to do, a line each.
    """
    say(f"Files in {folder}: {', '.join(files)}")
    for line in then:
        say(f"Next: {line}")


def berteam(word: str, places: Sequence[Path], *words: str) -> str:
    """Returns a command line about the folders ``places`` as a shell reads it."""
    return " ".join(["berteam", word, *(shlex.quote(str(place)) for place in places), *words])
