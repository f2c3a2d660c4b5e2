"""berteam tournament: every team against every other, of the fixed policies or of a trained run."""

from __future__ import annotations

import logging
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from omegaconf import OmegaConf

from berteam_cli import build, checkpoint
from berteam_cli.acting import Policies, fixed_policies
from berteam_cli.command.inspect import show
from berteam_cli.config import checked
from berteam_cli.config_commands import TournamentConfig
from berteam_cli.errors import InputError
from berteam_cli.evaluation.reference import table_name
from berteam_cli.evaluation.tournament import Standings
from berteam_cli.evaluation.tournament import tournament as played
from berteam_cli.folder import Manifest, claim, logging_to, new_folder, read_manifest
from berteam_cli.games import Games
from berteam_cli.outcomes import SIDES, Ints
from berteam_cli.population import names, policies
from berteam_cli.recording import game_rows, side_rows
from berteam_cli.records import COLUMNS, SIDES_TABLE, team_name, team_names, write_table
from berteam_cli.selector.base import team_count, unordered_teams
from berteam_cli.stored import plain_config, stored_config, write_config
from berteam_cli.training import RECORDS, generator

log = logging.getLogger("berteam")

MOST_GAMES = 1_000_000  # some hours


def tournament(config: TournamentConfig, text: str, folder: Path | None = None) -> float:
    """Plays as configured and writes elo.csv, pairs.csv and games.csv; returns NaN, having no figure of its own.

    Args:
        config: checked.
        text: the same as yaml, for the folder.
        folder: None makes one.

    Raises:
        InputError: the config does not go together, or the folder is not free.
        RunError: it failed.
    """
    entry = players(config)
    if config.run is not None:
        text = with_game_of(Path(config.run), text)
    folder = folder or new_folder("tournament")
    claim(folder, config.on_exists)
    write_config(folder, text)
    pairs = len(entry.teams) * (len(entry.teams) - 1) // 2
    with logging_to(folder):
        log.info("%s", folder)
        manifest = Manifest.begun(folder, seed=config.seed, teams=len(entry.teams), pairs=pairs, **entry.facts)
        log.info("%d teams, %d pairs, %d games each.", len(entry.teams), pairs, config.games_per_pair)
        with manifest.until_the_end(resumable=False):
            standings = played(entry.games, entry.policies, entry.teams, config.games_per_pair, config.seed)
            write_table(folder / "elo.csv", COLUMNS["elo"], elo_rows(standings, entry.names))
            write_table(folder / "pairs.csv", COLUMNS["pairs"], pair_rows(standings))
            write_table(folder / "games.csv", COLUMNS["games"], game_rows(0, standings.outcomes))
            if entry.games.env.sides > 2:
                write_table(folder / f"{SIDES_TABLE}.csv", COLUMNS[SIDES_TABLE], side_rows(0, standings.outcomes))
    show(folder, 10)
    return math.nan


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
    if config.on_exists == "resume":
        raise InputError("on_exists=resume is for training runs; a tournament takes error or overwrite.")
    if config.run is None:
        return of_fixed_policies(config)
    for key in overridden:
        if key.split(".", maxsplit=1)[0] in {"env", "team_size", "policies"}:
            raise InputError(f"{key} has no effect with run={config.run}, whose game, team size and members are taken.")
    return of_run(config)


def of_fixed_policies(config: TournamentConfig) -> Entry:
    """Returns all teams of the fixed policies.

    Raises:
        InputError: they are too many, or a policy is not the game's.
    """
    games = build.games(config)
    env = games.env
    called = config.policies or list(env.fixed_policies[: env.standard_policies])
    build.check_policies(called, env, "policies")
    twice = sorted({name for name in called if called.count(name) > 1})
    if twice:
        raise InputError(f"policies must name each policy once, but has {', '.join(twice)} more than once.")
    said = f"policies={called} with team_size" if config.policies else "team_size"
    check_size(team_count(len(called), config.team_size), f"{said}={config.team_size}", config)
    return Entry(
        games,
        fixed_policies([env.fixed_policies.index(name) for name in called]),
        unordered_teams(len(called), config.team_size),
        called,
        {} if config.policies else {"reference": table_name(env)},
    )


def with_game_of(run: Path, text: str) -> str:
    """Returns the config ``text`` with the game and the team size of ``run``, which are what was played."""
    config, trained = OmegaConf.create(text), plain_config(run)
    config.env, config.team_size = trained.env, trained.team_size
    return OmegaConf.to_yaml(config)


def check_size(teams: int, said: str, config: TournamentConfig) -> None:
    """Checks that every pair of ``teams`` teams can play.

    Raises:
        InputError: there is only one, or their games are more than MOST_GAMES; ``said`` is the setting to blame.
    """
    if teams < 2:
        raise InputError(f"{said} gives {teams} team, and a tournament needs two.")
    games = teams * (teams - 1) // 2 * config.games_per_pair
    if games > MOST_GAMES:
        raise InputError(f"{said} gives {teams:,} teams and {games:,} games; at most {MOST_GAMES:,} games are played.")


def of_run(config: TournamentConfig) -> Entry:
    """Returns the most probable teams of a trained run.

    Raises:
        InputError: there is no such run, or it has too few teams or too many.
    """
    folder = Path(str(config.run))
    read_manifest(folder)
    if config.out and Path(config.out).resolve() == folder.resolve():
        raise InputError(f"out must be another folder than run, but both are {config.out}.")
    trained = checked(stored_config(folder))
    trained.workers = config.workers
    parts = build.parts_to_read(trained)
    run = checkpoint.load(folder, parts).run
    acting = policies(parts.optimizer.islands, run.population, explore=False)
    found = parts.selector.likeliest(run.selection, config.top, generator(parts.seed, RECORDS, run.epoch))
    check_size(len(found.teams), f"top={config.top}", config)
    called = names(parts.optimizer.islands, run.population)
    return Entry(parts.games, acting, found.teams, called, {"run": str(folder), "epoch": run.epoch})


def elo_rows(standings: Standings, called: list[str]) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of elo.csv, the strongest team first; nobody predicted anything here."""
    won, drawn, lost = standings.record.sum(axis=2)
    for rank, k in enumerate(np.argsort(-standings.elos, kind="stable"), start=1):
        elo, width, team = standings.elos[k], standings.half_widths[k], standings.teams[k]
        yield (
            *(team_name(team), " + ".join(called[m] for m in team), elo, elo - width, elo + width),
            *(won[k] + drawn[k] + lost[k], won[k], drawn[k], lost[k], math.nan, rank, math.nan, math.nan),
        )


def pair_rows(standings: Standings) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of pairs.csv: each team against each other, apart for the side it played alone."""
    names = team_names(standings.teams)
    for k, team in enumerate(names):
        for j, opponent in enumerate(names):
            for color, results in zip(SIDES, standings.results, strict=False):
                counts = results[:, k, j]
                if counts.sum():
                    yield team, opponent, counts.sum(), *counts, color
