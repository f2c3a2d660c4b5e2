"""Solutions of a symmetric zero-sum game, given what every pure strategy wins from every other."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from berteam_cli.outcomes import Floats


def nash(payoff: Floats) -> Floats:
    """Returns (K,) a Nash equilibrium, by the linear programme max v with x^T payoff >= v, x a distribution.

    Args:
        payoff: (K, K) antisymmetric, what the row wins from the column.
    """
    size = len(payoff)
    above = np.hstack([-payoff.T, np.ones((size, 1))])  # v - (x^T payoff)_j <= 0
    solved = linprog(
        np.append(np.zeros(size), -1.0),
        A_ub=above,
        b_ub=np.zeros(size),
        A_eq=np.append(np.ones(size), 0.0)[np.newaxis],
        b_eq=[1.0],
        bounds=[(0, None)] * size + [(None, None)],
        method="highs",
    )
    strategy = np.maximum(solved.x[:size], 0.0)  # rounding
    return strategy / strategy.sum()


def projected_replicator(payoff: Floats, exploration: float, steps: int = 500, rate: float = 0.2) -> Floats:
    """Returns (K,) the mean over the path of projected replicator dynamics (Lanctot et al. 2017, PSRO).

    From equal chances x <- P[x + rate x (payoff x - x^T payoff x)], where P finds the nearest distribution that gives
    no strategy less than exploration / K. The path circles an equilibrium; its mean comes close to it.

    Args:
        payoff: (K, K) antisymmetric, what the row wins from the column.
        exploration: gamma in [0, 1].
        steps: how many.
        rate: of a step.
    """
    size = len(payoff)
    least = exploration / size
    strategy = np.full(size, 1 / size)
    total = np.zeros(size)
    for _ in range(steps):
        wins = payoff @ strategy
        strategy = strategy + rate * strategy * (wins - strategy @ wins)
        if strategy.min() < least:
            strategy = least + nearest(strategy - least, 1.0 - exploration)
        strategy /= strategy.sum()  # rounding
        total += strategy
    return total / steps


def nearest(point: Floats, total: float) -> Floats:
    """Returns (K,) what lies nearest to ``point`` of all that is not negative and sums to ``total``."""
    falling = np.sort(point)[::-1]
    surplus = (np.cumsum(falling) - total) / np.arange(1, len(point) + 1)
    last = np.flatnonzero(falling - surplus >= 0)[-1]
    return np.maximum(point - surplus[last], 0.0)


def exploitability(strategy: Floats, payoff: Floats) -> float:
    """Returns how much the best answer wins from ``strategy``; 0 for a Nash equilibrium."""
    return float((payoff @ strategy).max())
