"""Every team against every other, from all sides and in every order of the members."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import permutations, product

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.games import Games, arrangements, placed
from berteam_cli.outcomes import Bools, Floats, Ints, Lineups, Outcomes
from berteam_cli.rating.bradley_terry import ratings


@dataclass(frozen=True)
class Standings:
    """What came of a tournament of K teams.

    Attributes:
        teams: (K, T).
        elos: (K,) with mean 1000.
        points: (K, K) that row made against column, standing alone; of two sides both teams stand alone.
        results: (S, 3, K, K) games that row won, drew and lost against column, standing alone on each side.
        pairs: (B, 2) whose game each was, the team of the smaller index first.
        first_held: (B, S) the sides where that one stood.
        outcomes: of all B games.
    """

    teams: Ints
    elos: Floats
    points: Floats
    results: Ints
    pairs: Ints
    first_held: Bools
    outcomes: Outcomes

    @property
    def record(self) -> Ints:
        """(3, K, K) games that row won, drew and lost against column, alone or on all sides but one."""
        alone = self.results.sum(axis=0)
        if len(self.results) == 2:
            return alone
        return alone + alone[::-1].transpose(0, 2, 1)

    @property
    def games(self) -> Ints:
        """(K, K) games in which row stood alone against column."""
        return self.results.sum(axis=(0, 1))


@dataclass(frozen=True)
class Plan:
    """Games to play.

    Attributes:
        lineups: of B games.
        pairs: (B, 2) indices of the two teams of each.
        first_held: (B, S) the sides where the first one stands.
    """

    lineups: Lineups
    pairs: Ints
    first_held: Bools


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
    rng = np.random.default_rng(seed)
    plan = planned(games.env.sides, teams, np.triu_indices(len(teams), 1), games_per_pair, rng)
    outcomes, _ = games.play(policies, plan.lineups, int(rng.integers(2**63)))
    return counted(teams, plan, outcomes)


def planned(sides: int, teams: Ints, pairs: tuple[Ints, Ints], games_per_pair: int, rng: Generator) -> Plan:
    """Returns ``games_per_pair`` games in a row of each of ``pairs`` of ``teams``; ``rng`` draws orders of members."""
    ways, (first, second) = arrangements(sides), pairs
    ours, theirs = schedule(teams, first, second, games_per_pair, len(ways), rng)
    held = np.tile(ways[np.arange(games_per_pair) % len(ways)], (len(first), 1))
    return Plan(placed(ours, theirs, held), np.repeat(np.stack([first, second], axis=1), games_per_pair, axis=0), held)


def counted(teams: Ints, plan: Plan, outcomes: Outcomes) -> Standings:
    """Returns the standings of ``teams`` (K, T) after the games of ``plan``."""
    sides = outcomes.scores.shape[1]
    results = np.zeros((sides, 3, len(teams), len(teams)), dtype=np.int64)
    points = np.zeros((len(teams), len(teams)))
    for (row, column), held in ((plan.pairs.T, plan.first_held), (plan.pairs.T[::-1], ~plan.first_held)):
        alone = np.flatnonzero(held.sum(axis=1) == 1)
        side = held[alone].argmax(axis=1)
        scored = outcomes.scores[alone, side]
        result = np.where(scored == 1.0, 0, np.where(scored > 0.0, 1, 2))  # won, drawn, lost
        np.add.at(results, (side, result, row[alone], column[alone]), 1)
        np.add.at(points, (row[alone], column[alone]), scored)
    elos, _ = ratings(points, results.sum(axis=(0, 1)).astype(float), math.log(sides - 1))
    return Standings(teams, elos, points, results, plan.pairs, plan.first_held, outcomes)


def schedule(
    teams: Ints, first: Ints, second: Ints, games_per_pair: int, ways: int, rng: Generator
) -> tuple[Ints, Ints]:
    """Returns the line-ups of both teams in all games, (B, T) each: ``games_per_pair`` games of a pair in a row.

    The members of both teams stand in every order in turn, each for one game in each of so many ``ways`` to hold the
    sides. What is left of a round of all orders goes to some of them, drawn for each pair: the same ones for all would
    count for more in every score. Where there are more orders than games, an order is drawn for each time.
    """
    size = teams.shape[1]
    in_turn = -(-games_per_pair // ways)
    if factorial_pairs(size) <= in_turn:
        orders = np.array(list(product(permutations(range(size)), repeat=2)))
        whole = in_turn - in_turn % len(orders)
        turns = np.broadcast_to(np.arange(in_turn) % len(orders), (len(first), in_turn))
        if whole < in_turn:
            drawn = rng.permuted(np.broadcast_to(np.arange(len(orders)), (len(first), len(orders))), axis=1)
            turns = np.concatenate([turns[:, :whole], drawn[:, : in_turn - whole]], axis=1)
        chosen = orders[turns]
    else:
        chosen = rng.permuted(np.broadcast_to(np.arange(size), (len(first), in_turn, 2, size)), axis=3)
    chosen = np.repeat(chosen, ways, axis=1)[:, :games_per_pair]
    ours = np.take_along_axis(np.repeat(teams[first][:, np.newaxis], games_per_pair, axis=1), chosen[:, :, 0], axis=2)
    theirs = np.take_along_axis(np.repeat(teams[second][:, np.newaxis], games_per_pair, axis=1), chosen[:, :, 1], 2)
    return ours.reshape(-1, size), theirs.reshape(-1, size)


def plays_every_order(sides: int, teams: Ints, games_per_pair: int) -> bool:
    """Returns whether so many games a pair have the members of ``teams`` (K, T) in every order, from every side, alike.

    Then games without chance tell what a pair scores for good: each of those there are is played equally often.
    """
    return games_per_pair % (factorial_pairs(teams.shape[1]) * len(arrangements(sides))) == 0


def factorial_pairs(size: int) -> float:
    """Returns in how many orders two teams of ``size`` can stand; above 12 places infinitely many will do."""
    return float(np.prod(np.arange(1, size + 1)) ** 2) if size <= 12 else np.inf
