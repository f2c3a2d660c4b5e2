"""Composes the configuration before Hydra does, so that wrong input is refused in one sentence and leaves no trace."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_module
from hydra.core.global_hydra import GlobalHydra
from hydra.core.object_type import ObjectType
from hydra.core.override_parser.types import ChoiceSweep, Override
from hydra.core.plugins import Plugins
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from berteam_cli.catalogue import groups
from berteam_cli.config import checked, one_line, register
from berteam_cli.errors import InputError, did_you_mean
from berteam_cli.overrides import arguments, jobs, parsed
from hydra_plugins.berteam.ray_launcher import RayLauncher
from hydra_plugins.berteam.sweeper import BerteamSweeper

CONF = "berteam_cli.conf"
REFUSALS = (HydraException, OmegaConfBaseException, OSError, OverflowError, ValueError, RecursionError)
"""What composing raises: the first two say what is wrong, the others come of numbers and names that are too long."""


def prepare() -> None:
    """Registers the schemas, the one resolver that the yaml files use, and our plugins of Hydra.

    Hydra finds plugins by walking over folders, which misses those of an editable installation.
    """
    register()
    for plugin in (BerteamSweeper, RayLauncher):
        Plugins.instance().register(plugin)
    OmegaConf.register_new_resolver("eighth_of", lambda epochs: int(epochs) // 8, replace=True)


def check(command: str, words: list[str], verify: Callable[[Any, list[str]], object]) -> DictConfig:
    """Composes what the command line asks for and checks it, every value of a sweep once; returns it, of the last job.

    Args:
        command: name of the primary config.
        words: the command line after the sub-command.
        verify: raises InputError where parts of a checked config do not go together; is told the overridden keys too.

    Raises:
        InputError: a choice, a key or a value is wrong.
    """
    given = arguments(words)
    searched = [f"hydra.searchpath=['file://{Path(given.config_dir).absolute()}']"] if given.config_dir else []
    if given.config_dir and not Path(given.config_dir).is_dir():
        raise InputError(f"--config-dir must be a folder, but {given.config_dir} is none.")
    with initialize_config_module(CONF, version_base="1.3", job_name=command):
        overrides = parsed(given.overrides)
        if given.multirun and any(x.key_or_group == "out" for x in overrides):
            raise InputError("out is one folder for all runs of a sweep; use hydra.sweep.dir=DIR instead.")
        if given.multirun:
            check_sweep_folder(overrides)
        for override in overrides:
            if override.is_sweep_override() and not given.multirun:
                raise InputError(f"{override.input_line} is a sweep over several values; add --multirun (-m) for one.")
            check_choice(override, searched)
        for job in jobs(overrides, sweep=given.multirun):
            config = composed(given.config_name or command, searched, job)
            check_learner(config, job)
            verify(checked(config), [x.key_or_group for x in job])
    return config


def config_of(command: str, words: list[str]) -> tuple[Any, str]:
    """Returns the checked config that the command line ``words`` give, and the same as yaml.

    Args:
        command: name of the primary config.
        words: overrides, none of them a sweep.

    Raises:
        InputError: a choice, a key or a value is wrong.
    """
    outer = GlobalHydra.instance().hydra  # of the command that asks for another
    GlobalHydra.instance().clear()
    try:
        with initialize_config_module(CONF, version_base="1.3", job_name=command):
            config = composed(command, [], parsed(words))
            return checked(config), OmegaConf.to_yaml(config, resolve=True)
    finally:
        GlobalHydra.instance().hydra = outer


def check_sweep_folder(overrides: list[Override]) -> None:
    """Checks that the folder named for a sweep holds none yet: its runs would be taken for this one's.

    Raises:
        InputError: it does.
    """
    from berteam_cli.folder import MANIFEST  # noqa: PLC0415 (it brings torch, which --help does not need)
    from berteam_cli.sweep.folder import JOBS  # noqa: PLC0415 (as above)
    from berteam_cli.terminal import berteam  # noqa: PLC0415 (as above)

    for override in overrides:
        if override.key_or_group == "hydra.sweep.dir":
            folder = Path(str(override.value()))
            if (folder / JOBS).exists() or (folder.is_dir() and any((x / MANIFEST).exists() for x in folder.iterdir())):
                raise InputError(
                    f"hydra.sweep.dir={folder} holds a sweep already; choose another folder, "
                    f"or go on with it: {berteam('sweep --resume', [folder])}"
                )


def check_learner(config: DictConfig, overrides: list[Override]) -> None:
    """Checks that what is said of ``learner`` has an effect: a population may bring learners of its own.

    Raises:
        InputError: it has none.
    """
    said = [
        x.key_or_group for x in overrides if x.key_or_group.split(".")[0] == "learner" and "@" not in str(x.input_line)
    ]
    islands = config.get("population", {}).get("islands", {})
    if said and not any(OmegaConf.is_interpolation(island, "learner") for island in islands.values()):
        if not islands:
            raise InputError(f"{said[0]} has no effect with this population, which has no islands that learn.")
        name = next(iter(islands))
        raise InputError(
            f"{said[0]} has no effect with this population, whose islands bring learners of their own; "
            f"say population.islands.{name}.learner.KEY=VALUE instead, or choose a population such as ppo50."
        )


def composed(command: str, searched: list[str], overrides: list[Override]) -> DictConfig:
    """Returns the config that ``overrides`` give.

    Raises:
        InputError: with what is wrong, and the nearest right key.
    """
    lines = [x.input_line for x in overrides if x.input_line is not None]
    try:
        return compose(command, overrides=[*searched, *lines])
    except REFUSALS as error:
        check_keys(command, searched, overrides)
        raise InputError(said(error)) from error


def said(error: Exception) -> str:
    """Returns in one line what Hydra or OmegaConf object to: the innermost cause says it best."""
    while isinstance(error.__cause__, HydraException | OmegaConfBaseException):
        error = error.__cause__
    if isinstance(error, HydraException) and isinstance(error.__context__, OmegaConfBaseException):
        error = error.__context__
    if isinstance(error, OmegaConfBaseException):
        return one_line(error)
    first, *more = str(error).splitlines() or [type(error).__name__]
    key = next((line.partition("full_key: ")[2] for line in more if "full_key: " in line), "")
    return f"{key}: {first.rstrip('.')}." if key else f"{first.rstrip('.')}."


def check_choice(override: Override, searched: list[str]) -> None:
    """Checks an override of a config group against the choices there are, those of ``searched`` folders included.

    Raises:
        InputError: with the nearest choice.
    """
    group = override.key_or_group
    allowed = choices(group, searched)
    if not allowed:
        return
    value = override.value()
    given = value.list if isinstance(value, ChoiceSweep) else [value]
    for item in given:
        text = "null" if item is None else str(getattr(item, "text", item))
        if text not in allowed:
            raise InputError.choice(group, text, allowed)


def choices(group: str, searched: list[str] | None = None) -> list[str]:
    """Returns the choices of a config group, none if there is no such group.

    Args:
        group: such as "selector".
        searched: overrides that add folders to search.
    """
    first = re.split("[/@]", group, maxsplit=1)[0]
    # Asking Hydra for the choices of a group takes a twentieth of a second, which most keys need not cost.
    if first == "schema" or not (searched or first in {*groups(), "hydra"}):
        return []
    loader: Any = GlobalHydra.instance().config_loader()
    try:
        if not searched:  # then Hydra need not copy all that it has registered to add to it
            return sorted(loader.repository.get_group_options(group, ObjectType.CONFIG))
        return sorted(loader.get_group_options(group, config_name="train", overrides=searched))
    except OSError:  # no file can have that name
        return []


def check_keys(command: str, searched: list[str], overrides: list[Override]) -> None:
    """Checks that every overridden key is there.

    Raises:
        InputError: one is not; with the nearest that is.
    """
    chosen = [x for x in overrides if choices(x.key_or_group, searched)]
    try:
        config = compose(command, overrides=[*searched, *(x.input_line or "" for x in chosen)])
    except REFUSALS:
        return  # the choices themselves do not go together, and that error says more
    known = keys(config)
    for override in overrides:
        key = override.key_or_group
        if override in chosen or key.startswith("hydra"):
            continue
        if key not in known:
            near = did_you_mean(key, [*known, *groups()])
            raise InputError(f"{key} is no key of this configuration.{near} See --cfg job for all of them.")


def keys(config: DictConfig, prefix: str = "") -> list[str]:
    """Returns all dotted keys of a config."""
    found: list[str] = []
    for key in map(str, config):
        path = f"{prefix}{key}"
        found.append(path)
        node = None if OmegaConf.is_missing(config, key) else config._get_node(key)
        if isinstance(node, DictConfig) and not node._is_none():
            target = config[key] if OmegaConf.is_interpolation(config, key) else node
            found += keys(target, f"{path}.")
    return found
