"""Fills teams, one place after the other; paper, Section 3, "Transformer based Sequence Completion"."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Bools, Floats, Ints


class Odds(Protocol):
    """Chances of each member at the places of partial teams."""

    def __call__(self, teams: Ints, known: Ints, places: Ints | None = None) -> Floats:
        """Returns (K, T, N) chances of each member at each place, or (K, N) at one place of each team.

        Args:
            teams: (K, T), OPEN where nobody stands yet.
            known: (K,) index of what else is known for each team: the side it plays, or what was seen of its opponent.
            places: (K,) the place asked about; None for all.
        """


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


def within(odds: Floats, allowed: Bools) -> Floats:
    """Returns ``odds``, (..., T, N), with nothing for members who may not stand at a place, and normalised.

    Args:
        odds: chances of the members.
        allowed: (T, N), or of the shape of ``odds``, who may stand at each place, at least one member for each.
    """
    if allowed.all():
        return odds
    # However unthinkable all who may stand there are, one of them will.
    kept = np.where(allowed, np.maximum(odds, np.finfo(np.float64).tiny), 0.0)
    return kept / kept.sum(axis=-1, keepdims=True)


def proposal(odds: Odds, noise: Floats, allowed: Bools) -> Odds:
    """Returns the conditionals that teams are truly drawn from: with noise for new members, and within the rules.

    Args:
        odds: the network's.
        noise: (N,) in [0, 1].
        allowed: (T, N).
    """

    def proposed(teams: Ints, known: Ints, places: Ints | None = None) -> Floats:
        there = allowed if places is None else allowed[places]
        return within(towards_uniform(odds(teams, known, places), noise), there)

    return proposed


def sharpened(odds: Odds, power: float) -> Odds:
    """Returns ``odds`` with every chance to a ``power``, > 0, and normalised; 1 changes nothing."""

    def sharp(teams: Ints, known: Ints, places: Ints | None = None) -> Floats:
        chances = odds(teams, known, places)
        chances = (chances / chances.max(axis=-1, keepdims=True)) ** power  # else all may be too small for a float
        return chances / chances.sum(axis=-1, keepdims=True)

    return odds if power == 1 else sharp


def drawn(chances: Floats, rng: Generator) -> Ints:
    """Returns (K,) one column of each row of ``chances``, (K, C), drawn in proportion to them."""
    reached = np.cumsum(chances, axis=1)
    reached /= reached[:, -1:]  # ends at exactly 1, so a draw in [0, 1) always finds a column
    return (reached > rng.random((len(chances), 1))).argmax(axis=1)


def filled(odds: Odds, teams: Ints, known: Ints, rng: Generator) -> Ints:
    """Returns ``teams`` with every OPEN place filled, one place of each team at a time.

    Each time an open place is chosen uniformly and its member drawn from the conditional there. Members may repeat.

    Args:
        odds: what to draw from.
        teams: (K, T), all with the same number of OPEN places.
        known: (K,) as of Odds.
        rng: the only source of chance.
    """
    teams = teams.copy()
    rows = np.arange(len(teams))
    for _ in range(int((teams == OPEN).sum(axis=1).max(initial=0))):
        place = np.where(teams == OPEN, rng.random(teams.shape), -1.0).argmax(axis=1)
        # At first all teams are alike; the place stands before the team, for distinct rows of both.
        asked, sources, which = distinct_rows(np.column_stack([place, teams]), known)
        chances = odds(np.ascontiguousarray(asked[:, 1:]), sources, asked[:, 0])
        teams[rows, place] = drawn(chances[which], rng)
    return teams


def distinct_rows(teams: Ints, known: Ints) -> tuple[Ints, Ints, Ints]:
    """Returns the distinct rows of ``teams``, (K, T), with their ``known``, and (K,) which of them each row is."""
    unique, which = np.unique(np.column_stack([known, teams]), axis=0, return_inverse=True)
    return np.ascontiguousarray(unique[:, 1:]), unique[:, 0].copy(), which.reshape(-1)
