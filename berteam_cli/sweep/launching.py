"""Hands the jobs of a sweep that are not done to a launcher, and tells of those that fail elsewhere."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from hydra.core.utils import JobStatus
from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from berteam_cli.compose import said
from berteam_cli.errors import InputError
from berteam_cli.folder import MANIFEST
from berteam_cli.sweep.folder import LOCKS, STOP, Sweep, working, write_table
from berteam_cli.sweep.job import manifest_of, told
from berteam_cli.sweep.process import HERE

PRINTING = (HERE, "JoblibLauncher")  # their jobs' words reach the terminal
LOOK_S = 0.5  # between two looks at jobs that run elsewhere


def run(folder: Path, launcher: Any, compose: Callable[[list[str]], object], at_once: int | None) -> None:
    """Runs what is not done of the sweep in ``folder``.

    Args:
        folder: of the sweep.
        launcher: Hydra's, set up.
        compose: makes the config of a job from its words, as the launcher will.
        at_once: jobs that it gets at once; None: all.
    """
    sweep = Sweep.read(folder)
    batch = Batch(sweep, launcher, compose)
    if sweep.search:
        from berteam_cli.sweep.search import search  # noqa: PLC0415 (an extra)

        search(sweep, batch.launch)
        return
    jobs = sweep.unfinished()
    size = at_once or max(1, len(jobs))
    for start in range(0, len(jobs), size):
        if not batch.launch(jobs[start : start + size]):
            return


@dataclass(frozen=True)
class Batch:
    """What runs some jobs of a sweep.

    Attributes:
        sweep: of the jobs.
        launcher: Hydra's, set up.
        compose: makes the config of a job from its words.
    """

    sweep: Sweep
    launcher: Any
    compose: Callable[[list[str]], object]

    def launch(self, jobs: Sequence[int]) -> bool:
        """Runs ``jobs`` and comes back when they have ended; returns whether others may follow."""
        name, folder = type(self.launcher).__name__, self.sweep.folder
        words = {job: [*self.sweep.jobs[job], *beginning(self.sweep, job)] for job in jobs}
        words = {job: line for job, line in words.items() if self.fits(job, line)}
        try:
            if words:
                with telling(self.sweep, list(words), quiet=name in PRINTING), stopping(folder, here=name == HERE):
                    self.hand_over(words)
        except Exception as error:  # a process that was killed takes joblib's others with it
            why = (str(error).strip() or "no reason given").splitlines()[0]
            print(f"berteam: The launcher gave up: {type(error).__name__}: {why}", file=sys.stderr, flush=True)
            return False
        finally:
            write_table(folder)
        return not (folder / LOCKS / STOP).exists()

    def fits(self, job: int, words: list[str]) -> bool:
        """Returns whether the words of a job go together for Hydra; a job whose do not is refused, and the rest run."""
        try:
            self.compose(words)
        except (HydraException, OmegaConfBaseException) as error:
            folder = self.sweep.folder / str(job)
            folder.mkdir(exist_ok=True)
            with suppress(InputError), working(folder):  # else whoever is at work there tells what becomes of it
                manifest_of(folder, "refused").add(overrides=self.sweep.jobs[job], error=said(error))
            print(told(job, self.sweep.jobs[job], said(error)), file=sys.stderr, flush=True)
            return False
        return True

    def hand_over(self, jobs: dict[int, list[str]]) -> None:
        """Gives jobs, their words by their number, to the launcher, and tells what befell it."""
        words = [[*line, f"hydra.sweep.subdir={job}"] for job, line in jobs.items()]
        for job, ended in zip(jobs, self.launcher.launch(words, initial_job_idx=min(jobs)), strict=True):
            if ended.status == JobStatus.FAILED:  # outside of what swept() catches and writes down
                error = ended._return_value
                print(told(job, jobs[job], f"{type(error).__name__}: {error}"), file=sys.stderr, flush=True)


def beginning(sweep: Sweep, job: int) -> list[str]:
    """Returns the words that let a job begin: go on where it can, begin again what failed.

    One that somebody is at work on goes on, too: it may have ended by its turn.
    """
    folder = sweep.folder / str(job)
    if not (folder / MANIFEST).exists():
        return []
    status, _ = sweep.status(job)
    began = sweep.command != "train" or any((folder / "checkpoint").glob("epoch_*"))
    goes_on = status == "running" or (status == "interrupted" and began)
    return [f"on_exists={'resume' if goes_on else 'overwrite'}"]


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
def stopping(folder: Path, *, here: bool) -> Iterator[None]:
    """Lets the first Ctrl-C end running jobs after their epoch and begin no other; the second ends all at once.

    Args:
        folder: of the sweep.
        here: whether they run in this process, and so hear of it themselves.
    """
    if here or threading.current_thread() is not threading.main_thread():
        yield
        return
    stop = folder / LOCKS / STOP

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
