"""Which games are copies of others: the same players on the same places, where nothing is left to chance."""

from __future__ import annotations

import numpy as np

from berteam_cli.acting import FIXED, SAMPLED, Policies
from berteam_cli.env.base import Env
from berteam_cli.env.mctf import Mctf
from berteam_cli.outcomes import Bools, Ints
from mctf.rules import STARTS_RANDOM

RANDOM = ("random", "combined_medium")  # the fixed policies that draw their actions


def draws_actions(env: Env, policies: Policies) -> Bools:
    """Returns (K,) which policies draw their actions: two games of others alone can be the same game."""
    random = np.array([name in RANDOM for name in env.fixed_policies])
    fixed = policies.kind == FIXED
    by_name = np.zeros(len(fixed), dtype=np.bool_)
    by_name[fixed] = random[policies.fixed[fixed]]
    return by_name | (policies.kind == SAMPLED) | (policies.epsilon > 0)


def game_draws(env: Env) -> bool:
    """Returns whether the game itself knows chance: mctf where players start anywhere, and any game of PettingZoo."""
    return env.name == "pettingzoo" or (isinstance(env, Mctf) and env.rules.starts == STARTS_RANDOM)


def chancy_teams(env: Env, policies: Policies, teams: Ints) -> Bools:
    """Returns (K,) whether games of (K, T) ``teams`` are left to chance, whoever the opponent is."""
    return np.logical_or(draws_actions(env, policies)[teams].any(axis=1), game_draws(env))


def clusters(env: Env, policies: Policies, lineups: Ints) -> Ints:
    """Returns (B,) the index of the first game of which each game is a copy; its own, where it is none.

    Args:
        env: the game.
        policies: how the players act.
        lineups: (B, S, T) who played where.
    """
    own = np.arange(len(lineups))
    if game_draws(env):
        return own
    places = lineups.reshape(len(lineups), -1)
    _, first, group = np.unique(places, axis=0, return_index=True, return_inverse=True)
    return np.where(draws_actions(env, policies)[places].any(axis=1), own, first[group.ravel()])
