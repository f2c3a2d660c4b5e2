"""Every team against every other, from both sides and in every order of the members."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.games import Games, pairings
from berteam_cli.outcomes import Floats, Ints, Outcomes
from berteam_cli.rating.bradley_terry import ratings

BATCH = 20_000  # games played between two looks at the clock


@dataclass(frozen=True)
class Standings:
    """What came of a tournament of K teams.

    Attributes:
        teams: (K, T).
        elos: (K,) with mean 1000.
        half_widths: (K,) of their 95 % intervals.
        results: (2, 3, K, K) games that row won, drew and lost against column, as side 0 and as side 1.
        outcomes: of all games.
    """

    teams: Ints
    elos: Floats
    half_widths: Floats
    results: Ints
    outcomes: Outcomes


def tournament(games: Games, policies: Policies, teams: Ints, games_per_pair: int, seed: int) -> Standings:
    """Returns the standings after every pair of ``teams`` has played ``games_per_pair`` games.

    Args:
        games: the game and its threads.
        policies: how the members act.
        teams: (K, T), K >= 2.
        games_per_pair: half of them, rounded up, with the team of the smaller index as side 0.
        seed: of the policies that act at random and, where not all are played, of the orders of the members.
    """
    rng = np.random.default_rng(seed)
    first, second = np.triu_indices(len(teams), 1)
    ours, theirs = schedule(teams, first, second, games_per_pair, rng)
    swapped = np.tile(np.arange(games_per_pair) % 2 == 1, len(first))
    blue = np.where(swapped[:, np.newaxis], theirs, ours)
    red = np.where(swapped[:, np.newaxis], ours, theirs)
    outcomes, _ = games.play(policies, pairings(blue, red), int(rng.integers(2**63)))

    results = np.zeros((2, 3, len(teams), len(teams)), dtype=np.int64)
    of_game = np.repeat(np.arange(len(first)), games_per_pair)
    i, j = first[of_game], second[of_game]
    ours_scored = np.where(swapped, outcomes.scores[:, 1], outcomes.scores[:, 0])
    lost = np.rint(2 * (1 - ours_scored)).astype(int)  # 0 won, 1 drawn, 2 lost
    np.add.at(results, (swapped.astype(int), lost, i, j), 1)
    np.add.at(results, (1 - swapped.astype(int), 2 - lost, j, i), 1)
    won, drawn, _ = results.sum(axis=0)
    elos, half_widths = ratings(won + 0.5 * drawn, results.sum(axis=(0, 1)).astype(float))
    return Standings(teams, elos, half_widths, results, outcomes)


def schedule(teams: Ints, first: Ints, second: Ints, games_per_pair: int, rng: Generator) -> tuple[Ints, Ints]:
    """Returns the line-ups of both teams in all games, (B, T) each: ``games_per_pair`` games of a pair in a row.

    The members of both teams stand in every order in turn, each for one game from either side; where there are more
    orders than games, an order is drawn for each two games.
    """
    size = teams.shape[1]
    in_turn = -(-games_per_pair // 2)
    if factorial_pairs(size) <= in_turn:
        orders = np.array(list(product(permutations(range(size)), repeat=2)))
        chosen = np.broadcast_to(orders[np.arange(in_turn) % len(orders)], (len(first), in_turn, 2, size))
    else:
        chosen = rng.permuted(np.broadcast_to(np.arange(size), (len(first), in_turn, 2, size)), axis=3)
    chosen = np.repeat(chosen, 2, axis=1)[:, :games_per_pair]
    ours = np.take_along_axis(np.repeat(teams[first][:, np.newaxis], games_per_pair, axis=1), chosen[:, :, 0], axis=2)
    theirs = np.take_along_axis(np.repeat(teams[second][:, np.newaxis], games_per_pair, axis=1), chosen[:, :, 1], 2)
    return ours.reshape(-1, size), theirs.reshape(-1, size)


def factorial_pairs(size: int) -> float:
    """Returns in how many orders two teams of ``size`` can stand; above 12 places infinitely many will do."""
    return float(np.prod(np.arange(1, size + 1)) ** 2) if size <= 12 else np.inf
