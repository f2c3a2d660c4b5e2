"""A run as the commands read it that look at what it came to."""

from __future__ import annotations

from pathlib import Path

from berteam_cli import build, checkpoint
from berteam_cli.config import checked
from berteam_cli.errors import InputError, RunError
from berteam_cli.folder import read_manifest
from berteam_cli.stored import stored_config
from berteam_cli.training import Parts, Run


def last_state(folder: Path) -> tuple[Parts, Run]:
    """Returns the parts of the run in ``folder`` and its newest checkpoint that is whole.

    Raises:
        InputError: there is no such run, or it has no such checkpoint.
    """
    read_manifest(folder)
    parts = build.parts_to_read(checked(stored_config(folder)))
    try:
        return parts, checkpoint.load(folder, parts).run
    except RunError as error:
        raise InputError(str(error)) from error
