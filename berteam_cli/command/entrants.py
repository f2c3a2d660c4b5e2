"""Who plays in a tournament: teams of fixed policies, of trained runs, or a list of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from omegaconf import OmegaConf

from berteam_cli import build
from berteam_cli.acting import Policies, fixed_policies, joined, noisy
from berteam_cli.config import checked
from berteam_cli.config_commands import TournamentConfig
from berteam_cli.config_env import EnvConfig, MctfConfig
from berteam_cli.errors import InputError, did_you_mean
from berteam_cli.evaluation.reference import table_name
from berteam_cli.founding import check_policies
from berteam_cli.games import Games
from berteam_cli.outcomes import Ints
from berteam_cli.population import names, policies
from berteam_cli.reading import last_state
from berteam_cli.records import team_names
from berteam_cli.selector.base import team_count, unordered_teams
from berteam_cli.stored import plain_config, stored_config
from berteam_cli.training import RECORDS, generator
from berteam_cli.trust import trusted

MOST_GAMES = 1_000_000  # some hours


@dataclass(frozen=True)
class Entry:
    """Who plays in a tournament.

    Attributes:
        games: the game and its threads.
        policies: how the players act.
        teams: (K, T) players of each team.
        names: of the players.
        facts: for the manifest.
    """

    games: Games
    policies: Policies
    teams: Ints
    names: list[str]
    facts: dict[str, Any]


def players(config: TournamentConfig, overridden: Collection[str] = ()) -> Entry:
    """Returns who plays.

    Args:
        config: checked.
        overridden: keys that the command line gave.

    Raises:
        InputError: the config does not go together, or there is no such run.
    """
    runs = runs_of(config)
    taken = {"env", "team_size"} | (set() if config.fixed else {"policies"})
    for key in overridden:
        if runs and key.split(".", maxsplit=1)[0] in taken:
            raise InputError(f"{key} has no effect with run={config.run}, whose game, team size and members are taken.")
    entry = of_runs(config, runs) if runs else of_fixed_policies(config)
    if config.teams:
        entry = replace(entry, teams=listed(config.teams, entry))
    said = f"teams={config.teams}" if config.teams else f"top={config.top}" if runs else size_said(config)
    check_size(len(entry.teams), said, config)
    check_rating(config, entry.games.env.sides)
    if config.action_noise > 0:
        if entry.games.env.name == "pettingzoo":
            raise InputError("action_noise is for env=mctf and env=rps, but the game is env=pettingzoo's.")
        entry = replace(entry, policies=noisy(entry.policies, config.action_noise))
    return entry


def check_rating(config: TournamentConfig, sides: int) -> None:
    """Checks that games of so many sides can be rated and tested as configured.

    Raises:
        InputError: they cannot.
    """
    test = config.sprt
    if test.rounds > 1 and not test.elo0 < 0 < test.elo1:  # else equal teams would be told stronger and weaker
        raise InputError(
            f"sprt.elo0 must be below 0 and sprt.elo1 above it, but they are {test.elo0:g} and {test.elo1:g}."
        )
    if sides > 2 and config.rating != "ml":
        raise InputError(f"rating={config.rating} is for games of two sides, but these have {sides}; use rating=ml.")
    if sides > 2 and test.rounds > 1:
        raise InputError(f"sprt.rounds={test.rounds} is for games of two sides, but these have {sides}; use 1.")


def runs_of(config: TournamentConfig) -> list[Path]:
    """Returns the folders of the runs whose teams play.

    Raises:
        InputError: run is neither a folder nor a list of them.
    """
    given = [] if config.run is None else config.run if isinstance(config.run, list) else [config.run]
    if not all(isinstance(run, str) for run in given):
        raise InputError(f"run must be a folder or a list of folders, but is {config.run!r}.")
    folders = [Path(run) for run in given]
    if len({folder.resolve() for folder in folders}) < len(folders):
        raise InputError(f"run must name each run once, but is {config.run}.")
    return folders


def of_fixed_policies(config: TournamentConfig) -> Entry:
    """Returns all teams of the fixed policies.

    Raises:
        InputError: they are too many, or a policy is not the game's.
    """
    games = build.games(replace(config, env=started(config.env, config)))
    env = games.env
    called = called_policies(config, games)
    check_size(team_count(len(called), config.team_size), size_said(config), config, listed=bool(config.teams))
    return Entry(
        games,
        fixed_policies([env.fixed_policies.index(name) for name in called]),
        unordered_teams(len(called), config.team_size),
        called,
        {} if config.policies else {"reference": table_name(env)},
    )


def called_policies(config: TournamentConfig, games: Games) -> list[str]:
    """Returns the names of the fixed policies that play.

    Raises:
        InputError: one is not the game's, or is there twice.
    """
    env = games.env
    called = config.policies or list(env.fixed_policies[: env.standard_policies])
    check_policies(called, env, "policies")
    twice = sorted({name for name in called if called.count(name) > 1})
    if twice:
        raise InputError(f"policies must name each policy once, but has {', '.join(twice)} more than once.")
    return called


def size_said(config: TournamentConfig) -> str:
    """Returns the setting that says how many teams of fixed policies there are."""
    return (
        f"policies={config.policies} with team_size={config.team_size}"
        if config.policies
        else (f"team_size={config.team_size}")
    )


def started(env: EnvConfig, config: TournamentConfig) -> EnvConfig:
    """Returns the game's settings, with players that start anywhere if that is asked for.

    Raises:
        InputError: the game has no such thing.
    """
    if not config.random_starts:
        return env
    if not isinstance(env, MctfConfig):
        raise InputError(f"random_starts is for env=mctf, but the game is env={env.name}; action_noise may do instead.")
    return replace(env, starts="random")


def with_game_of(run: Path, text: str) -> str:
    """Returns the config ``text`` with the game and the team size of ``run``, which are what was played."""
    config, trained = OmegaConf.create(text), plain_config(run)
    config.env, config.team_size = trained.env, trained.team_size
    return OmegaConf.to_yaml(config)


def check_size(teams: int, said: str, config: TournamentConfig, *, listed: bool = False) -> None:
    """Checks that every pair of ``teams`` teams can play, or if only ``listed`` ones do, that they can be listed.

    Raises:
        InputError: there is only one, or their games are more than MOST_GAMES; ``said`` is the setting to blame.
    """
    if teams < 2:
        raise InputError(f"{said} gives {teams} team, and a tournament needs two.")
    games = teams if listed else teams * (teams - 1) // 2 * config.games_per_pair
    if games > MOST_GAMES:
        raise InputError(f"{said} gives {teams:,} teams and {games:,} games; at most {MOST_GAMES:,} games are played.")


def listed(wanted: list[str], entry: Entry) -> Ints:
    """Returns (K, T) the teams that are named in ``wanted``.

    Raises:
        InputError: one is no team of these players, or is there twice.
    """
    size, most = entry.games.env.team_size, len(entry.names) - 1
    teams = []
    for name in wanted:
        members = name.split("-")
        right = len(members) == size and all(m.isascii() and m.isdigit() and int(m) <= most for m in members)
        if not right:
            near = did_you_mean(name, team_names(entry.teams))
            raise InputError(
                f"teams must be of {size} members from 0 to {most} each, joined by hyphens, but has {name!r}.{near}"
            )
        teams.append(sorted(int(m) for m in members))
    if len({tuple(team) for team in teams}) < len(teams):
        raise InputError(f"teams must name each team once, but is {wanted}.")
    return np.array(teams)


def of_runs(config: TournamentConfig, runs: list[Path]) -> Entry:
    """Returns the most probable teams of trained runs, whose members are counted on from one to the next.

    Raises:
        InputError: there is no such run, or the runs have different games.
    """
    tables, teams, called, first = [], [], [], 0
    epochs: list[int] = []
    game, widest, trust = None, runs[0], trusted(config.trust)
    for folder in runs:
        if config.out and Path(config.out).resolve() == folder.resolve():
            raise InputError(f"out must be another folder than run, but both are {config.out}.")
        parts, run = last_state(folder, trust=trust)
        if game is None:
            game = parts.games
        elif parts.games.env.fingerprint() != game.env.fingerprint():
            raise InputError(
                f"run must be of runs with the same game and rules, but {folder} has others than {runs[0]}."
            )
        if parts.games.env.observation_size > game.env.observation_size:
            game, widest = parts.games, folder  # networks that see fewer steps read the newest, which come first
        islands = parts.optimizer.islands
        found = parts.selector.likeliest(run.selection, config.top, generator(parts.seed, RECORDS, run.epoch))
        tables.append(policies(islands, run.population, explore=False))
        teams.append(found.teams + first)
        prefix = f"{folder.name if unique(folder, runs) else folder}/" if len(runs) > 1 else ""
        called += [f"{prefix}{name}" for name in names(islands, run.population)]
        first, epochs = len(called), [*epochs, run.epoch]
    trained = checked(stored_config(widest, trust))
    trained.workers = config.workers
    games = build.games(replace(trained, env=started(trained.env, config)))
    if config.fixed:
        fixed = called_policies(config, games)
        check_size(team_count(len(fixed), games.env.team_size), "fixed=true", config)
        tables.append(fixed_policies([games.env.fixed_policies.index(name) for name in fixed]))
        teams.append(unordered_teams(len(fixed), games.env.team_size) + first)
        called += fixed
    several = len(runs) > 1
    facts = {"run": [str(run) for run in runs] if several else str(runs[0]), "epoch": epochs if several else epochs[0]}
    return Entry(games, joined(tables), np.concatenate(teams), called, facts)


def unique(folder: Path, runs: list[Path]) -> bool:
    """Returns whether no other of ``runs`` has the last name of ``folder``."""
    return [run.name for run in runs].count(folder.name) == 1
