"""The folder of a run: who may write there, its manifest and its log."""

from __future__ import annotations

import json
import logging
import os
import platform
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from berteam_cli.errors import InputError
from berteam_cli.records import COLUMNS

MANIFEST, CONFIG, LOG = "manifest.json", "config.yaml", "log.txt"
PACKAGES = ("berteam-cli", "torch", "numpy", "numba", "pandas", "stable-baselines3", "pettingzoo", "hydra-core")

log = logging.getLogger("berteam")


def new_folder(command: str) -> Path:
    """Returns where a run of ``command`` goes if nothing else is said."""
    return Path("outputs", command, datetime.now().strftime("%Y-%m-%d_%H-%M-%S-%f"))


def claim(folder: Path, on_exists: str) -> None:
    """Makes ``folder`` ready for a new run.

    With ``on_exists`` "overwrite" the files of an earlier run are removed, and nothing else that lies there.

    Raises:
        InputError: it holds a run already, or it cannot be written.
    """
    if (folder / MANIFEST).exists():
        if on_exists != "overwrite":
            raise InputError(
                f"out={folder} holds a run already; choose another folder, "
                f"or on_exists=overwrite to replace it, or on_exists=resume to go on with it."
            )
        for name in (*(f"{table}.csv" for table in COLUMNS), MANIFEST, CONFIG, LOG):
            (folder / name).unlink(missing_ok=True)
        shutil.rmtree(folder / "checkpoint", ignore_errors=True)
    made = missing(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / LOG).touch()
    except OSError as error:
        for path in reversed(made):
            if path.is_dir():
                path.rmdir()
        raise InputError(f"out={folder} cannot be written: {error.strerror or error}.") from error


def missing(folder: Path) -> list[Path]:
    """Returns the folders that must be made for ``folder`` to be there, outermost first."""
    return [path for path in (*reversed(folder.parents), folder) if not path.exists()]


class Manifest:
    """What is known of a run beside its numbers, kept in manifest.json."""

    def __init__(self, folder: Path, **facts: Any) -> None:
        """Writes the manifest of a run that begins now."""
        self.path = folder / MANIFEST
        self.facts = {
            "status": "running",
            "command": [Path(sys.argv[0]).name, *sys.argv[1:]],
            "started": now(),
            "ended": None,
            "versions": {name: version(name) for name in PACKAGES},
            "python": platform.python_version(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors",
            "tables": 1,
            **facts,
        }
        self.write()

    def add(self, **facts: Any) -> None:
        """Adds to what is known, and writes it."""
        self.facts |= facts
        self.write()

    def end(self, status: str) -> None:
        """Tells how the run ended: done, failed or interrupted."""
        self.add(status=status, ended=now())

    def write(self) -> None:
        """Writes the file; there is never half of it."""
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps(self.facts, indent=1) + "\n", encoding="utf-8")
        os.replace(part, self.path)


def now() -> str:
    """Returns the time as it is written."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def read_manifest(folder: Path) -> dict[str, Any]:
    """Returns the manifest of the run in ``folder``.

    Raises:
        InputError: there is no run.
    """
    try:
        return json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder} is no folder of a run: it has no readable {MANIFEST}.") from error


@contextmanager
def logging_to(folder: Path) -> Iterator[None]:
    """Sends the log to the terminal and, with times, to the folder's log.txt."""
    file = logging.FileHandler(folder / LOG, encoding="utf-8")
    file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    terminal = logging.StreamHandler(sys.stdout)
    terminal.setFormatter(logging.Formatter("%(message)s"))
    log.setLevel(logging.INFO)
    log.propagate = False
    log.handlers = [file, terminal]
    try:
        yield
    finally:
        log.handlers = []
        file.close()
