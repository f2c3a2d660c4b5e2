"""Hands the jobs of a sweep that are not done to a launcher, and tells of those that fail elsewhere."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from berteam_cli.folder import MANIFEST
from berteam_cli.sweep.folder import LOCKS, Sweep, write_table
from berteam_cli.sweep.job import STOP, told
from berteam_cli.sweep.process import HERE

PRINTING = (HERE, "JoblibLauncher")  # their jobs' words reach the terminal
LOOK_S = 0.5  # between two looks at jobs that run elsewhere


def run(folder: Path, launcher: Any, at_once: int | None) -> None:
    """Runs what is not done of the sweep in ``folder``.

    Args:
        folder: of the sweep.
        launcher: Hydra's, set up.
        at_once: jobs that it gets at once; None: all.
    """
    (folder / LOCKS / STOP).unlink(missing_ok=True)
    sweep = Sweep.read(folder)
    launch = launched(sweep, launcher)
    if sweep.search:
        from berteam_cli.sweep.search import search  # noqa: PLC0415 (an extra)

        search(sweep, launch)
        return
    jobs = sweep.unfinished()
    size = at_once or max(1, len(jobs))
    for start in range(0, len(jobs), size):
        launch(jobs[start : start + size])


def launched(sweep: Sweep, launcher: Any) -> Callable[[Sequence[int]], None]:
    """Returns a function that runs jobs of ``sweep``, by their numbers, and comes back when they have ended."""
    name = type(launcher).__name__

    def launch(jobs: Sequence[int]) -> None:
        if not jobs or (sweep.folder / LOCKS / STOP).exists():
            return
        words = [[*sweep.jobs[job], *beginning(sweep, job), f"hydra.sweep.subdir={job}"] for job in jobs]
        try:
            with telling(sweep, jobs, quiet=name in PRINTING), stopping(sweep, here=name == HERE):
                launcher.launch(words, initial_job_idx=jobs[0])
        except Exception as error:  # a process that was killed takes joblib's others with it
            said = (str(error).strip() or "no reason given").splitlines()[0]
            print(f"berteam: The launcher gave up: {type(error).__name__}: {said}", file=sys.stderr, flush=True)
            (sweep.folder / LOCKS / STOP).touch()
        finally:
            write_table(sweep.folder)

    return launch


def beginning(sweep: Sweep, job: int) -> list[str]:
    """Returns the words that let a job begin: go on where it can, begin again what failed."""
    folder = sweep.folder / str(job)
    if not (folder / MANIFEST).exists():
        return []
    status, _ = sweep.status(job)
    began = sweep.command != "train" or any((folder / "checkpoint").glob("epoch_*"))
    return [f"on_exists={'resume' if status == 'interrupted' and began else 'overwrite'}"]


@contextmanager
def telling(sweep: Sweep, jobs: Sequence[int], *, quiet: bool) -> Iterator[None]:
    """Prints the errors of ``jobs`` as they fail; where their own words reach the terminal, it is ``quiet``."""
    if quiet:
        yield
        return

    def written(job: int) -> int:
        manifest = sweep.folder / str(job) / MANIFEST
        return manifest.stat().st_mtime_ns if manifest.exists() else 0

    ended, left = threading.Event(), {job: written(job) for job in jobs}

    def look() -> None:
        for job, before in list(left.items()):
            status, facts = sweep.status(job)
            if status in {"failed", "refused", "done"} and written(job) != before:
                del left[job]
                if status != "done":
                    print(told(job, sweep.jobs[job], facts.get("error", "")), file=sys.stderr, flush=True)

    def watch() -> None:
        while not ended.wait(LOOK_S):
            look()

    watcher = threading.Thread(target=watch, daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()
        look()


@contextmanager
def stopping(sweep: Sweep, *, here: bool) -> Iterator[None]:
    """Lets the first Ctrl-C end running jobs after their epoch and begin no other; the second ends all at once.

    Args:
        sweep: of the jobs.
        here: whether they run in this process, and so hear of it themselves.
    """
    if here or threading.current_thread() is not threading.main_thread():
        yield
        return
    stop = sweep.folder / LOCKS / STOP

    def ask(number: int, frame: FrameType | None) -> None:
        if number != signal.SIGINT or stop.exists():
            stop.touch()
            raise KeyboardInterrupt
        stop.touch()
        print("Stopping: running jobs end after their epoch; once more to stop at once.", flush=True)

    numbers = [signal.SIGINT, signal.SIGTERM]
    before = {number: signal.signal(number, ask) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
