"""The config that a run folder holds."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import yaml
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from berteam_cli.checkpoint import check_schema
from berteam_cli.config import SCHEMAS
from berteam_cli.config_commands import TrainConfig
from berteam_cli.config_members import IslandConfig
from berteam_cli.errors import InputError
from berteam_cli.folder import CONFIG, MANIFEST, Manifest, claim, newest, write_text
from berteam_cli.holding import held
from berteam_cli.trust import check_trusted

MAY_CHANGE = ("epochs", "workers", "checkpoint_every", "evaluation", "logger")
"""Keys whose values may differ from those a run began with: they change nothing that is done already."""
REFERENCE = "evaluation.reference_teams"
"""Below ``evaluation``, but fixed where there is ``evaluate_every``: it says who was met in looks that are done."""
LARGEST = 2**24  # bytes of a config; usual are three thousand
PLACE = ("out", "on_exists")
"""Keys that say where a run goes, not what it does."""


def write_config(folder: Path, text: str) -> None:
    """Writes the config ``text``; there is never half of it."""
    write_text(folder / CONFIG, text)


def plain_config(folder: Path) -> DictConfig:
    """Returns the config of the run in ``folder`` as it stands there: values, and nothing that stands for others.

    Raises:
        InputError: it cannot be read.
    """
    try:
        config = OmegaConf.create(plain_yaml(folder / CONFIG))
    except (OSError, ValueError, RecursionError, yaml.YAMLError, OmegaConfBaseException) as error:
        raise InputError(f"{folder / CONFIG} cannot be read: {first_line(error)}.") from error
    if not isinstance(config, DictConfig):
        raise InputError(f"{folder / CONFIG} cannot be read: it holds no keys.")
    return config


def plain_yaml(path: Path) -> str:
    """Returns the text of a yaml file that holds values only, as a run writes it.

    Raises:
        OSError: it cannot be read.
        ValueError: it has tags, which may stand for objects, interpolations, which may stand for anything on this
            machine, or aliases, which a few lines may make millions of; or is no yaml, or too large.
    """
    if path.stat().st_size > LARGEST:
        raise ValueError(f"it has more than {LARGEST >> 20} MiB")
    text = path.read_text(encoding="utf-8")
    for token in yaml.scan(text, Loader=yaml.SafeLoader):
        said = token.value if isinstance(token, yaml.ScalarToken) else ""
        if isinstance(token, yaml.TagToken | yaml.AnchorToken | yaml.AliasToken) or "${" in said:
            raise ValueError(f"line {token.start_mark.line + 1} has a tag, an alias or an interpolation, and no value")
    return text


def first_line(error: Exception) -> str:
    """Returns the first line of what an error says, or of what kind it is."""
    return f"{error}".partition("\n")[0].rstrip(".") or type(error).__name__


def stored_config(folder: Path, trust: Collection[str] = ()) -> DictConfig:
    """Returns the config of the training run in ``folder``, with its schemas.

    Args:
        folder: of the run.
        trust: what the run's game may import.

    Raises:
        InputError: it cannot be read, is not a training's or another version's, or imports something else.
    """
    config = typed_config(folder)
    env: Any = OmegaConf.to_object(config.env)
    check_trusted(folder, env, trust)
    return config


def typed_config(folder: Path) -> DictConfig:
    """Returns the config of the training run in ``folder``, with its schemas, for whoever does not make its game.

    Raises:
        InputError: it cannot be read, or is not a training's or another version's.
    """
    check_schema(folder)
    plain = plain_config(folder)
    try:
        typed = OmegaConf.structured(TrainConfig)
        for group in ("env", "selector", "optimizer", "learner", "logger", "opponents"):
            typed[group] = OmegaConf.structured(SCHEMAS[group][plain[group].name])
        typed.evaluation = OmegaConf.structured(SCHEMAS["evaluation"]["truth"])
        typed.curriculum = OmegaConf.structured(SCHEMAS["curriculum"]["none"])
        typed.population = OmegaConf.structured(SCHEMAS["population"]["islands"])
        typed.population.islands = {}
        for name, island in plain.population.islands.items():
            typed.population.islands[name] = OmegaConf.structured(IslandConfig)
            typed.population.islands[name].learner = OmegaConf.structured(SCHEMAS["learner"][island.learner.name])
        config = cast("DictConfig", OmegaConf.merge(typed, plain))
        OmegaConf.to_object(config.env)
    except (OmegaConfBaseException, AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        said = first_line(error)
        raise InputError(f"{folder / CONFIG} is no config of a training run of this version: {said}.") from error
    return config


def whole_choice(group: str, name: str) -> DictConfig:
    """Returns the config that choice ``name`` of a group without choices of its own stands for.

    Raises:
        InputError: there is no such choice.
    """
    if name not in SCHEMAS[group]:
        raise InputError.choice(group, name, SCHEMAS[group])
    text = files("berteam_cli.conf").joinpath(group, f"{name}.yaml").read_text(encoding="utf-8")
    values = {key: value for key, value in yaml.safe_load(text).items() if key != "defaults"}
    return cast("DictConfig", OmegaConf.merge(OmegaConf.structured(SCHEMAS[group][name]), values))


def goes_on(config: TrainConfig, folder: Path | None) -> bool:
    """Returns whether ``config`` goes on with a run in ``folder``, None for one that is not known yet."""
    return config.on_exists == "resume" and folder is not None and os.path.exists(folder / CONFIG)


def checkpointed(config: TrainConfig, folder: Path | None) -> Path | None:
    """Returns ``folder`` if ``config`` goes on from a checkpoint there; what ended before its first begins again."""
    return folder if folder is not None and goes_on(config, folder) and newest(folder) >= 0 else None


def as_begun(config: DictConfig) -> DictConfig:
    """Returns the composed config of a training as it may go on: what is a share of its epochs stays as it began.

    Raises:
        InputError: it goes on with a run whose config cannot be read.
    """
    folder: Any = Path(config.out) if config.out else None
    given: Any = config  # its keys are those of a TrainConfig
    replacing = "protect_new" in config.optimizer and OmegaConf.is_interpolation(config.optimizer, "protect_new")
    if not goes_on(given, folder) or not replacing:
        return config
    begun = OmegaConf.select(plain_config(folder), "optimizer.protect_new")
    if not isinstance(begun, int):
        return config
    config = config.copy()
    config.optimizer.protect_new = begun
    return config


def check_same(folder: Path, text: str) -> None:
    """Checks that the config ``text`` can go on with the run in ``folder``.

    Raises:
        InputError: a key that may not change has another value.
    """
    old, new = flat(OmegaConf.to_container(plain_config(folder))), flat(OmegaConf.to_container(OmegaConf.create(text)))
    fixed = REFERENCE if old.get("evaluate_every") else None
    for key in sorted(old.keys() | new.keys()):
        free = key.split(".", maxsplit=1)[0] in MAY_CHANGE + PLACE and key != fixed
        if not free and old.get(key) != new.get(key):
            raise InputError(
                f"{key} is {new.get(key)!r}, but the run in {folder} was begun with {old.get(key)!r}; "
                f"it can only go on with the same."
            )


@contextmanager
def begun(folder: Path, on_exists: str, text: str, what: str, facts: dict[str, Any]) -> Iterator[Manifest]:
    """Gives the manifest of a command's work that begins, or goes on, in ``folder``, which it holds.

    Args:
        folder: where its tables go.
        on_exists: error, overwrite or resume.
        text: its config as yaml.
        what: it is called.
        facts: for the manifest.

    Raises:
        InputError: the folder is not free, or holds work of another config, or such as is done.
    """
    with held(folder):
        if on_exists == "resume" and os.path.exists(folder / MANIFEST):
            check_same(folder, text)
            if Manifest.of(folder).facts["status"] == "done":
                raise InputError(f"out={folder} holds this {what} already, and it is done.")
            yield Manifest.resumed(folder, **facts)
        else:
            claim(folder, on_exists)
            write_config(folder, text)
            yield Manifest.begun(folder, **facts)


def flat(config: Any, prefix: str = "") -> dict[str, Any]:
    """Returns the values of nested dictionaries by dotted key; lists are values."""
    values: dict[str, Any] = {}
    for key, value in config.items():
        path = f"{prefix}{key}"
        values |= flat(value, f"{path}.") if isinstance(value, dict) else {path: value}
    return values
