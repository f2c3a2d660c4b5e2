"""Elos as the paper's code computes them, for comparison with its tables; use maximum likelihood for anything else.

``online_elos`` weighs the last games most, so that the order of games changes ranks. ``squared_error_elos`` weighs each
pair the same, whether it met once or a thousand times; it minimises an error whose slope vanishes where a team always
wins, and stops early, so that the Elos of very strong and very weak teams depend on how long it ran. Neither tells how
sure it is.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.rating.bradley_terry import expected
from berteam_cli.rating.elo import POINTS_PER_NAT, points

K_FACTOR = 32.0  # points that an upset moves, as in chess
RATE, STEPS, ARRIVED_ELO = 0.01, 1000, 1e-3  # of Adam in the paper's code
BETAS, EPSILON = (0.9, 0.999), 1e-8


def online_elos(players: int, games: Iterable[tuple[int, int, float]]) -> Floats:
    """Returns (K,) Elos with mean 1000 after one game after the other; their order matters.

    Args:
        players: K.
        games: who met whom, and what the former made.
    """
    elos = np.zeros(players)
    for one, other, scored in games:
        move = K_FACTOR * (scored - float(expected(elos[one] / POINTS_PER_NAT, elos[other] / POINTS_PER_NAT)))
        elos[one] += move
        elos[other] -= move
    return 1000 + elos - elos.mean()


def squared_error_elos(scores: Floats, games: Floats) -> Floats:
    """Returns (K,) Elos with mean 1000 whose expected scores are nearest the mean scores, over pairs, by Adam.

    Args:
        scores: (K, K) points row made against column.
        games: (K, K) those games; pairs that did not meet do not count.
    """
    met = (games > 0) & ~np.eye(len(games), dtype=bool)
    mean = np.divide(scores, games, where=met, out=np.full(games.shape, 0.5))
    strengths, momentum, second = np.zeros((3, len(games)))
    for step in range(1, STEPS + 1):
        chance = expected(strengths[:, np.newaxis], strengths)
        # Of the mean over pairs, each with both sides' errors, which are equal.
        slope = 2 * (met * (chance - mean) * chance * (1 - chance)).sum(axis=1) / max(1, met.sum() / 2)
        momentum = BETAS[0] * momentum + (1 - BETAS[0]) * slope
        second = BETAS[1] * second + (1 - BETAS[1]) * slope**2
        size = np.sqrt(second / (1 - BETAS[1] ** step)) + EPSILON
        move = RATE * momentum / (1 - BETAS[0] ** step) / size
        strengths -= move
        if np.abs(move).mean() * POINTS_PER_NAT <= ARRIVED_ELO:
            break
    return np.asarray(points(strengths - strengths.mean()))


def in_order(pairs: Ints, scored: Floats) -> list[tuple[int, int, float]]:
    """Returns the games of ``online_elos`` from (B, 2) ``pairs`` and what the first of each made, (B,)."""
    return [(int(i), int(j), float(x)) for (i, j), x in zip(pairs, scored, strict=True)]
