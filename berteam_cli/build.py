"""From a checked config to objects; the only place that knows which name is which class."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from berteam_cli.acting import Policies, joined
from berteam_cli.config import (
    CommandConfig,
    EnvConfig,
    IslandConfig,
    LearnerConfig,
    MemberConfig,
    OptimizerConfig,
    TrainConfig,
)
from berteam_cli.env.base import Env, blank_trajectories
from berteam_cli.env.mctf import Mctf
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.env.rps import Rps
from berteam_cli.errors import InputError
from berteam_cli.games import Games
from berteam_cli.learner.base import Learner
from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.fixed import Fixed as FixedLearner
from berteam_cli.learner.imported import Imported, read
from berteam_cli.learner.ppo import Ppo
from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.learner.stacked_ppo import StackedPpo
from berteam_cli.learner.zipped import Unfit
from berteam_cli.memory import check_memory
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
MEMBERS = "members"  # the island of members from files
NO_NAMES = {"na", "nan", "null", "none", "n-a", "other"}  # pandas reads most of these as nothing

LEARNERS: dict[str, Callable[..., Learner[Any]]] = {"ppo": Ppo, "dqn": Dqn}
STACKED_LEARNERS: dict[str, Callable[..., Learner[Any]]] = {"ppo": StackedPpo, "dqn": StackedDqn}


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


def parts(config: TrainConfig, *, stored: bool = False) -> Parts:
    """Returns everything a run is made of.

    Args:
        config: checked.
        stored: whether the run has a checkpoint, which holds the members from files too: the files may be gone.

    Raises:
        InputError: parts of the config do not go together.
    """
    playing = games(config)
    device = chosen_device(config.device)
    islands = archipelago(config, playing.env, device, stored=stored)
    members = sum(island.size for island in islands)
    if config.team_size > members:
        raise InputError(
            f"team_size must be at most {members}, the members of the population, but is {config.team_size}."
        )
    field = Field(island_of(islands), config.team_size)
    improving = optimizer(config, islands, playing)
    games_kept = config.games_per_epoch if improving.learns else 0
    check_memory(islands, playing.env, games_kept)
    return Parts(
        seed=config.seed,
        games_per_epoch=config.games_per_epoch,
        games=playing,
        selector=selector(config, field, device),
        optimizer=improving,
        room=blank_trajectories(playing.env, games_kept) if games_kept else None,
    )


def parts_to_read(config: TrainConfig) -> Parts:
    """Returns the parts of a run that is only looked at: on the processor, wherever its members learnt."""
    return parts(replace(config, device="cpu"), stored=True)


def chosen_device(name: str) -> str:
    """Returns "cpu" or "cuda".

    Raises:
        InputError: cuda is asked for and not there.
    """
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise InputError("device=cuda needs a CUDA device and a build of torch that supports it; use device=cpu.")
    return "cuda" if there and name != "cpu" else "cpu"


def archipelago(config: TrainConfig, game: Env, device: str, *, stored: bool) -> tuple[Island, ...]:
    """Returns the islands of the population, one after the other, that of members from files last.

    Raises:
        InputError: there is none, or its learner or a file does not fit.
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
            typed = len(config.population.islands) == 1 and settings.learner == config.learner
            made = learner(settings.learner, game, "learner" if typed else f"{key}.learner", device)
        islands.append(Island(name, first, settings.size, made))
    if members := config.population.members:
        if MEMBERS in config.population.islands:
            raise InputError(
                f"population.islands.{MEMBERS} must have another name: "
                f"the members of population.members are on the island {MEMBERS}."
            )
        first = islands[-1].first + islands[-1].size if islands else 0
        islands.append(Island(MEMBERS, first, len(members), imported_members(members, game, stored=stored)))
    if not islands:
        raise InputError(
            "population must have members, but has none: name islands in population.islands, "
            "or files in population.members=[{file: agent.zip}]."
        )
    return tuple(islands)


def imported_members(members: list[MemberConfig], game: Env, *, stored: bool) -> Learner[Any]:
    """Returns the learner of members from files, which are read unless the run is ``stored``.

    Raises:
        InputError: a file holds no policy that can act in this game, or a name is none or is another member's too.
    """
    called: list[str] = []
    for k, member in enumerate(members):
        name, key = member.name or Path(member.file).stem, f"population.members[{k}].name"
        if not re.fullmatch(r"\w[\w.-]*", name, re.ASCII) or name.lower() in NO_NAMES:
            raise InputError(f"{key} must be a word that tables can hold, but is {name!r}; give it another.")
        if name in called:
            raise InputError(f"{key} is {name!r}, as that of member {called.index(name)}; give each a name of its own.")
        called.append(name)
    size = game.observation_size, game.actions
    tables: list[Policies] = []
    for k, member in enumerate([] if stored else members):
        try:
            tables.append(read(Path(member.file), *size, trust=member.trust))
        except Unfit as error:
            raise InputError(f"population.members[{k}].file={member.file} {error}.") from error
    return Imported(tuple(called), *size, None if stored else joined(tables))


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


def learner(config: LearnerConfig, game: Env, key: str, device: str) -> Learner[Any]:
    """Returns a learner of networks.

    Args:
        config: its settings.
        game: what it learns.
        key: of its settings, for messages.
        device: "cpu", where compiled functions learn, or "cuda", where torch does.

    Raises:
        InputError: its settings do not go together.
    """
    settings = asdict(config)
    name = settings.pop("name")
    network = settings.pop("network")
    if not 1 <= len(network) <= 6 or not all(1 <= width <= 4096 for width in network):
        raise InputError(f"{key}.network must be 1 to 6 widths from 1 to 4096, but is {network}.")
    check_settings(settings, key)
    if device != "cpu":
        settings["device"] = device
    return (LEARNERS if device == "cpu" else STACKED_LEARNERS)[name](
        observation_size=game.observation_size,
        actions=game.actions,
        network=tuple(network),
        **settings,
    )


def check_settings(settings: dict[str, Any], key: str) -> None:
    """Checks that the settings of a learner go together.

    Raises:
        InputError: they do not.
    """
    steps, minibatch = settings.get("n_steps"), settings.get("minibatch_size")
    if steps is not None and minibatch is not None and steps % minibatch:
        less, more = steps // minibatch * minibatch, -(-steps // minibatch) * minibatch
        near = f"{less} or {more}" if less else f"{more}"
        raise InputError(
            f"{key}.n_steps must be a multiple of {key}.minibatch_size={minibatch}, such as {near}, but is {steps}."
        )
    if settings.get("gradient_steps") == 0:
        raise InputError(f"{key}.gradient_steps must be >= 1, or -1 for as many as transitions, but is 0.")


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
