"""berteam resume: goes on with a run from its last whole checkpoint."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from berteam_cli.command.train import train
from berteam_cli.config import checked, one_line
from berteam_cli.errors import InputError, did_you_mean
from berteam_cli.folder import newest, read_manifest
from berteam_cli.stored import MAY_CHANGE, stored_config, whole_choice
from berteam_cli.sweep.folder import JOBS, working, write_table
from berteam_cli.trust import told


def resume(folder: Path, overrides: list[str]) -> float:
    """Goes on with the run in ``folder`` and returns its expected Elo.

    Args:
        folder: of a training run.
        overrides: ``key=value`` of MAY_CHANGE, and ``trust=module:function``.

    Raises:
        InputError: there is no run, or an override is not allowed.
        RunError: it cannot go on.
    """
    read_manifest(folder)
    trust, overrides = told(overrides)
    stored = stored_config(folder, trust)
    if newest(folder) < 0 and any(member.trust for member in stored.population.members):
        raise InputError(
            f"{folder} has no checkpoint yet, so its members would be read from their files anew, and what a run's "
            "folder trusts (trust: true) is not: give the command that began it again, with on_exists=resume."
        )
    for override in overrides:
        key, equals, _ = override.partition("=")
        if not equals:
            raise InputError(f"{override!r} cannot be read as key=value.")
        if key.split(".", maxsplit=1)[0] not in MAY_CHANGE:
            allowed = ", ".join(MAY_CHANGE)
            raise InputError(
                f"{key} cannot be changed when a run goes on; {allowed} can.{did_you_mean(key, MAY_CHANGE)}"
            )
    address = stored.logger.get("tracking")
    if address is not None and not any(x.startswith(("logger=", "logger.tracking=")) for x in overrides):
        raise InputError(
            f"{folder} sends its figures to {address}, which its folder names; if they are to go there, add "
            f"logger.tracking={address} to the command, else logger=csv."
        )
    try:
        chosen = [x for x in overrides if x.startswith("logger=")]
        for choice in chosen:
            stored.logger = whole_choice("logger", choice.partition("=")[2])
        changes = OmegaConf.from_dotlist([x for x in overrides if x not in chosen])
        config: Any = OmegaConf.merge(stored, changes, {"on_exists": "resume", "out": str(folder)})
    except OmegaConfBaseException as error:
        raise InputError(one_line(error)) from error
    job = Path(os.path.abspath(folder))  # whose sweep's folder has a name
    try:
        with working(job):
            return train(checked(config), OmegaConf.to_yaml(config), folder)
    finally:
        if (job.parent / JOBS).exists():
            write_table(job.parent)
