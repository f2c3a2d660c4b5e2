"""berteam resume: goes on with a run from its last whole checkpoint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from berteam_cli.command.train import train
from berteam_cli.config import SCHEMAS, IslandConfig, TrainConfig, checked, one_line
from berteam_cli.errors import InputError, did_you_mean
from berteam_cli.folder import CONFIG, read_manifest

MAY_CHANGE = ("epochs", "out", "on_exists", "workers", "checkpoint_every", "evaluation")
"""Keys whose values may differ from those the run began with: they change nothing that is done already."""


def resume(folder: Path, overrides: list[str]) -> float:
    """Goes on with the run in ``folder``.

    Args:
        folder: of a training run.
        overrides: ``key=value`` of MAY_CHANGE.

    Raises:
        InputError: there is no run, or an override is not allowed.
    """
    read_manifest(folder)
    stored = stored_config(folder)
    try:
        changes = OmegaConf.from_dotlist(overrides)
    except (OmegaConfBaseException, ValueError) as error:
        raise InputError(f"{' '.join(overrides)!r} is no list of key=value: {error}.") from error
    for override in overrides:
        key = override.split("=")[0]
        if key.split(".")[0] not in MAY_CHANGE:
            allowed = ", ".join(MAY_CHANGE)
            raise InputError(
                f"{key} cannot be changed when a run goes on; {allowed} can.{did_you_mean(key, MAY_CHANGE)}"
            )
    try:
        config = OmegaConf.merge(stored, changes, {"on_exists": "resume", "out": str(folder)})
    except OmegaConfBaseException as error:
        raise InputError(one_line(error)) from error
    return train(checked(config), OmegaConf.to_yaml(config), folder)


def stored_config(folder: Path) -> Any:
    """Returns the config of the run in ``folder``, with its schemas.

    Raises:
        InputError: it cannot be read, or it is not a training's.
    """
    try:
        plain = OmegaConf.load(folder / CONFIG)
        typed = OmegaConf.structured(TrainConfig)
        for group in ("env", "selector", "optimizer", "learner"):
            typed[group] = OmegaConf.structured(schema(group, plain[group].name))
        typed.evaluation = OmegaConf.structured(SCHEMAS["evaluation"]["truth"])
        typed.population = OmegaConf.structured(SCHEMAS["population"]["islands"])
        typed.population.islands = {}
        for name, island in plain.population.islands.items():
            typed.population.islands[name] = OmegaConf.structured(IslandConfig)
            typed.population.islands[name].learner = OmegaConf.structured(schema("learner", island.learner.name))
        return OmegaConf.merge(typed, plain)
    except (OSError, OmegaConfBaseException, AttributeError, KeyError, TypeError) as error:
        raise InputError(f"{folder / CONFIG} is no config of a training run of this version: {error}.") from error


def schema(group: str, name: str) -> type:
    """Returns the schema of choice ``name`` of ``group``."""
    return SCHEMAS[group][name]


def check_same(folder: Path, text: str) -> None:
    """Checks that the config ``text`` goes on with the run in ``folder``, and stores it there.

    Raises:
        InputError: a key that may not change has another value.
    """
    old, new = OmegaConf.load(folder / CONFIG), OmegaConf.create(text)
    old_values, new_values = flat(old), flat(new)
    for key in sorted(old_values.keys() | new_values.keys()):
        if key.split(".")[0] not in MAY_CHANGE and old_values.get(key) != new_values.get(key):
            raise InputError(
                f"{key} is {new_values.get(key)!r}, but the run in {folder} was begun with {old_values.get(key)!r}; "
                f"it can only go on with the same."
            )
    (folder / CONFIG).write_text(text, encoding="utf-8")


def flat(config: Any, prefix: str = "") -> dict[str, Any]:
    """Returns the values of a config by dotted key; lists are values."""
    values: dict[str, Any] = {}
    for key, value in OmegaConf.to_container(config).items() if prefix == "" else config.items():
        path = f"{prefix}{key}"
        if isinstance(value, dict):
            values |= flat(value, f"{path}.")
        else:
            values[path] = value
    return values
