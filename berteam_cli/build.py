"""From a checked config to objects; the only place that knows which name is which class."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch

from berteam_cli.cluster import Cluster
from berteam_cli.config_commands import RAY, CommandConfig, TrainConfig
from berteam_cli.config_env import CurriculumConfig, EnvConfig
from berteam_cli.config_groups import OptimizerConfig
from berteam_cli.curriculum import Curriculum, Practising
from berteam_cli.env.base import Env, blank_trajectories, trajectory_bytes
from berteam_cli.env.mctf import Mctf
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.env.rps import Rps
from berteam_cli.errors import InputError
from berteam_cli.evolving import breeding, measured_by, niches
from berteam_cli.frozen import everybody
from berteam_cli.games import Games
from berteam_cli.memory import Room, check_memory
from berteam_cli.opponents.league import League
from berteam_cli.opponents.none import Nobody
from berteam_cli.opponents.pool import check_files
from berteam_cli.opposing import opponents as opposing
from berteam_cli.opposing import without_exploiters
from berteam_cli.optimizer.base import Optimizer
from berteam_cli.optimizer.coevolution import Coevolution
from berteam_cli.optimizer.fitness import CaptainElo, FitnessRule, MovingAverage
from berteam_cli.optimizer.fixed import Fixed
from berteam_cli.optimizer.mapelites import MapElites
from berteam_cli.population import Island, island_of
from berteam_cli.selector.assessor import Assessor
from berteam_cli.selector.base import Field, Selector
from berteam_cli.selector.berteam import Berteam
from berteam_cli.selector.best_members import BestMembers
from berteam_cli.selector.best_team import BestTeam
from berteam_cli.selector.constraints import allowed
from berteam_cli.selector.fictitious import Fictitious
from berteam_cli.selector.mcaa import Mcaa
from berteam_cli.selector.observations import looking
from berteam_cli.selector.psro import Psro
from berteam_cli.selector.uniform import Uniform
from berteam_cli.training import Parts, rounds
from berteam_cli.trust import imported
from berteam_cli.workers import Workers, available_cores
from mctf.practice import Starts

ENVS: dict[str, Callable[..., Env]] = {"mctf": Mctf, "rps": Rps, "pettingzoo": Pettingzoo}
SELECTORS: dict[str, Callable[..., Selector[Any]]] = {
    "uniform": Uniform,
    "mcaa": Mcaa,
    "berteam": Berteam,
    "best_members": BestMembers,
    "best_team": BestTeam,
    "assessor": Assessor,
    "psro": Psro,
}
OPTIMIZERS: dict[str, type[Fixed]] = {
    "fixed": Fixed,
    "coevolution": Coevolution,
    "mapelites": MapElites,
}


def games(config: CommandConfig) -> Games:
    """Returns the game that ``config`` describes, and who plays it.

    Raises:
        InputError: the game's settings do not go together, or nobody can play it.
    """
    return played_by(config.workers, env(config.env, config.team_size))


def played_by(workers: int | str, game: Env) -> Games:
    """Returns ``game`` with as many threads, or with as many as there are cores if ``workers`` is 0 or "ray".

    Raises:
        InputError: Ray is to play, and is not there.
    """
    if workers == RAY:
        return Games(game, Workers(available_cores()), Cluster())
    return Games(game, Workers(int(workers) or available_cores()))


def env(config: EnvConfig, team_size: int) -> Env:
    """Returns the game.

    Raises:
        InputError: its settings do not go together.
    """
    settings = asdict(config)
    if imported(config) and os.getcwd() not in sys.path:  # where a user's own may be; last, so that it hides nothing
        sys.path.append(os.getcwd())
    try:
        return ENVS[settings.pop("name")](team_size=team_size, **settings)
    except ValueError as error:
        raise InputError(f"env.{error}") from error


def parts(config: TrainConfig, *, stored: Path | None = None, read_only: bool = False) -> Parts:
    """Returns everything a run is made of.

    Args:
        config: checked.
        stored: folder of a run that has begun. Its checkpoint holds the members from files and of another run, too:
            those may be gone.
        read_only: whether nobody is to learn, and so no room is needed for what they would learn from.

    Raises:
        InputError: parts of the config do not go together.
    """
    playing = games(config)
    device = chosen_device(config.device)
    islands = everybody(config, playing.env, device, stored=stored)
    members = sum(island.size for island in islands)
    if config.team_size > members:
        raise InputError(
            f"team_size must be at most {members}, the members of the population, but is {config.team_size}."
        )
    check_watched(config.evaluate_every, playing.env)
    improving = optimizer(config, islands, playing)
    others = opposing(config, islands, playing.env, learning=improving.learns)
    own = config.games_per_epoch - others.games
    selecting = selector(config, field_of(config, islands, playing.env), playing.env, device)
    if selecting.answers and own % 2:
        raise InputError(
            f"games_per_epoch{f' less the {others.games} against opponents' if others.games else ''} must be even with "
            f"selector.observations=previous_game, which plays every opponent twice, but is {own}."
        )
    watched = improving.learns or selecting.observes
    games_kept = own // rounds(selecting) + others.games if watched and not read_only else 0
    if not read_only:
        # Both halves of an epoch of answers, and all of it in one piece.
        played = trajectory_bytes(playing.env, 4 * games_kept if selecting.answers else games_kept)
        rooms = [Room(played, "games_per_epoch", config.games_per_epoch)]
        if selecting.observes:
            settings: Any = config.selector  # of one that remembers
            rooms.append(Room(selecting.seen_bytes, "selector.capacity", settings.capacity))
        check_memory(islands, rooms)
        if isinstance(others, League):
            check_files(others.most_snapshots(config.epochs))
    return Parts(
        seed=config.seed,
        games_per_epoch=config.games_per_epoch,
        games=playing,
        selector=selecting,
        optimizer=improving,
        room=blank_trajectories(playing.env, games_kept) if games_kept else None,
        curriculum=curriculum(config.curriculum, playing.env),
        opponents=Nobody(playing.env.sides, playing.env.team_size) if read_only else others,
    )


def check_watched(every: int, game: Env) -> None:
    """Checks that there is somebody to play against in looks at a run, one ``every`` so many epochs, 0: never.

    Raises:
        InputError: there is not.
    """
    if every and not game.standard_policies:
        raise InputError(
            f"evaluate_every must be 0 with env={game.name}, which has no fixed policies to play against, "
            f"but is {every}."
        )


def parts_to_read(config: TrainConfig, folder: Path) -> Parts:
    """Returns the parts of the run in ``folder`` that is only looked at: on the processor, wherever members learnt."""
    return parts(replace(config, device="cpu"), stored=folder, read_only=True)


def curriculum(config: CurriculumConfig, game: Env) -> Curriculum:
    """Returns how training games start.

    Raises:
        InputError: the shares are more than all games, or the game has one kind of start.
    """
    settings = asdict(config)
    until = settings.pop("until")
    try:
        made = Curriculum(Starts(**settings), until)
    except ValueError as error:
        raise InputError(f"curriculum: {error}.") from error
    if made.total > 0 and not isinstance(game, Practising):
        raise InputError(
            f"curriculum must be none with env={game.name}, as only games of env=mctf can start elsewhere."
        )
    return made


def chosen_device(name: str) -> str:
    """Returns "cpu" or "cuda".

    Raises:
        InputError: cuda is asked for and not there.
    """
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        raise InputError("device=cuda needs a CUDA device and a build of torch that supports it; use device=cpu.")
    return "cuda" if there and name != "cpu" else "cpu"


def field_of(config: TrainConfig, islands: tuple[Island, ...], game: Env) -> Field:
    """Returns among whom the selector chooses.

    Raises:
        InputError: selector.valid_members cannot be.
    """
    owners, places = island_of(islands), config.selector.valid_members
    try:
        valid = None
        if places is not None:
            valid = allowed(places, [island.name for island in islands], owners, config.team_size)
    except ValueError as error:
        raise InputError(str(error)) from error
    valid = without_exploiters(valid, islands, config.team_size)
    return Field(owners, config.team_size, game.sides, valid, config.selector.exact_limit)


def selector(config: TrainConfig, field: Field, game: Env, device: str) -> Selector[Any]:
    """Returns the selector.

    Raises:
        InputError: its settings do not go together.
    """
    settings = asdict(config.selector)
    for used in ("fitness", "exact_limit", "valid_members"):
        settings.pop(used)
    name = settings.pop("name")
    if name == "berteam":
        settings["device"] = device
        settings["observations"] = looking(settings["observations"], game)
    opponents = settings.pop("opponents", "own")
    average = {key: settings.pop(key) for key in ("reservoir", "sharpening") if key in settings}
    try:
        chosen: Any = SELECTORS[name](field=field, **settings)  # only berteam has opponents, and what they ask of it
        return Fictitious(chosen, **average) if opponents == "average" else chosen
    except ValueError as error:
        raise InputError(str(error)) from error


def fitness_rule(config: OptimizerConfig, selecting: str, sides: int) -> FitnessRule:
    """Returns how games of ``sides`` teams become fitness.

    Raises:
        InputError: captains are to be rated, but the selector ``selecting`` names none.
    """
    if config.fitness == "moving_average":
        return MovingAverage(config.average_rate, 1 / sides)
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
    chosen = OPTIMIZERS[settings.pop("name")]
    rule = fitness_rule(config.optimizer, config.selector.name, playing.env.sides)
    for used in ("fitness", "captain_k", "member_k", "average_rate"):
        settings.pop(used)
    if chosen.learns:
        settings["workers"] = playing.workers
        settings["breeding"] = breeding(settings, islands, playing.env)
    if "behaviours" in settings:
        settings |= niches(settings, config.team_size, playing.env, config.seed)
    if "opponents" in settings:
        settings["opponents"] = measured_by(settings["opponents"], config.team_size, playing.env)
    return chosen(islands, rule, **settings)
