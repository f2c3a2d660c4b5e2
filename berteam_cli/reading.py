"""A run as the commands read it that look at what it came to."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from berteam_cli import build, checkpoint
from berteam_cli.config import checked
from berteam_cli.errors import InputError, RunError
from berteam_cli.folder import read_manifest
from berteam_cli.holding import in_use
from berteam_cli.stored import plain_config, stored_config
from berteam_cli.training import Parts, Run


def last_state(folder: Path, workers: int | str = 0, trust: Collection[str] = ()) -> tuple[Parts, Run]:
    """Returns the parts of the run in ``folder`` and its newest checkpoint that is whole.

    Args:
        folder: of the run.
        workers: who plays, as of the config key.
        trust: what the run's game may import.

    Raises:
        InputError: there is no such run, or it has no such checkpoint.
    """
    read_manifest(folder)
    config = checked(stored_config(folder, trust))
    config.workers = workers
    try:
        parts = build.parts_to_read(config, folder)
        return parts, checkpoint.load(folder, parts).run
    except RunError as error:
        raise InputError(str(error)) from error


def how_far(folder: Path, epoch: int) -> str:
    """Returns how far the run in ``folder`` had come at its checkpoint of ``epoch``, and what became of it.

    Raises:
        InputError: there is no such run.
    """
    status = read_manifest(folder)["status"]
    if status == "done":
        return f"after epoch {epoch}"
    said = ("still going" if in_use(folder) else "broken off") if status == "running" else status
    return f"after epoch {epoch} of {plain_config(folder).epochs}, {said}"
