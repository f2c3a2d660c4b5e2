"""How likely teams are: sums over all orders in which their places can be filled.

A partly filled team is reached in many orders but looks the same to the network after each of them, so the sums
run over partial teams instead of orders. Where even those are too many, the sum is estimated from some of the orders.
"""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Floats, Ints
from berteam_cli.selector.base import Field, orderings, unordered_teams
from berteam_cli.selector.filling import Odds, distinct_rows, drawn

LARGEST_SUMMED = 8  # T; the exact chance of one team is a sum over 2^T partial teams
LARGEST_ARRANGED = 4  # T; that of an unordered one is a sum over T! arrangements, unless all places are alike
ORDERS = 16  # fill orders that stand for all T! of a larger team
ROWS = 2048  # partial teams asked about at once


def log_chances(odds: Odds, teams: Ints, known: Ints, opening: Floats) -> Floats:
    """Returns (K,) ln of the chance of each of ``teams``, over all captains it could have and all fill orders.

    reach({i}) = opening[i, A_i]; reach(F + i) = sum over F of reach(F) p(A_i at i | A_F) / places open in F.

    Args:
        odds: what all places but the captain's are drawn from.
        teams: (K, T) ordered, no place OPEN.
        known: (K,) as of Odds.
        opening: (U, T, N) chance that the captain stands at a place and is a member, for each known thing.
    """
    size = teams.shape[1]
    places = np.arange(size)
    reach = np.zeros((2**size, len(teams)))  # bit i of the row: place i is filled
    reach[1 << places] = opening[known[:, np.newaxis], places, teams].T
    for count in range(1, size):
        subsets = np.array(list(combinations(range(size), count)))  # (C, count)
        inside = (subsets[:, :, np.newaxis] == places).any(axis=1)  # (C, T)
        partial = np.where(inside[:, np.newaxis], teams, OPEN)  # (C, K, T)
        unique, sources, which = distinct_rows(partial.reshape(-1, size), np.tile(known, len(subsets)))
        chances = odds(unique, sources)
        step = chances[which.reshape(len(subsets), len(teams), 1), places, teams] / (size - count)  # (C, K, T)
        for c, row in enumerate((1 << subsets).sum(axis=1)):
            for i in np.flatnonzero(~inside[c]):
                reach[row | 1 << i] += reach[row] * step[c, :, i]
    with np.errstate(divide="ignore"):  # what the rules forbid has the chance 0
        return np.log(reach[-1])


def in_some_orders(odds: Odds, teams: Ints, known: Ints, opening: Floats, orders: int, rng: Generator) -> Floats:
    """Returns (R, K) ln of estimates of the chance of each of ``teams``, one from each of R random fill orders.

    Each is T opening[i, A_i] times the product of the conditionals along one order that begins at place i; their mean
    over all orders is the chance that ``log_chances`` sums exactly.

    Args:
        odds: as of ``log_chances``.
        teams: as there.
        known: as there.
        opening: as there.
        orders: R.
        rng: draws the orders.
    """
    size = teams.shape[1]
    teams, known = np.tile(teams, (orders, 1)), np.tile(known, orders)
    order = rng.permuted(np.tile(np.arange(size), (len(teams), 1)), axis=1)
    rows, first = np.arange(len(teams)), order[:, 0]
    log_chance = np.log(size * opening[known, first, teams[rows, first]])
    partial = np.full_like(teams, OPEN)
    for step in range(1, size):
        before, place = order[:, step - 1], order[:, step]
        partial[rows, before] = teams[rows, before]
        for begin in range(0, len(teams), ROWS):
            part = rows[begin : begin + ROWS]
            asked = odds(partial[part], known[part], place[part])
            log_chance[part] += np.log(asked[np.arange(len(part)), teams[part, place[part]]])
    return log_chance.reshape(orders, -1)


def estimated_log_chances(odds: Odds, teams: Ints, known: Ints, opening: Floats, rng: Generator) -> Floats:
    """Returns (K,) ln of the mean chance along ORDERS fill orders: what ``log_chances`` is for teams too large for it.

    The mean is unbiased; its inverse, a weight, is somewhat too large in the mean.
    """
    along = in_some_orders(odds, teams, known, opening, ORDERS, rng)
    return np.logaddexp.reduce(along, axis=0) - np.log(ORDERS)


def unordered_chances(
    odds: Odds, teams: Ints, source: int, rng: Generator, *, exchangeable: bool
) -> tuple[Floats, Floats]:
    """Returns (K,) chances of unordered ``teams``, (K, T) ascending, and their standard errors, 0 where exact.

    Args:
        odds: what all places are drawn from.
        teams: the teams.
        source: what is known for all of them, as of Odds.
        rng: for the estimate where the orders are too many.
        exchangeable: whether ``odds`` does not tell places apart.
    """
    count, size = teams.shape
    known = np.full(count, source)
    opening = from_nobody(odds, size, source)
    if size <= LARGEST_SUMMED and (exchangeable or size <= LARGEST_ARRANGED):
        arrangements = [tuple(range(size))] if exchangeable else list(permutations(range(size)))
        chance = np.zeros(count)
        for order in arrangements:
            chance += np.exp(log_chances(odds, teams[:, order], known, opening))
        return chance * orderings(teams) / len(arrangements), np.zeros(count)
    along = np.exp([log_chance_on_the_way(odds, teams, known, rng) for _ in range(4 * ORDERS)])
    return along.mean(axis=0), along.std(axis=0, ddof=1) / np.sqrt(len(along))


def log_chance_on_the_way(odds: Odds, teams: Ints, known: Ints, rng: Generator) -> Floats:
    """Returns (K,) ln of an estimate of the chance of each of the unordered ``teams``, from filling it once.

    The places are filled in a random order, each with one of the members of the team that are left, drawn in proportion
    to their conditionals there. The product of the sums of those conditionals is right in the mean (sequential
    importance sampling), and varies little where the network knows which member belongs where.

    Args:
        odds: what all places are drawn from.
        teams: (K, T) members in ascending order.
        known: (K,) as of Odds.
        rng: the only source of chance.
    """
    count, size = teams.shape
    rows, same = np.arange(count), teams[:, :, np.newaxis] == teams[:, np.newaxis]
    order = rng.permuted(np.tile(np.arange(size), (count, 1)), axis=1)
    left, partial, log_chance = np.ones((count, size), dtype=np.bool_), np.full_like(teams, OPEN), np.zeros(count)
    for step in range(size):
        place = order[:, step]
        chances = np.empty((count, size))
        for begin in range(0, count, ROWS):
            part = rows[begin : begin + ROWS]
            asked = odds(partial[part], known[part], place[part])
            chances[part] = np.take_along_axis(asked, teams[part], axis=1)
        copies = (same & left[:, np.newaxis]).sum(axis=2)  # a member that is left twice is one choice
        chances = np.where(left, chances / np.maximum(copies, 1), 0.0)
        with np.errstate(divide="ignore"):  # the members that are left may all be forbidden there
            log_chance += np.log(chances.sum(axis=1))
        chosen = drawn(np.maximum(chances, left * np.finfo(np.float64).tiny), rng)
        partial[rows, place] = teams[rows, chosen]
        left[rows, chosen] = False
    return log_chance


def from_nobody(odds: Odds, size: int, source: int) -> Floats:
    """Returns (U, T, N) the opening of teams whose every place is drawn from ``odds``; only row ``source`` counts."""
    first = odds(np.full((1, size), OPEN), np.array([source])) / size
    return np.broadcast_to(first, (source + 1, *first.shape[1:]))


def total_distribution(odds: Odds, field: Field, source: int, *, exchangeable: bool) -> Floats:
    """Returns (K,) the chance of every team of ``unordered_teams``, all places filled from nobody.

    reach(nobody) = 1; reach(A + (i, a)) += reach(A) p(a at i | A) / places open in A. The paper calls it the total
    distribution.

    Args:
        odds: what all places are drawn from.
        field: N and T.
        source: what is known for all teams, as of Odds.
        exchangeable: whether ``odds`` does not tell places apart; then partial teams are merged over the places
            too, which leaves far fewer of them.
    """
    members, team_size = field.members, field.team_size
    teams, reach = partial_teams(members, team_size, 0, exchangeable), np.ones(1)
    for count in range(1, team_size + 1):
        merged = exchangeable or count == team_size  # a full team is the same in every order
        larger = partial_teams(members, team_size, count, merged)
        codes, grown = code(larger, members), np.zeros(len(larger))
        teams, reach = teams[reach > 0], reach[reach > 0]  # nobody asks about teams that cannot come about
        for first in range(0, len(teams), ROWS):
            rows = slice(first, first + ROWS)
            known = np.full(len(teams[rows]), source)
            flow = reach[rows, np.newaxis, np.newaxis] * odds(teams[rows], known) / (team_size - count + 1)
            for i in range(team_size):
                open_ = teams[rows, i] == OPEN
                after = np.repeat(teams[rows][open_, np.newaxis], members, axis=1)  # (R, N, T)
                after[:, :, i] = np.arange(members)
                after = np.sort(after, axis=-1) if merged else after
                where = np.searchsorted(codes, code(after, members)).ravel()
                grown += np.bincount(where, weights=flow[open_, i].ravel(), minlength=len(grown))
        teams, reach = larger, grown
    return reach


def partial_teams(members: int, team_size: int, count: int, merged: bool) -> Ints:
    """Returns (K, T) all teams with ``count`` places filled, in the order of their codes.

    ``merged`` teams are ascending with their OPEN places in front, and stand for all that have the same members.
    """
    if merged or count == 0:
        teams = unordered_teams(members, count)
        return np.pad(teams, ((0, 0), (team_size - count, 0)), constant_values=OPEN)
    who = np.indices((members,) * count).reshape(count, -1).T
    blocks = []
    for places in combinations(range(team_size), count):
        block = np.full((len(who), team_size), OPEN)
        block[:, places] = who
        blocks.append(block)
    teams = np.concatenate(blocks)
    return teams[np.argsort(code(teams, members))]


def code(teams: Ints, members: int) -> Ints:
    """Returns (...,) one number for each of ``teams``, (..., T), that orders them lexicographically."""
    number = np.zeros(teams.shape[:-1], dtype=np.int64)
    for place in range(teams.shape[-1]):
        number = number * (members + 1) + teams[..., place] - OPEN
    return number
