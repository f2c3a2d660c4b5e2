"""Makes a PettingZoo environment and finds out what it is like: its teams, observations and actions."""

from __future__ import annotations

import importlib
import os
import traceback
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box, Discrete
from pettingzoo import AECEnv, ParallelEnv

from berteam_cli.errors import did_you_mean

SIDES = ("blue", "red")
MOST_ACTIONS = 32_767  # as 16 bits hold


class Game(NamedTuple):
    """Settings: those of conf/env/pettingzoo.yaml, and the folder whose modules can be imported."""

    target: str
    options: dict[str, Any]
    teams: dict[str, list[str]]
    max_steps: int
    score: str
    folder: str


class Facts(NamedTuple):
    """What an environment is like.

    Attributes:
        agents: (V,) names, blue's first.
        observation_size: O.
        actions: A.
    """

    agents: tuple[str, ...]
    observation_size: int
    actions: int


class Unfit(Exception):
    """The environment cannot be played; the message says why, beginning with the setting to blame if there is one."""


def said(error: Exception) -> str:
    """Returns what an error says, and where it comes from if it is of foreign code."""
    text = " ".join(str(error).split())
    if isinstance(error, Unfit):
        return text
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if foreign(frame.filename)]
    where = f" ({os.path.basename(frames[-1].filename)}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {text}{where}"


def foreign(file: str) -> bool:
    """Returns whether a file is neither of this folder nor a part of Python that has none."""
    return os.path.dirname(file) != os.path.dirname(__file__) and not file.startswith("<")


def made(game: Game) -> ParallelEnv[str, Any, Any]:
    """Returns the environment.

    Raises:
        Unfit: it cannot be made, or is no ParallelEnv.
    """
    name, _, function = game.target.partition(":")
    try:
        module = importlib.import_module(name)
    except Exception as error:
        raise Unfit(
            f"target={game.target}: module {name} cannot be imported, {game.folder} included: {said(error)}."
        ) from error
    make = getattr(module, function, None)
    if not callable(make):
        near = did_you_mean(function, [x for x in vars(module) if callable(getattr(module, x))])
        raise Unfit(f"target={game.target}: module {name} has no function {function!r}.{near}")
    try:
        env = make(**game.options)
    except Exception as error:
        raise Unfit(f"target={game.target} fails with env.options={game.options}: {said(error)}.") from error
    if not isinstance(env, ParallelEnv):
        hint = " pettingzoo.utils.aec_to_parallel makes one of it." if isinstance(env, AECEnv) else ""
        raise Unfit(f"target must return a ParallelEnv, but {game.target} returns {type(env).__name__}.{hint}")
    return env


def facts_of(env: ParallelEnv[str, Any, Any], teams: dict[str, list[str]]) -> Facts:
    """Returns what the environment is like.

    Raises:
        Unfit: there are not two teams of equal agents in it.
    """
    agents = places(list(getattr(env, "possible_agents", [])), teams)
    sizes: dict[int, str] = {}
    actions: dict[int, str] = {}
    for agent in agents:
        seeing, acting = env.observation_space(agent), env.action_space(agent)
        if not isinstance(seeing, Box | Discrete):
            raise Unfit(
                f"target: agent {agent} has the observation space {seeing}; only Box and Discrete are supported."
            )
        if not isinstance(acting, Discrete):
            raise Unfit(f"target: agent {agent} has the action space {acting}; only Discrete is supported.")
        if acting.n > MOST_ACTIONS:
            raise Unfit(f"target: agent {agent} has {acting.n} actions; at most {MOST_ACTIONS} are supported.")
        sizes.setdefault(int(seeing.n) if isinstance(seeing, Discrete) else int(np.prod(seeing.shape)), agent)
        actions.setdefault(int(acting.n), agent)
    for what, counts in (("observations of {} numbers", sizes), ("{} actions", actions)):
        if len(counts) > 1:
            one, other = (f"{agent} has {what.format(count)}" for count, agent in list(counts.items())[:2])
            raise Unfit(f"target: all agents must be of one kind, but agent {one} and agent {other}.")
    return Facts(agents, next(iter(sizes)), next(iter(actions)))


def places(possible: list[str], teams: dict[str, list[str]]) -> tuple[str, ...]:
    """Returns (V,) who plays in which place: the agents of blue, then those of red.

    Args:
        possible: all agents of the environment.
        teams: the agents of blue and red; empty: the first half of ``possible`` and the second.

    Raises:
        Unfit: not every agent is in one of two teams of equal size.
    """
    half = len(possible) // 2
    teams = teams or dict(zip(SIDES, (possible[:half], possible[half:]), strict=True))
    if set(teams) != set(SIDES) or not all(isinstance(names, list) and names for names in teams.values()):
        raise Unfit(f"teams must be {{blue: [AGENT, ...], red: [AGENT, ...]}}, but is {teams}.")
    agents = [*teams["blue"], *teams["red"]]
    for agent in agents:
        if agent not in possible:
            near = did_you_mean(str(agent), map(str, possible))
            raise Unfit(f"teams has {agent!r}, but the agents are {', '.join(map(str, possible))}.{near}")
    for agent in possible:
        if agents.count(agent) != 1:
            raise Unfit(f"teams must hold every agent once, but holds {agent} {agents.count(agent)} times.")
    if len(teams["blue"]) != len(teams["red"]):
        sizes = " and ".join(f"{side} has {len(teams[side])}" for side in SIDES)
        raise Unfit(f"teams must be of equal size, but {sizes}.")
    return tuple(agents)
