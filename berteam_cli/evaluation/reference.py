"""The teams of fixed policies and their Elos: the yardstick that all runs share."""

from __future__ import annotations

import hashlib
import importlib.resources
import json
import logging
from dataclasses import dataclass

import numpy as np
import pandas as pd

from berteam_cli.acting import fixed_policies
from berteam_cli.env.base import Env
from berteam_cli.evaluation.tournament import tournament
from berteam_cli.games import Games
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.selector.base import team_count, unordered_teams

log = logging.getLogger("berteam")

GAMES_PER_PAIR = 8  # every order of the members of teams of two, from both of two sides
SEED = 0  # one for all runs, so that they share the yardstick


@dataclass(frozen=True)
class Reference:
    """Teams of fixed policies and what they are worth.

    Attributes:
        teams: (J, T) fixed policies in ascending order.
        elos: (J,) with mean 1000.
        source: where the Elos come from, for the manifest.
    """

    teams: Ints
    elos: Floats
    source: str


def table_name(env: Env) -> str:
    """Returns the name of the shipped table for a game: with eight digits that tell its settings from others."""
    said = json.dumps(env.fingerprint(), sort_keys=True)
    return f"{env.name}_{env.team_size}_{hashlib.sha256(said.encode()).hexdigest()[:8]}.csv"


def reference_teams(policies: int, team_size: int, most: int) -> Ints:
    """Returns the teams of fixed policies, (J, T): all of them, or ``most`` evenly spaced ones if they are more."""
    count = team_count(policies, team_size)
    if count <= most:
        return unordered_teams(policies, team_size)
    spaced = np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))
    return np.array([team_at(index, policies, team_size) for index in spaced.tolist()], dtype=np.int64)


def team_at(index: int, policies: int, team_size: int) -> list[int]:
    """Returns the unordered team at ``index`` of all, members ascending, in lexicographic order."""
    team: list[int] = []
    member = 0
    while len(team) < team_size:
        beginning = team_count(policies - member, team_size - len(team) - 1)  # teams that go on with this member
        if index < beginning:
            team.append(member)
        else:
            index -= beginning
            member += 1
    return team


def reference(games: Games, most: int) -> Reference:
    """Returns the teams of fixed policies and their Elos for this game.

    A table shipped with the package is taken if it fits the settings; else the teams play a tournament now.

    Args:
        games: the game and its threads.
        most: so many teams at most.
    """
    env = games.env
    teams = reference_teams(env.standard_policies, env.team_size, most)
    name = table_name(env)
    shipped = importlib.resources.files("berteam_cli.rating").joinpath(name)
    if shipped.is_file():
        with shipped.open(encoding="utf-8") as file:
            table = pd.read_csv(file, dtype={"team": str}).set_index("team")
        names = ["-".join(map(str, team)) for team in teams]
        if set(names) <= set(table.index):
            return Reference(teams, table.loc[names, "elo"].to_numpy(dtype=float), f"shipped table {name}")
    log.info("No Elos of the fixed teams are shipped for these settings: %d teams play for them now.", len(teams))
    acting = fixed_policies(range(env.standard_policies))
    elos = tournament(games, acting, teams, GAMES_PER_PAIR, SEED).elos
    return Reference(teams, elos, f"tournament of {len(teams)} teams, {GAMES_PER_PAIR} games a pair, seed {SEED}")
