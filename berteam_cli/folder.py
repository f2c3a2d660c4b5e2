"""The folder of a run: who may write there, its manifest and its log."""

from __future__ import annotations

import json
import logging
import os
import platform
import shutil
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

from berteam_cli.errors import InputError, RunError, shown
from berteam_cli.quiet import written
from berteam_cli.records import COLUMNS, EVALUATION, SHEET_ENDINGS, SHEETS
from berteam_cli.terminal import Printed, berteam

MANIFEST, CONFIG, LOG, ERROR = "manifest.json", "config.yaml", "log.txt", "error.txt"
PACKAGES = ("berteam-cli", "torch", "numpy", "numba", "pandas", "stable-baselines3", "pettingzoo", "hydra-core")

log = logging.getLogger("berteam")


def new_folder(command: str) -> Path:
    """Returns where a run of ``command`` goes if nothing else is said."""
    return Path("outputs", command, datetime.now().strftime("%Y-%m-%d_%H-%M-%S-%f"))


def claim(folder: Path, on_exists: str) -> None:
    """Makes ``folder``, which this process holds, ready for a new run.

    With ``on_exists`` "overwrite" the files of an earlier run are removed, and nothing else that lies there.

    Raises:
        InputError: it holds a run already, or it cannot be written.
    """
    if not os.path.exists(folder / MANIFEST):
        return
    if on_exists != "overwrite":
        raise InputError(
            f"out={folder} holds a run already; choose another folder, "
            f"or on_exists=overwrite to replace it, or on_exists=resume to go on with it."
        )
    try:
        os.truncate(folder / LOG, 0)  # it is what the folder is held by
        for name in ("checkpoint", "pool", "tensorboard"):
            shutil.rmtree(folder / name, ignore_errors=True)
        for sheet, ending in product(SHEETS, SHEET_ENDINGS):
            (folder / EVALUATION / f"{sheet}{ending}").unlink(missing_ok=True)
        (folder / EVALUATION / LOG).unlink(missing_ok=True)
        # The manifest goes last: until then the folder is still that of a run, and can be overwritten again.
        for name in (*(f"{table}.csv" for table in COLUMNS), CONFIG, ERROR, MANIFEST):
            for place in (folder / EVALUATION, folder):
                (place / name).unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"out={folder} cannot be written: {error.strerror or error}.") from error


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Makes ``path`` with ``write``; there is never half of it.

    Raises:
        InputError: it cannot be written.
    """
    part = path.with_name(f"{path.name}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            write(part)
            os.replace(part, path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}.") from error


def write_text(path: Path, text: str) -> None:
    """Writes a small file; there is never half of it under ``path``, and nothing else stays of what failed."""
    part = path.with_suffix(".part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def newest(folder: Path) -> int:
    """Returns the epoch of the newest checkpoint in the run's ``folder``, whole or not; -1 if there is none."""
    numbers = (path.name.removeprefix("epoch_") for path in (folder / "checkpoint").glob("epoch_*"))
    return max((int(number) for number in numbers if number.isdecimal()), default=-1)


def evaluated_at(folder: Path) -> int:
    """Returns the epoch after which the run in ``folder`` was evaluated; -1 if it was not."""
    try:
        return int(read_manifest(folder / EVALUATION).get("epoch", -1))
    except (InputError, ValueError, TypeError, OverflowError):
        return -1


def missing(folder: Path) -> list[Path]:
    """Returns the folders that must be made for ``folder`` to be there, outermost first."""
    return [path for path in (*reversed(folder.parents), folder) if not os.path.exists(path)]


class Manifest:
    """What is known of a run beside its numbers, kept in manifest.json."""

    def __init__(self, folder: Path, facts: dict[str, Any]) -> None:
        """Takes what is known of the run in ``folder``; writes nothing."""
        self.folder, self.facts = folder, facts

    @classmethod
    def of(cls, folder: Path) -> Manifest:
        """Returns the manifest that is in ``folder``.

        Raises:
            InputError: there is none.
        """
        return cls(folder, read_manifest(folder))

    @classmethod
    def begun(cls, folder: Path, **facts: Any) -> Manifest:
        """Returns the manifest of a run that begins now; it is in ``folder`` then."""
        manifest = cls(folder, {"status": "running", "command": command_line(), "started": now(), "ended": None})
        manifest.add(**circumstances() | facts)
        return manifest

    @classmethod
    def resumed(cls, folder: Path, **facts: Any) -> Manifest:
        """Returns the manifest of a run that goes on now; what was known of it is kept, but how it failed."""
        manifest = cls.of(folder)
        manifest.facts.pop("error", None)
        again = {"command": command_line(), "started": now()}
        resumed = [*manifest.facts.get("resumed", []), again]
        manifest.add(status="running", ended=None, resumed=resumed, **circumstances(), **facts)
        return manifest

    def add(self, **facts: Any) -> None:
        """Adds to what is known, and writes it; there is never half of the file."""
        self.facts |= facts
        write_text(self.folder / MANIFEST, json.dumps(self.facts, indent=1) + "\n")

    def note(self, **facts: Any) -> None:
        """Adds to what is known, if it can be written: something else has gone wrong, and is told instead."""
        with suppress(OSError):
            self.add(**facts)

    @contextmanager
    def until_the_end(self, resumable: bool = True, again: str = "") -> Iterator[None]:
        """Notes how what is done inside ends: done, interrupted or failed.

        Args:
            resumable: whether `berteam resume` goes on with it, from a checkpoint.
            again: how else to go on, as it is told.

        Raises:
            RunError: it failed; the traceback is in error.txt.
            KeyboardInterrupt: it was interrupted.
        """
        (self.folder / ERROR).unlink(missing_ok=True)

        def go_on() -> str:
            if again:
                return again
            if resumable and newest(self.folder) >= 0:
                return f"Go on with: {berteam('resume', [self.folder])}"
            return "Begin anew with on_exists=overwrite."

        try:
            yield
        except KeyboardInterrupt:
            self.note(status="interrupted", ended=now())
            log.info("Interrupted. %s", go_on())
            raise
        except Exception as error:
            where = f" (traceback in {self.folder / ERROR})"
            try:
                write_text(self.folder / ERROR, traceback.format_exc())
            except OSError:  # the disk is full, perhaps
                where = ""
            self.note(status="failed", ended=now())
            raise RunError(f"The run failed: {type(error).__name__}: {error}{where}. {go_on()}") from error
        self.add(status="done", ended=now())


def circumstances() -> dict[str, Any]:
    """Returns what a result may depend on beside the config."""
    return {
        "versions": {name: version(name) for name in PACKAGES},
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} processors",
        "tables": 1,
    }


def command_line() -> list[str]:
    """Returns the words this process was started with."""
    return [Path(sys.argv[0]).name, *sys.argv[1:]]


def now() -> str:
    """Returns the time as it is written."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def read_manifest(folder: Path) -> dict[str, Any]:
    """Returns the manifest of the run in ``folder``.

    Raises:
        InputError: there is no run.
    """
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{folder} is no folder of a run: it has no readable {MANIFEST}.") from error
    if not isinstance(manifest, dict) or not {"status", "started", "command"} <= manifest.keys():
        raise InputError(f"{folder} is no folder of a run: its {MANIFEST} is not one.")
    for key, kind in FACTS.items():
        if key in manifest and not isinstance(manifest[key], kind):
            raise InputError(f"{folder} is no folder of a run: {key} in its {MANIFEST} is of another kind.")
    check_links(folder)
    return manifest


class Lines(logging.FileHandler):
    """The log; a line for which there is no room on the disk is left out, as what it is about goes on or is told."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Does nothing."""


FACTS = {"status": str, "started": str, "command": list, "resumed": list, "overrides": list, "error": str}
"""Kinds of what commands read of a manifest."""
INSIDE = ("checkpoint", "pool", EVALUATION, "report", "replay", "tensorboard", "mlflow", "wandb")
"""Folders in that of a run, where commands read and write."""


def check_links(folder: Path) -> None:
    """Checks that nothing in the run's ``folder`` leads out of it: it would be read, shown or written over.

    The folder itself may be a link, and have links to its own files.

    Raises:
        InputError: something does.
    """
    home = folder.resolve()
    # Not by rglob, which fails where a run that goes on has just moved a folder, as it does with each checkpoint.
    walks = (found for name in INSIDE for found in os.walk(folder / name))
    inside = (Path(place, name) for place, folders, files in walks for name in (*folders, *files))
    for path in (*folder.iterdir(), *inside):
        try:
            kept = not path.is_symlink() or path.resolve().is_relative_to(home)
        except (OSError, RuntimeError):  # a link to itself
            kept = False
        if not kept:
            raise InputError(f"{path} is a link out of the run's folder, which must hold its files itself.")


class Plain(logging.Formatter):
    """Writes lines that a terminal only shows, whatever signs are in the names in them."""

    def format(self, record: logging.LogRecord) -> str:  # noqa: D102
        return "\n".join(shown(line) for line in super().format(record).split("\n"))


@contextmanager
def logging_to(folder: Path) -> Iterator[None]:
    """Sends the log to the terminal and, with times, to the folder's log.txt; the folder is its first line."""
    file = Lines(folder / LOG, encoding="utf-8")
    file.setFormatter(Plain("%(asctime)s %(levelname)s %(message)s"))
    terminal = Printed()
    log.setLevel(logging.INFO)
    log.propagate = False
    log.handlers = [file, terminal]
    written(folder)
    log.info("%s", folder)
    try:
        yield
    finally:
        log.handlers = []
        file.close()
