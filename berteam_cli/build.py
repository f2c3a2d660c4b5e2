"""From a checked config to objects; the only place that knows which name is which class."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import torch

from berteam_cli.config import CommandConfig, EnvConfig, IslandConfig, LearnerConfig, OptimizerConfig, TrainConfig
from berteam_cli.env.base import Env
from berteam_cli.env.mctf import Mctf
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.env.rps import Rps
from berteam_cli.errors import InputError
from berteam_cli.games import Games
from berteam_cli.learner.base import Learner
from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.fixed import Fixed as FixedLearner
from berteam_cli.learner.ppo import Ppo
from berteam_cli.optimizer.aggression import opponents
from berteam_cli.optimizer.base import Optimizer
from berteam_cli.optimizer.coevolution import Coevolution
from berteam_cli.optimizer.fitness import CaptainElo, FitnessRule, MovingAverage
from berteam_cli.optimizer.fixed import Fixed
from berteam_cli.optimizer.mapelites import MapElites
from berteam_cli.population import Island, island_of
from berteam_cli.selector.base import Field, Selector
from berteam_cli.selector.berteam import Berteam
from berteam_cli.selector.mcaa import Mcaa
from berteam_cli.selector.uniform import Uniform
from berteam_cli.training import Parts
from berteam_cli.workers import Workers, available_cores

ENVS: dict[str, Callable[..., Env]] = {"mctf": Mctf, "rps": Rps, "pettingzoo": Pettingzoo}
SELECTORS: dict[str, Callable[..., Selector[Any]]] = {"uniform": Uniform, "mcaa": Mcaa, "berteam": Berteam}
NO_NAMES = {"na", "nan", "null", "none", "n-a", "other"}  # pandas reads most of these as nothing


def sb3(**settings: Any) -> Learner[Any]:
    """Returns a learner of Stable-Baselines3, which is loaded only for it, as that takes seconds."""
    from berteam_cli.learner.sb3 import Sb3  # noqa: PLC0415

    return Sb3(**settings)


LEARNERS: dict[str, Callable[..., Learner[Any]]] = {"ppo": Ppo, "dqn": Dqn, "sb3": sb3}


def games(config: CommandConfig) -> Games:
    """Returns the game that ``config`` describes, with its threads."""
    return Games(env(config.env, config.team_size), Workers(config.workers or available_cores()))


def env(config: EnvConfig, team_size: int) -> Env:
    """Returns the game.

    Raises:
        InputError: its settings do not go together.
    """
    settings = asdict(config)
    if os.getcwd() not in sys.path:  # where a user's own reward may be; last, so that it hides nothing
        sys.path.append(os.getcwd())
    try:
        return ENVS[settings.pop("name")](team_size=team_size, **settings)
    except ValueError as error:
        raise InputError(f"env.{error}") from error


def parts(config: TrainConfig) -> Parts:
    """Returns everything a run is made of.

    Raises:
        InputError: parts of the config do not go together.
    """
    playing = games(config)
    device = chosen_device(config.device)
    islands = archipelago(config, playing.env)
    members = sum(island.size for island in islands)
    if config.team_size > members:
        raise InputError(
            f"team_size must be at most {members}, the members of the population, but is {config.team_size}."
        )
    field = Field(island_of(islands), config.team_size)
    return Parts(
        seed=config.seed,
        games_per_epoch=config.games_per_epoch,
        games=playing,
        selector=selector(config, field, device),
        optimizer=optimizer(config, islands, playing),
    )


def chosen_device(name: str) -> str:
    """Returns "cpu" or "cuda".

    Raises:
        InputError: cuda is asked for and not there.
    """
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise InputError("device=cuda needs a CUDA device and a build of torch that supports it; use device=cpu.")
    return "cuda" if there and name != "cpu" else "cpu"


def archipelago(config: TrainConfig, game: Env) -> tuple[Island, ...]:
    """Returns the islands of the population, one after the other.

    Raises:
        InputError: there is none, or its learner does not fit.
    """
    islands: list[Island] = []
    for name, settings in config.population.islands.items():
        key = f"population.islands.{name}"
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", name) or name.lower() in NO_NAMES:
            raise InputError(f"{key}: an island's name must be a word that tables can hold, but is {name!r}.")
        first = islands[-1].first + islands[-1].size if islands else 0
        if settings.learner.name == "fixed":
            made = fixed_members(settings, game, key)
        else:
            made = learner(settings.learner, game, key)
        islands.append(Island(name, first, settings.size, made))
    if not islands:
        raise InputError("population.islands must have at least one island, but has none.")
    return tuple(islands)


def fixed_members(settings: IslandConfig, game: Env, key: str) -> Learner[Any]:
    """Returns the learner of an island of fixed policies.

    Raises:
        InputError: a policy is not the game's, or they are not as many as the island has members.
    """
    names = list(settings.learner.policies)  # type: ignore[attr-defined]
    check_policies(names, game, f"{key}.learner.policies")
    if len(names) != settings.size:
        raise InputError(
            f"{key}.size must be {len(names)}, as {key}.learner.policies names so many, but is {settings.size}."
        )
    return FixedLearner(tuple(game.fixed_policies.index(x) for x in names), game.fixed_policies)


def check_policies(names: list[str], game: Env, key: str) -> None:
    """Checks that ``names`` are fixed policies of the game.

    Raises:
        InputError: one is not.
    """
    for name in names:
        if name not in game.fixed_policies:
            raise InputError.choice(f"{key} (with env={game.name})", name, game.fixed_policies)


def learner(config: LearnerConfig, game: Env, key: str) -> Learner[Any]:
    """Returns a learner of networks.

    Raises:
        InputError: its network is not one, or another setting is not allowed.
    """
    settings = asdict(config)
    name = settings.pop("name")
    network = settings.pop("network")
    if not 1 <= len(network) <= 6 or not all(1 <= width <= 4096 for width in network):
        raise InputError(f"{key}.learner.network must be 1 to 6 widths from 1 to 4096, but is {network}.")
    try:
        return LEARNERS[name](
            observation_size=game.observation_size,
            actions=game.actions,
            network=tuple(network),
            **settings,
        )
    except ValueError as error:
        raise InputError(f"{key}.learner.{error}") from error


def selector(config: TrainConfig, field: Field, device: str) -> Selector[Any]:
    """Returns the selector.

    Raises:
        InputError: its settings do not go together.
    """
    settings = asdict(config.selector)
    settings.pop("fitness")
    name = settings.pop("name")
    if name == "berteam":
        settings["device"] = device
    try:
        return SELECTORS[name](field=field, **settings)
    except ValueError as error:
        raise InputError(str(error)) from error


def fitness_rule(config: OptimizerConfig, selecting: str) -> FitnessRule:
    """Returns how games become fitness.

    Raises:
        InputError: captains are to be rated, but the selector ``selecting`` names none.
    """
    if config.fitness == "moving_average":
        return MovingAverage(config.average_rate)
    if selecting == "mcaa" and not config.member_k > 0:
        raise InputError(
            "optimizer.fitness=elo rates captains, and selector=mcaa has none: "
            "use optimizer.fitness=moving_average, or rate all members with optimizer.member_k=1."
        )
    return CaptainElo(config.captain_k, config.member_k)


def optimizer(config: TrainConfig, islands: tuple[Island, ...], playing: Games) -> Optimizer:
    """Returns the optimizer.

    Raises:
        InputError: its settings do not go together.
    """
    settings = asdict(config.optimizer)
    name = settings.pop("name")
    rule = fitness_rule(config.optimizer, config.selector.name)
    for used in ("fitness", "captain_k", "member_k", "average_rate"):
        settings.pop(used)
    if name == "fixed":
        return Fixed(islands, rule)
    if name == "coevolution":
        return Coevolution(islands, rule, playing.workers, **settings)
    names = settings.pop("opponents") or list(playing.env.fixed_policies[: playing.env.standard_policies])
    check_policies(names, playing.env, "optimizer.opponents, or optimizer.opponents=[] for the standard ones,")
    indices = tuple(playing.env.fixed_policies.index(x) for x in names)
    return MapElites(islands, rule, playing.workers, opponents=opponents(indices, config.team_size), **settings)
