"""How likely teams are, exactly: sums over all orders in which their places can be filled.

A partly filled team is reached in many orders but looks the same to the network after each of them, so the sums
run over partial teams instead of orders.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from berteam_cli.outcomes import OPEN, Floats, Ints
from berteam_cli.selector.base import unordered_teams
from berteam_cli.selector.filling import towards_uniform
from berteam_cli.selector.network import ROWS, Odds


def log_chances(odds: Odds, teams: Ints, opening: Floats, noise: Floats) -> Floats:
    """Returns (K,) ln of the chance of each of ``teams``, over all captains it could have and all fill orders.

    reach({i}) = opening[i, A_i]; reach(F + i) = sum over F of reach(F) p'(A_i at i | A_F) / places open in F.

    Args:
        odds: the network's conditionals.
        teams: (K, T) ordered, no place OPEN.
        opening: (T, N) chance that the captain stands at a place and is a member.
        noise: (N,) in [0, 1], moves the conditionals of all places after the captain's.
    """
    size = teams.shape[1]
    places = np.arange(size)
    reach = np.zeros((2**size, len(teams)))  # bit i of the row: place i is filled
    reach[1 << places] = opening[places, teams].T
    for count in range(1, size):
        subsets = np.array(list(combinations(range(size), count)))  # (C, count)
        inside = (subsets[:, :, np.newaxis] == places).any(axis=1)  # (C, T)
        partial = np.where(inside[:, np.newaxis], teams, OPEN)  # (C, K, T)
        unique, which = np.unique(partial.reshape(-1, size), axis=0, return_inverse=True)
        chances = towards_uniform(odds(unique), noise)
        step = chances[which.reshape(len(subsets), len(teams), 1), places, teams] / (size - count)  # (C, K, T)
        for c, row in enumerate((1 << subsets).sum(axis=1)):
            for i in np.flatnonzero(~inside[c]):
                reach[row | 1 << i] += reach[row] * step[c, :, i]
    return np.log(reach[-1])


def total_distribution(odds: Odds, members: int, team_size: int, *, exchangeable: bool) -> Floats:
    """Returns (K,) the chance of every team of ``unordered_teams``, all places filled without noise.

    reach(nobody) = 1; reach(A + (i, a)) += reach(A) p(a at i | A) / places open in A. The paper calls it the total
    distribution.

    Args:
        odds: the network's conditionals.
        members: N.
        team_size: T.
        exchangeable: whether ``odds`` does not tell places apart; then partial teams are merged over the places
            too, which leaves far fewer of them.
    """
    teams, reach = partial_teams(members, team_size, 0, exchangeable), np.ones(1)
    for count in range(1, team_size + 1):
        merged = exchangeable or count == team_size  # a full team is the same in every order
        larger = partial_teams(members, team_size, count, merged)
        codes, grown = code(larger, members), np.zeros(len(larger))
        for first in range(0, len(teams), ROWS):
            rows = slice(first, first + ROWS)
            flow = reach[rows, np.newaxis, np.newaxis] * odds(teams[rows]) / (team_size - count + 1)
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
