"""Which code a run may bring with it: none that the user did not name.

A config may say what to import: a game (``env.target``) or a reward (``env.reward=module:function``). On a command
line, and in a yaml file that it names, these are the user's own words. In the folder of a run they are the words of
whoever it came from: they are imported only if the command that reads the folder names them again, as
``trust=module:function``.
docs/security.md has the whole rule.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from berteam_cli.config_env import EnvConfig, MctfConfig, PettingzooConfig
from berteam_cli.errors import InputError

TRUST = "trust"
LIST = re.compile(r"\[.*\]")  # of several, as Hydra writes it


def imported(env: EnvConfig) -> dict[str, str]:
    """Returns what the game of a config imports: the import path by the key that says so."""
    if isinstance(env, PettingzooConfig) and env.target is not None:
        return {"env.target": env.target}
    if isinstance(env, MctfConfig) and ":" in env.reward:
        return {"env.reward": env.reward}
    return {}


def check_trusted(folder: Path, env: EnvConfig, trust: Collection[str]) -> None:
    """Checks that what the game of the run in ``folder`` imports is among ``trust``.

    Raises:
        InputError: it is not; with the word to add.
    """
    for key, path in imported(env).items():
        if path not in trust:
            raise InputError(
                f"{folder} is a run with {key}={path}, and what a run's folder names is imported only if you name it, "
                f"too; if you know that code, add {TRUST}={path} to the command."
            )


def trusted(given: Any) -> tuple[str, ...]:
    """Returns the import paths in a value of the key ``trust``.

    Raises:
        InputError: it is neither one nor a list of them.
    """
    paths = [] if given is None else [given] if isinstance(given, str) else given
    if not isinstance(paths, Sequence) or not all(isinstance(path, str) and ":" in path for path in paths):
        raise InputError(f"{TRUST} must be module:function, or a list of such, but is {given!r}.")
    return tuple(paths)


def told(overrides: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """Returns the import paths that ``trust=`` names among the words of a command, and the other words.

    Raises:
        InputError: one is no import path.
    """
    mine = [word for word in overrides if word.startswith(f"{TRUST}=")]
    values = [word.partition("=")[2] for word in mine]
    paths = [
        path.strip() for value in values for path in (value[1:-1].split(",") if LIST.fullmatch(value) else [value])
    ]
    return trusted(paths), [word for word in overrides if word not in mine]
