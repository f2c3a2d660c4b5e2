"""The folder of a sweep: its jobs in sweep.json, what became of them in sweep.csv, and who is at work there."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd
from filelock import FileLock, Timeout

from berteam_cli.errors import InputError
from berteam_cli.folder import MANIFEST, read_manifest
from berteam_cli.records import COLUMNS, cell

TABLE, JOBS, LOCKS = "sweep.csv", "sweep.json", ".locks"
STOP = "stop"  # in LOCKS: running jobs end after their epoch, and no further one begins
SCHEMA = 1
WAIT_S = 5.0  # longer than anybody holds a lock who only looks whether it is held
GLANCE_S = 0.05  # two who only look seldom hinder each other so long


@dataclass(frozen=True)
class Sweep:
    """What is to be done in a sweep's folder.

    Attributes:
        folder: of the sweep; job n lies in folder/n.
        command: what the jobs are of: train or tournament.
        jobs: the overrides of each job by its number.
        search: what berteam optuna looks for, see search.py; empty for a list of jobs.
    """

    folder: Path
    command: str
    jobs: dict[int, list[str]]
    search: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> Sweep:
        """Returns the sweep in ``folder``.

        Raises:
            InputError: there is none.
        """
        try:
            said = json.loads((folder / JOBS).read_text(encoding="utf-8"))
            if said["schema"] != SCHEMA:
                raise InputError(f"{folder} is a sweep of another version of berteam (schema {said['schema']}).")
            jobs = {int(number): [str(word) for word in words] for number, words in said["jobs"].items()}
            return cls(folder, str(said["command"]), jobs, dict(said["search"]))
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            hint = "; berteam resume goes on with a run" if (folder / MANIFEST).exists() else ""
            raise InputError(f"{folder} is no folder of a sweep: it has no readable {JOBS}{hint}.") from error

    def keep(self) -> None:
        """Writes sweep.json and the table; there is never half of one.

        Raises:
            InputError: the folder cannot be written.
        """
        try:
            (self.folder / LOCKS).mkdir(parents=True, exist_ok=True)
            said = {"schema": SCHEMA, "command": self.command, "search": self.search, "jobs": self.jobs}
            replace_with(self.folder / JOBS, json.dumps(said, indent=1) + "\n")
            make_table(self.folder)
        except OSError as error:
            raise InputError(f"{self.folder} cannot be written: {error.strerror or error}.") from error

    def status(self, job: int) -> tuple[str, dict[str, Any]]:
        """Returns what became of a job, and its manifest, empty if it has none.

        It is waiting, running, done, failed, refused (its settings do not go together) or interrupted.
        """
        folder = self.folder / str(job)
        with unheld(folder) as free:  # while it is read nobody begins or ends it, or else it is running
            try:
                facts = read_manifest(folder) if (folder / MANIFEST).exists() else {}
            except InputError as error:
                facts = {"status": "failed", "error": str(error)}
        status = str(facts.get("status", "waiting"))
        if status != "done" and not free:
            status = "running"
        elif status == "running":  # nobody is: whoever was got killed
            status = "interrupted"
        return status, facts

    def unfinished(self) -> list[int]:
        """Returns the numbers of the jobs that are not done."""
        return [job for job in sorted(self.jobs) if self.status(job)[0] != "done"]


def with_job(folder: Path, command: str, job: int, overrides: Sequence[str]) -> None:
    """Adds a job to the sweep in ``folder`` if it is not one already: a sweeper may find jobs as it goes."""
    (folder / LOCKS).mkdir(parents=True, exist_ok=True)
    with FileLock(folder / LOCKS / "jobs"):
        sweep = Sweep.read(folder) if (folder / JOBS).exists() else Sweep(folder, command, {})
        if job not in sweep.jobs:
            sweep.jobs[job] = list(overrides)
            sweep.keep()


def write_table(folder: Path) -> None:
    """Writes sweep.csv anew, or says that it cannot be: no job ends for that."""
    try:
        make_table(folder)
    except OSError as error:
        print(f"berteam: {folder / TABLE} cannot be written: {error.strerror or error}.", file=sys.stderr, flush=True)


def make_table(folder: Path) -> None:
    """Makes sweep.csv anew from what the jobs left; whoever writes later knows more."""
    with FileLock(folder / LOCKS / "table"):
        sweep = Sweep.read(folder)
        rows = []
        for job, words in sorted(sweep.jobs.items()):
            status, facts = sweep.status(job)
            row: dict[Any, Any] = {
                "job": job,
                "overrides": " ".join(words),
                "status": status,
                "error": facts.get("error", ""),
            }
            summary = folder / str(job) / "summary.csv"
            if status == "done" and summary.exists():
                row |= pd.read_csv(summary, dtype={"best_team": str}).iloc[0].to_dict()
            rows.append(row)
        columns = ["job", "overrides", "status", *COLUMNS["summary"], "error"]
        text = pd.DataFrame(rows, columns=columns).map(cell).to_csv(index=False, lineterminator="\n")
        replace_with(folder / TABLE, text)


def replace_with(path: Path, text: str) -> None:
    """Makes ``text`` what is in ``path``; there is never half of it, whoever else writes there."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def lock_of(folder: Path) -> FileLock:
    """Returns the lock that whoever works on the job in ``folder`` holds; the system opens it if they are killed."""
    return FileLock(folder.parent / LOCKS / folder.name)


@contextmanager
def working(folder: Path) -> Iterator[None]:
    """Holds the lock of the job in ``folder``, if it is one of a sweep.

    Raises:
        InputError: another process is at work there.
    """
    if not (folder.parent / LOCKS).is_dir():
        yield
        return
    lock = lock_of(folder)
    try:
        lock.acquire(timeout=WAIT_S)
    except Timeout:
        raise InputError(f"Another process is at work in {folder}; wait for it, or end it first.") from None
    try:
        yield
    finally:
        lock.release()


@contextmanager
def unheld(folder: Path) -> Iterator[bool]:
    """Keeps others from the job in ``folder`` if none is at work there, and yields whether that is so."""
    lock = lock_of(folder)
    try:
        lock.acquire(timeout=GLANCE_S, poll_interval=GLANCE_S / 10)
    except Timeout:
        yield False
        return
    try:
        yield True
    finally:
        lock.release()
