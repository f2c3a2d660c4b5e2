"""Fills teams, one place after the other; paper, Section 3, "Transformer based Sequence Completion"."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Floats, Ints
from berteam_cli.selector.network import Odds


def noise(ages: Ints, half_life: float) -> Floats:
    """Returns (N,) how little the network is believed about each member, 1 for one that was just replaced.

    t = 2^(-age / half_life).

    Args:
        ages: (N,) epochs since each member was last replaced.
        half_life: epochs; 0 turns the noise off.
    """
    if half_life == 0:
        return np.zeros(len(ages))
    return 0.5 ** (ages / half_life)


def towards_uniform(odds: Floats, noise: Floats) -> Floats:
    """Returns ``odds``, (..., N), moved towards 1 / N and normalised: p' ~ (1 - t) p + t / N.

    Args:
        odds: chances of the members, last axis summing to 1.
        noise: (N,) t in [0, 1] of each member.
    """
    mixed = (1.0 - noise) * odds + noise / len(noise)
    return mixed / mixed.sum(axis=-1, keepdims=True)


def drawn(chances: Floats, rng: Generator) -> Ints:
    """Returns (K,) one column of each row of ``chances``, (K, C), drawn in proportion to them."""
    reached = np.cumsum(chances, axis=1)
    reached /= reached[:, -1:]  # ends at exactly 1, so a draw in [0, 1) always finds a column
    return (reached > rng.random((len(chances), 1))).argmax(axis=1)


def filled(odds: Odds, teams: Ints, noise: Floats, rng: Generator) -> Ints:
    """Returns ``teams`` with every OPEN place filled, one place of each team at a time.

    Each time an open place is chosen uniformly and its member drawn from the network's conditional there, moved
    towards uniform by the noise. Members may repeat.

    Args:
        odds: the network's conditionals.
        teams: (K, T), all with the same number of OPEN places.
        noise: (N,) in [0, 1].
        rng: the only source of chance.
    """
    teams = teams.copy()
    rows = np.arange(len(teams))
    for _ in range(int((teams == OPEN).sum(axis=1).max(initial=0))):
        place = np.where(teams == OPEN, rng.random(teams.shape), -1.0).argmax(axis=1)
        partial, which = np.unique(teams, axis=0, return_inverse=True)  # at first all teams are alike
        chances = odds(partial)[which.reshape(-1), place]  # (K, N)
        teams[rows, place] = drawn(towards_uniform(chances, noise), rng)
    return teams
