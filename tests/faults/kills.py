"""Runs that are killed or asked to stop."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from berteam_cli import checkpoint
from berteam_cli.records import Tables
from tests.faults.forking import Prepare, finished, started
from tests.faults.job import GO_ON, WORDS, Whole, fresh, moments, wrong_at_last, wrong_now

TOUCHING = ("open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.truncate", "shutil.rmtree")


def die() -> None:
    """Ends this process as SIGKILL does."""
    os.kill(os.getpid(), signal.SIGKILL)


def survived(place: Path, known: Whole) -> str:
    """Returns what is wrong after a run was killed in ``place``: nothing, if it is whole in the end."""
    return wrong_now(place) or wrong_at_last(place, known)


def at_random(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Kills runs at so many random moments, a third of them again as they go on; yields what, and what is wrong."""
    again = np.random.default_rng(seed).random(count) < 1 / 3
    for moment, twice in zip(moments(known.seconds, count, seed), again, strict=True):
        fresh(place)
        for words in (WORDS, GO_ON)[: 1 + twice]:
            child = started(place, *words)
            if child.ended_within(moment / (1 + twice)) is None:
                child.kill()
                child.ended()
        yield f"SIGKILL after {moment:.2f} s{', twice' if twice else ''}", survived(place, known)


def touching(place: Path, number: int, tell: Path | None = None) -> Prepare:
    """Returns what lets a process die before it touches files of its run for the ``number``-th time.

    Args:
        place: where it runs.
        number: 0 never dies.
        tell: file that gets a byte for each time.
    """

    def prepare() -> None:
        count = 0
        counting = None if tell is None else os.open(tell, os.O_WRONLY | os.O_CREAT | os.O_APPEND)

        def hook(event: str, arguments: tuple[Any, ...]) -> None:
            nonlocal count
            if event not in TOUCHING or not (arguments and isinstance(arguments[0], str | os.PathLike)):
                return
            path = Path(os.path.abspath(os.fspath(arguments[0])))
            if path.is_relative_to(place / "run"):
                count += 1
                if counting is not None:
                    os.write(counting, b".")
                if count == number:
                    die()

        sys.addaudithook(hook)

    return prepare


def at_files(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Kills runs before so many of their touches of files: opening, renaming, removing, making folders."""
    fresh(place)
    tally = place / "tally"
    code, said = finished(place, *WORDS, prepare=touching(place, 0, tally))
    assert code == 0, said
    touches = tally.stat().st_size
    rng = np.random.default_rng(seed)
    for number in np.sort(1 + rng.choice(touches, min(count, touches), replace=False)):
        fresh(place)
        code, said = finished(place, *WORDS, prepare=touching(place, int(number)))
        assert code == -signal.SIGKILL, said
        yield f"SIGKILL before touch {number} of {touches} of a file", survived(place, known)


def half_row(number: int) -> Prepare:
    """Returns what lets a process die with half of what it adds to tables for the ``number``-th time written."""

    def prepare() -> None:
        count, add = 0, Tables.add

        def half(self: Tables, name: str, rows: Any) -> None:
            nonlocal count
            count += 1
            if count < number:
                add(self, name, rows)
                return
            file = self.files[name]
            before = file.tell()
            add(self, name, rows)
            os.truncate(file.fileno(), (before + 1 + os.fstat(file.fileno()).st_size) // 2)
            die()

        Tables.add = half  # type: ignore[method-assign]

    return prepare


def half_checkpoint(number: int) -> Prepare:
    """Returns what lets a process die with half of its ``number``-th checkpoint's tensors written."""

    def prepare() -> None:
        count, save = 0, checkpoint.save_file

        def half(tensors: Any, path: Path) -> None:
            nonlocal count
            count += 1
            save(tensors, path)
            if count == number:
                os.truncate(path, path.stat().st_size // 2)
                die()

        checkpoint.save_file = half

    return prepare


def in_the_middle(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Kills runs in the middle of rows and of checkpoints, so many of each."""
    rng = np.random.default_rng(seed)
    for what, prepare, most in (("row", half_row, 50), ("checkpoint", half_checkpoint, 5)):
        for number in 1 + rng.choice(most, min(count, most), replace=False):
            fresh(place)
            code, said = finished(place, *WORDS, prepare=prepare(int(number)))
            assert code == -signal.SIGKILL, said
            yield f"SIGKILL in the middle of {what} {number}", survived(place, known)


def asked(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Asks runs to stop at random moments, with Ctrl-C and with SIGTERM; once in three times twice."""
    rng = np.random.default_rng(seed)
    for k, moment in enumerate(moments(known.seconds, count, seed + 1)):
        fresh(place)
        number, twice = (signal.SIGINT, signal.SIGTERM)[k % 2], rng.random() < 1 / 3
        child = started(place, *WORDS)
        code = child.ended_within(moment)
        if code is None:
            child.kill(number)
            if twice:
                time.sleep(0.05)
                if (code := child.ended_within(0.0)) is None:
                    child.kill(number)
            code = child.ended() if code is None else code
        said = child.said.read_text()
        refused = "" if code in {0, 130, -signal.SIGTERM} and "Traceback" not in said else f"exit {code}: {said}"
        yield f"{number.name} after {moment:.2f} s{', twice' if twice else ''}", refused or survived(place, known)
