"""berteam export: a member of a trained run as a file of Stable-Baselines3."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from gymnasium.spaces import Box

from berteam_cli.env.base import Env
from berteam_cli.env.mctf import Mctf
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.errors import InputError, did_you_mean
from berteam_cli.folder import write_whole
from berteam_cli.learner.exporting import exported
from berteam_cli.learner.traits import Tunable, tuned
from berteam_cli.population import island_of, names
from berteam_cli.quiet import written
from berteam_cli.reading import last_state
from berteam_cli.terminal import end, say
from berteam_cli.trust import TRUST, told

KEYS = ("agent", "out", "on_exists", TRUST)
ON_EXISTS = ("error", "overwrite")


def export(folder: Path, overrides: list[str]) -> Path:
    """Writes a member of the run in ``folder`` as a zip file that Stable-Baselines3 loads; returns its path.

    Args:
        folder: of a training run.
        overrides: ``key=value`` of KEYS.

    Raises:
        InputError: there is no such run or member, it has no networks, or a file is in the way.
    """
    trust, overrides = told(overrides)
    given = read_overrides(overrides)
    parts, run = last_state(folder, trust=trust)
    islands = parts.optimizer.islands
    agent = member(given["agent"], run.population.size)
    path = place(folder, agent, given)
    home = int(island_of(islands)[agent])
    island, called = islands[home], names(islands, run.population)[agent]
    space, row, learner = observation_space(parts.games.env), agent - island.first, island.learner
    if isinstance(learner, Tunable):
        learner = tuned(learner, run.population.traits[island.members], row)
    try:
        model = exported(learner, run.population.minds[home], row, space)
    except ValueError as error:
        raise InputError(f"agent={agent} ({called}) cannot be exported: {error}.") from error
    steps = parts.games.env.last_steps if isinstance(parts.games.env, Mctf) else 1
    if steps > 1:
        model.last_steps = steps  # type: ignore[attr-defined]  # it is saved with the rest, for whoever feeds it
    write_whole(path, model.save)
    say(f"{called} of {folder} after epoch {run.epoch}.")
    if steps > 1:
        say(f"It sees the observations of the last {steps} steps in one, the newest first (last_steps in the file).")
    if isinstance(parts.games.env, Pettingzoo):
        say("It sees observations as one row of numbers (a Discrete one one-hot), and calls the first action 0.")
    written(path)
    end(path.parent, [path.name], f"in Python: {loading(type(model), path)}")
    return path


def read_overrides(overrides: list[str]) -> dict[str, str]:
    """Returns the values by key.

    Raises:
        InputError: one is not of the form key=value, has no such key or a wrong value, or no agent is named.
    """
    given = {"out": "", "on_exists": "error"}
    for override in overrides:
        key, equals, value = override.partition("=")
        if not equals:
            raise InputError(f"{override!r} cannot be read as key=value.")
        if key not in KEYS:
            raise InputError(
                f"{key} is no key of berteam export; there are {', '.join(KEYS)}.{did_you_mean(key, KEYS)}"
            )
        given[key] = value
    if given["on_exists"] not in ON_EXISTS:
        raise InputError.choice("on_exists", given["on_exists"], ON_EXISTS)
    if "agent" not in given:
        raise InputError("agent must say which member is exported, such as agent=3.")
    return given


def member(given: str, members: int) -> int:
    """Returns the member that ``given`` names.

    Raises:
        InputError: there is none.
    """
    if not (given.isdecimal() and given.isascii() and int(given) < members):
        raise InputError(f"agent must be one of 0 to {members - 1}, but is {given!r}.")
    return int(given)


def place(folder: Path, agent: int, given: dict[str, str]) -> Path:
    """Returns the file to write.

    Raises:
        InputError: it exists and may not be overwritten.
    """
    name, out = f"agent_{agent}.zip", given["out"]
    if not out:
        path = folder / name
    elif out.endswith("/") or (Path(out).is_dir() and not out.endswith(".zip")):
        path = Path(out) / name
    else:
        path = Path(out if out.endswith(".zip") else f"{out}.zip")
    if path.is_dir() or (path.exists() and given["on_exists"] != "overwrite"):
        raise InputError(f"{path} exists already; name another file with out=FILE, or say on_exists=overwrite.")
    return path


def observation_space(game: Env) -> Box:
    """Returns the space of what players of ``game`` see, as far as it is known: that of package mctf's, else no bounds.

    Numbers that the rules cut to [-1, 1] are said to be in it; by the rules of 2024 some of them leave it.
    """
    bound = 1.0 if isinstance(game, Mctf) and game.rules.obs_clipped else np.inf
    return Box(-bound, bound, (game.observation_size,), np.float32)


def loading(kind: type, path: Path) -> str:
    """Returns a line of Python that loads the model in ``path``; a DQN explores unless it is told not to."""
    package, name = kind.__module__.partition(".")[0], kind.__name__
    sure = ", deterministic=True" if name.endswith("DQN") else ""
    return f"from {package} import {name}; model = {name}.load({str(path)!r}); model.predict(observation{sure})"
