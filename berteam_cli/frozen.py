"""Members of another run: as its newest whole checkpoint has them, on islands of the same names, learning nothing more.

Of that run's folder only data is read. Its game is never made, so nothing that its config may import is imported: the
members get the game of the new run, and are refused if they cannot play it.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

from torch import Tensor

from berteam_cli import checkpoint
from berteam_cli.config import checked
from berteam_cli.config_commands import TrainConfig
from berteam_cli.config_env import EnvConfig
from berteam_cli.env.base import Env
from berteam_cli.errors import InputError, RunError
from berteam_cli.fitting import check_policies
from berteam_cli.folder import newest, read_manifest
from berteam_cli.founding import MEMBERS, archipelago
from berteam_cli.learner.base import Learner
from berteam_cli.learner.fixed import Fixed
from berteam_cli.learner.imported import Imported
from berteam_cli.population import Island, Origin
from berteam_cli.stored import typed_config
from berteam_cli.tensors import below

KEY = "population.run"


def everybody(config: TrainConfig, game: Env, device: str, *, stored: Path | None) -> tuple[Island, ...]:
    """Returns the islands of the population, one after the other, those of another run last.

    Args:
        config: checked.
        game: that is played.
        device: "cpu" or "cuda", where members learn.
        stored: folder of a run that has begun: if it has a checkpoint, the other run is not looked at, and may be gone.

    Raises:
        InputError: there is no island, or one does not fit.
        RunError: the checkpoint in ``stored`` does not tell.
    """
    islands = list(archipelago(config, game, device, stored=stored is not None))
    if config.population.run is None:
        return tuple(islands)
    if stored is not None and newest(stored) >= 0:
        found = kept(stored, game)
    else:
        found = of_run(Path(config.population.run), config, game)
    for island in found:
        if island.name in {other.name for other in islands}:
            if island.name == MEMBERS:
                raise InputError(
                    f"{KEY}={config.population.run} has members from files, too, which are on an island {MEMBERS} like "
                    "those of population.members; leave these out, or that run."
                )
            raise InputError(
                f"{KEY}={config.population.run} has an island {island.name}, as this population has; "
                f"give that of this one another name, or leave it to the run with population=of_run."
            )
        islands.append(replace(island, first=sum(other.size for other in islands)))
    return tuple(islands)


def of_run(folder: Path, config: TrainConfig, game: Env) -> list[Island]:
    """Returns the islands of the run in ``folder`` whose members are chosen for teams there, not its exploiters'.

    Raises:
        InputError: there is no such run, it has no whole checkpoint, or its members cannot play ``game``.
    """
    if config.out and Path(config.out).resolve() == folder.resolve():
        raise InputError(f"out must be another folder than {KEY}, but both are {folder}.")
    try:
        read_manifest(folder)
        source = checked(typed_config(folder))
        check_game(folder, source.env, config.env)
        islands = everybody(source, game, "cpu", stored=folder)
        epoch, tensors = checkpoint.newest_whole(folder, whole)
    except (InputError, RunError) as error:
        raise InputError(f"{KEY}: {error}") from error
    try:
        return [
            frozen(island, below(tensors, f"island.{i}."), game, (str(folder), epoch))
            for i, island in enumerate(islands)
            if not island.exploits
        ]
    except checkpoint.DAMAGES as error:
        raise InputError(
            f"{KEY}={folder} must hold members that see {game.observation_size} numbers and have {game.actions} "
            f"actions, as in this game with team_size={config.team_size}, but some are of another kind; "
            f"give the env that they learnt in, and its team_size={source.team_size}."
        ) from error


def whole(place: Path) -> tuple[int, dict[str, Tensor]]:
    """Returns the epoch and all tensors of the checkpoint in folder ``place``.

    Raises:
        ValueError: it is of another version or was changed since it was written.
    """
    said = checkpoint.said_of(place)
    return said["epoch"], checkpoint.tensors_in(place, said)


def check_game(folder: Path, theirs: EnvConfig, ours: EnvConfig) -> None:
    """Checks that the run in ``folder`` is of the game that is played.

    Raises:
        InputError: it is not.
    """
    for key in ("name", "target"):
        there, here = getattr(theirs, key, None), getattr(ours, key, None)
        if there != here:
            what = "env" if key == "name" else f"env.{key}"
            raise InputError(f"{folder} must be a run of the same game, but is of {what}={there}, and this of {here}.")


def frozen(island: Island, tensors: dict[str, Tensor], game: Env, source: tuple[str, int]) -> Island:
    """Returns an ``island`` of another run with members who act as they are evaluated there.

    Args:
        island: with its learner there.
        tensors: what that run's checkpoint holds of it.
        game: that is played.
        source: folder of that run, and epoch of the checkpoint.

    Raises:
        ValueError: its members are not of this game; or another of checkpoint.DAMAGES.
    """
    mind = island.learner.restored(tensors)
    called = tuple(island.learner.names(mind, island.name))
    acting = island.learner.policies(mind, explore=False)
    check_policies(acting, game)
    if not len(called) == len(acting.kind) == island.size:
        raise ValueError(f"its island {island.name} has not {island.size} members")
    learner: Learner[Any] = Imported(called, game.observation_size, game.actions, acting)
    if isinstance(island.learner, Fixed):
        learner = Fixed(tuple(map(int, acting.fixed)), game.fixed_policies)
    return Island(island.name, 0, island.size, learner, origin=Origin(*source, called))


def kept(folder: Path, game: Env) -> list[Island]:
    """Returns the islands of another run that the run in ``folder`` has, whose checkpoint names them.

    Raises:
        RunError: it does not.
    """
    said = checkpoint.newest_whole(folder, checkpoint.said_of)
    try:
        return [named(origin, game) for origin in said["origins"]]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunError(
            f"{folder} has no checkpoint to go on from (it does not say who the members of {KEY} are)."
        ) from error


def named(said: dict[str, Any], game: Env) -> Island:
    """Returns the island that a checkpoint describes; its networks are among the checkpoint's tensors.

    Raises:
        ValueError: it is none.
    """
    name, members = str(said["island"]), tuple(map(str, said["members"]))
    if not members or not all(re.fullmatch(r"\w[\w.-]*", word, re.ASCII) for word in (name, *members)):
        raise ValueError("a name is no word")
    learner: Learner[Any] = Imported(members, game.observation_size, game.actions, None)
    if said["algorithm"] == Fixed.algorithm:
        learner = Fixed(tuple(map(game.fixed_policies.index, members)), game.fixed_policies)
    return Island(name, 0, len(members), learner, origin=Origin(str(said["run"]), int(said["epoch"]), members))
