"""Every team against every other, from all sides and in every order of the members."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.games import Games, arrangements, placed
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
        results: (S, 3, K, K) games that row won, drew and lost against column, standing alone on each side; of two
            sides both teams stand alone.
        outcomes: of all games.
    """

    teams: Ints
    elos: Floats
    half_widths: Floats
    results: Ints
    outcomes: Outcomes

    @property
    def record(self) -> Ints:
        """(3, K, K) games that row won, drew and lost against column, alone or on all sides but one."""
        alone = self.results.sum(axis=0)
        if len(self.results) == 2:
            return alone
        return alone + alone[::-1].transpose(0, 2, 1)


def tournament(games: Games, policies: Policies, teams: Ints, games_per_pair: int, seed: int) -> Standings:
    """Returns the standings after every pair of ``teams`` has played ``games_per_pair`` games.

    In a game of more than two sides one team of the pair stands alone, and copies of the other on all other sides.

    Args:
        games: the game and its threads.
        policies: how the members act.
        teams: (K, T), K >= 2.
        games_per_pair: in turn as ``games.arrangements`` says, the team of the smaller index alone on side 0 first.
        seed: of the policies that act at random and, where not all are played, of the orders of the members.
    """
    sides = games.env.sides
    rng = np.random.default_rng(seed)
    ways = arrangements(sides)
    first, second = np.triu_indices(len(teams), 1)
    ours, theirs = schedule(teams, first, second, games_per_pair, len(ways), rng)
    held = np.tile(ways[np.arange(games_per_pair) % len(ways)], (len(first), 1))
    outcomes, _ = games.play(policies, placed(ours, theirs, held), int(rng.integers(2**63)))

    results = np.zeros((sides, 3, len(teams), len(teams)), dtype=np.int64)
    points = np.zeros((len(teams), len(teams)))
    of_game = np.repeat(np.arange(len(first)), games_per_pair)
    for row, column, ours_held in ((first, second, held), (second, first, ~held)):
        alone = np.flatnonzero(ours_held.sum(axis=1) == 1)
        side = ours_held[alone].argmax(axis=1)
        scored = outcomes.scores[alone, side]
        result = np.where(scored == 1.0, 0, np.where(scored > 0.0, 1, 2))  # won, drawn, lost
        i, j = row[of_game[alone]], column[of_game[alone]]
        np.add.at(results, (side, result, i, j), 1)
        np.add.at(points, (i, j), scored)
    elos, half_widths = ratings(points, results.sum(axis=(0, 1)).astype(float), math.log(sides - 1))
    return Standings(teams, elos, half_widths, results, outcomes)


def schedule(
    teams: Ints, first: Ints, second: Ints, games_per_pair: int, ways: int, rng: Generator
) -> tuple[Ints, Ints]:
    """Returns the line-ups of both teams in all games, (B, T) each: ``games_per_pair`` games of a pair in a row.

    The members of both teams stand in every order in turn, each for one game in each of so many ``ways`` to hold the
    sides; where there are more orders than that makes, an order is drawn for each time.
    """
    size = teams.shape[1]
    in_turn = -(-games_per_pair // ways)
    if factorial_pairs(size) <= in_turn:
        orders = np.array(list(product(permutations(range(size)), repeat=2)))
        chosen = np.broadcast_to(orders[np.arange(in_turn) % len(orders)], (len(first), in_turn, 2, size))
    else:
        chosen = rng.permuted(np.broadcast_to(np.arange(size), (len(first), in_turn, 2, size)), axis=3)
    chosen = np.repeat(chosen, ways, axis=1)[:, :games_per_pair]
    ours = np.take_along_axis(np.repeat(teams[first][:, np.newaxis], games_per_pair, axis=1), chosen[:, :, 0], axis=2)
    theirs = np.take_along_axis(np.repeat(teams[second][:, np.newaxis], games_per_pair, axis=1), chosen[:, :, 1], 2)
    return ours.reshape(-1, size), theirs.reshape(-1, size)


def factorial_pairs(size: int) -> float:
    """Returns in how many orders two teams of ``size`` can stand; above 12 places infinitely many will do."""
    return float(np.prod(np.arange(1, size + 1)) ** 2) if size <= 12 else np.inf
