"""From a command line, or a file, to the jobs of a sweep. Knows Hydra's grammar."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import yaml
from hydra import compose, initialize_config_module
from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.types import Override
from omegaconf import OmegaConf

from berteam_cli.compose import CONF
from berteam_cli.errors import InputError, did_you_mean
from berteam_cli.overrides import arguments, parsed
from berteam_cli.sweep.folder import Sweep

OURS = "hydra_plugins.berteam.sweeper.BerteamSweeper"
NEEDS = {
    "joblib": ("hydra_plugins.hydra_joblib_launcher", "sweep"),
    "submitit_local": ("hydra_plugins.hydra_submitit_launcher", "slurm"),
    "submitit_slurm": ("hydra_plugins.hydra_submitit_launcher", "slurm"),
    "ray": ("ray", "ray"),
}
"""The module and the extra that each launcher needs."""
KEYS = {
    "sweep": ("command", "overrides", "sweep", "list"),
    "optuna": ("overrides", "search", "trials", "at_once", "seed"),
}
"""What the file of a command may hold."""
SWEPT = ("train", "tournament")


def check_launcher(words: Iterable[str]) -> None:
    """Checks that what the chosen launcher needs is installed.

    Raises:
        InputError: it is not.
    """
    for word in words:
        key, _, name = word.partition("=")
        if key != "hydra/launcher" or name not in NEEDS:
            continue
        module, extra = NEEDS[name]
        if not installed(module):
            package = module.rpartition(".")[2].replace("_", "-")
            raise InputError(
                f"{word} needs the package {package}, which is not installed: pip install 'berteam-cli[{extra}]'."
            )


def installed(module: str) -> bool:
    """Returns whether there is a ``module``, which may lie in a package that is not there."""
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def planned(command: str, words: list[str]) -> tuple[list[str], Path, bool]:
    """Returns the words of a multirun with its folder named, the folder, and whether our own sweeper runs it.

    Raises:
        InputError: the jobs' folders cannot be told apart.
    """
    given = arguments(words)
    with initialize_config_module(CONF, version_base="1.3", job_name=command):
        named = [x for x in parsed(given.overrides) if x.is_hydra_override()]
        for override in named:
            if override.is_sweep_override():
                raise InputError(f"{override.input_line} is a sweep over a setting of Hydra; sweep over the command's.")
            if override.key_or_group == "hydra.sweep.subdir":
                raise InputError("hydra.sweep.subdir cannot be changed: the jobs of a sweep lie in 0, 1, 2, ...")
        lines = [x.input_line or "" for x in named]
        if given.config_dir:
            lines.append(f"hydra.searchpath=['file://{Path(given.config_dir).absolute()}']")
        config = compose(given.config_name or command, lines, return_hydra_config=True)
        HydraConfig.instance().set_config(config)
        folder = Path(str(config.hydra.sweep.dir))
        ours = OmegaConf.select(config, "hydra.sweeper._target_") == OURS
    return [*flags(words), *given.overrides, f"hydra.sweep.dir={spelt(str(folder))}"], folder, ours


def of_hydra(word: str) -> bool:
    """Returns whether an override is one of Hydra's own settings."""
    return re.match(r"[+~]*hydra([./=@]|$)", word) is not None


def flags(words: list[str]) -> list[str]:
    """Returns the flags among the words of a multirun, which must stand before the overrides."""
    given = arguments(words)
    named = {"--config-dir": given.config_dir, "--config-name": given.config_name}
    return ["-m", *(text for flag, value in named.items() if value for text in (flag, value))]


def grid(overrides: list[Override]) -> list[list[str]]:
    """Returns the jobs of all combinations of the values that ``overrides`` sweep over.

    Raises:
        InputError: one sweeps over what has no end, such as an interval.
    """
    for override in overrides:
        if override.is_sweep_override() and not override.is_discrete_sweep():
            raise InputError(f"{override.input_line} has no list of values; berteam optuna searches through ranges.")
    return BasicSweeper.split_arguments([x for x in overrides if not x.is_hydra_override()], None)[0]


def jobs_of(command: str, words: list[str], variants: list[list[str]]) -> dict[int, list[str]]:
    """Returns the jobs of a sweep: each of ``variants``, extra words, with every combination that ``words`` ask for.

    Raises:
        InputError: a word cannot be read.
    """
    with initialize_config_module(CONF, version_base="1.3", job_name=command):
        given = arguments(words).overrides
        jobs = [grid(parsed([*given, *variant])) for variant in variants]
    return dict(enumerate(itertools.chain(*jobs)))


def read_plan(word: str, path: Path) -> dict[str, Any]:
    """Returns what the file of `berteam sweep` or `berteam optuna` holds.

    Raises:
        InputError: it cannot be read, or holds something else.
    """
    try:
        held = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise InputError(f"{path} cannot be read: {' '.join(str(error).split())}.") from error
    allowed = KEYS[word]
    if not isinstance(held, dict):
        raise InputError(f"{path} must hold the keys {', '.join(allowed)}, but holds none.")
    for key in held:
        if key not in allowed:
            near = did_you_mean(str(key), allowed)
            raise InputError(f"{path}: {key} is no key of this file; there are {', '.join(allowed)}.{near}")
    held = {"command": "train", "overrides": []} | held
    if held["command"] not in SWEPT:
        raise InputError.choice(f"{path}: command", str(held["command"]), SWEPT)
    check_words(path, "overrides", held["overrides"])
    return held


def check_words(path: Path, key: str, words: object) -> None:
    """Checks that ``words``, which a file has under ``key``, are a list of overrides.

    Raises:
        InputError: they are not.
    """
    if not isinstance(words, list) or not all(isinstance(x, str) and "=" in x for x in words):
        raise InputError(f"{path}: {key} must be a list of KEY=VALUE, but is {words!r}.")


def sweep_words(path: Path, plan: Mapping[str, Any]) -> tuple[list[str], list[list[str]]]:
    """Returns the words of a sweep's file that all jobs share, sweeps among them, and those of each variant.

    Raises:
        InputError: the file's sweep or list has no such form.
    """
    swept, listed = plan.get("sweep", {}), plan.get("list", [[]])
    if not isinstance(swept, dict) or not all(isinstance(x, list) and x for x in swept.values()):
        raise InputError(f"{path}: sweep must give each key a list of values, but is {swept!r}.")
    if not isinstance(listed, list) or not listed:
        raise InputError(f"{path}: list must be a list of jobs, each a list of KEY=VALUE, but is {listed!r}.")
    for variant in listed:
        check_words(path, "list", variant)
    words = [f"{key}={','.join(spelt(value) for value in values)}" for key, values in swept.items()]
    return [*plan["overrides"], *words], listed


def spelt(value: Any) -> str:
    """Returns ``value`` of a yaml file as it is written in a word of the command line."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ",".join(f"{key}:{spelt(x)}" for key, x in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ",".join(spelt(x) for x in value) + "]"
    text = str(value)
    if re.fullmatch(r"[\w.+\-/]+", text):
        return text
    quoted = re.sub(r"(\\*)'", r"\1\1\\'", text)  # in Hydra's grammar backslashes count before quotes only
    return "'" + re.sub(r"(\\+)$", r"\1\1", quoted) + "'"


def begin(command: str, folder: Path, jobs: dict[int, list[str]], search: dict[str, Any] | None = None) -> None:
    """Writes down a new sweep, before any of its jobs begins.

    Raises:
        InputError: the folder cannot be written.
    """
    Sweep(folder, command, jobs, search or {}).keep()
