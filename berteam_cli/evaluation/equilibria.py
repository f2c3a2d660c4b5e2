"""Where choosing among teams ends, computed from their payoff matrix: what runs are compared with.

Matrices are (K, K), row against column; strategies are (K,), not negative, with sum 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog, minimize
from scipy.special import logsumexp, softmax

from berteam_cli.outcomes import Bools, Floats

PRECISE = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
TIGHT = 1e-13  # largest change of a probability at which an iteration has arrived
LOOSE = 1e-9  # what linear programmes leave of a constraint
ITERATIONS = 200_000  # at most
SETTLED = 1e-6  # how far short of the value the strategy of highest entropy may fall


def fixed_point(wins: Floats, orders: Floats) -> Floats:
    """Returns D proportional to orders * W_D, with W_D(A) = sum over B of D(B) wins[A, B].

    It is where masked language modelling on winners ends that are weighted by the inverse of their chance to be chosen
    (paper, Appendix D): each ordered team gets a probability proportional to how often it wins against a team of the
    same distribution; draws are no wins. An unordered team has that of all its orders.

    D is an eigenvector of the largest eigenvalue of diag(orders) wins, which exists for every matrix that is not
    negative (Perron and Frobenius), and is the only one where every team wins against some team that wins against some
    team, and so on, down to every other. Else it is the one that iterating from equal chances for all ordered teams
    leads to. Where nobody ever wins, nothing is learnt and these equal chances are returned. All orders of a team are
    taken to win equally often; ``wins`` is then their mean.

    Args:
        wins: (K, K) chance that the row's team wins.
        orders: (K,) in how many orders the members of each team can stand, > 0; ones where teams are ordered.
    """
    strategy = orders / orders.sum()
    for _ in range(ITERATIONS):
        winning = orders * (wins @ strategy)
        if not winning.sum() > 0:
            return strategy
        # Half a step: a whole one goes round in circles where teams win in a circle.
        after = 0.5 * (strategy + winning / winning.sum())
        if np.abs(after - strategy).max() < TIGHT:
            return after
        strategy = after
    return strategy


def replicator(wins: Floats, start: Floats, steps: int) -> Floats:
    """Returns (steps + 1, K) the path of D_{k+1} proportional to D_k W_{D_k}, which begins with ``start``.

    It is what masked language modelling on winners without weights follows: the discrete replicator dynamics, which
    sharpens. Orders of members do not matter to it. Where nobody that is left ever wins, it stays.
    """
    path = np.empty((steps + 1, len(start)))
    path[0] = start
    for k in range(steps):
        winning = path[k] * (wins @ path[k])
        total = winning.sum()
        path[k + 1] = winning / total if total > 0 else path[k]
    return path


ONLY, HIGHEST_ENTROPY, WIDEST = "the only one", "the one of highest entropy", "one of the widest support"


@dataclass(frozen=True)
class Equilibrium:
    """The row player's best mix in a zero-sum game.

    Attributes:
        strategy: (K,) that guarantees most.
        value: what it guarantees.
        which: of all such strategies, ONLY, HIGHEST_ENTROPY or, where that one was not found, WIDEST.
    """

    strategy: Floats
    value: float
    which: str


def nash(payoff: Floats) -> Equilibrium:
    """Returns the strategy that guarantees the row player most in the zero-sum game ``payoff`` (rows, columns).

    By linear programmes (HiGHS): the value, then a strategy of the widest support; of those with this support the one
    of highest entropy is taken. In a game that is the negative of its transpose the value is 0.
    """
    value = 0.0 if np.array_equal(payoff, -payoff.T) else guarantee(payoff)
    margins = (payoff - value).T  # (columns, rows): over the value, against each column
    widest, equal = relative_interior(margins)
    support = widest > 0
    known = np.vstack([margins[equal][:, support], np.ones(support.sum())])
    if np.linalg.matrix_rank(known, tol=1e-7) == support.sum():
        return Equilibrium(widest, value, ONLY)
    strategy = np.zeros(len(payoff))
    strategy[support] = highest_entropy(margins[:, support], equal)
    if (margins @ strategy).min() < -SETTLED:
        return Equilibrium(widest, value, WIDEST)
    return Equilibrium(strategy, value, HIGHEST_ENTROPY)


def guarantee(payoff: Floats) -> float:
    """Returns the value of the zero-sum game ``payoff`` to its row player."""
    rows, columns = payoff.shape
    solved = programme(
        np.append(np.zeros(rows), -1.0),
        A_ub=np.hstack([-payoff.T, np.ones((columns, 1))]),
        b_ub=np.zeros(columns),
        A_eq=np.append(np.ones(rows), 0.0)[np.newaxis],
        b_eq=[1.0],
        bounds=[(0, None)] * rows + [(None, None)],
    )
    return float(solved[-1])


def relative_interior(margins: Floats) -> tuple[Floats, Bools]:
    """Returns an optimal strategy that plays all that any optimal one plays, and what holds for all of them.

    Of the multiples of optimal strategies one is found of which as many entries and margins as can be are at least 1:
    all that are positive in any (Freund, Roundy and Todd 1985).

    Args:
        margins: (columns, rows) payoff over the value.

    Returns:
        The strategy (rows,), and (columns,) against which columns every optimal strategy gets the value and no more.
    """
    columns, rows = margins.shape
    capped = rows + columns  # unknowns: t of each row and each column in [0, 1], then x, with x >= t and margin >= t
    solved = programme(
        np.concatenate([-np.ones(capped), np.zeros(rows)]),
        A_ub=np.hstack([np.eye(capped), -np.vstack([np.eye(rows), margins])]),
        b_ub=np.append(np.zeros(rows), np.full(columns, LOOSE)),
        bounds=[(0, 1)] * capped + [(0, None)] * rows,
    )
    playing = np.where(solved[:rows] > 0.5, solved[capped:], 0.0)
    return playing / playing.sum(), solved[rows:capped] < 0.5


def programme(objective: Floats, **constraints: Any) -> Floats:
    """Returns what is least by ``objective`` within ``constraints`` of scipy's linprog.

    Where HiGHS does not reach the precision that tells tight constraints from loose ones, its own has to do.

    Raises:
        ArithmeticError: there is no such thing.
    """
    choices: tuple[Any, ...] = (PRECISE, {})
    for options in choices:
        solved = linprog(objective, options=options, **constraints)
        if solved.success:
            return np.asarray(solved.x)
    raise ArithmeticError(f"no solution of a matrix game was found: {solved.message}")


def highest_entropy(margins: Floats, equal: Bools) -> Floats:
    """Returns the optimal strategy of highest entropy among those with the rows of ``margins``, by its dual.

    Args:
        margins: (columns, rows) payoff over the value.
        equal: (columns,) where the margin is 0; elsewhere it is not negative.
    """

    def dual(prices: Floats) -> tuple[float, Floats]:
        logits = prices @ margins
        return float(logsumexp(logits)), margins @ softmax(logits)

    bounds = [(None, None) if free else (0.0, None) for free in equal]
    start = np.zeros(len(margins))
    found = minimize(
        dual, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-16, "gtol": 1e-10, "maxiter": 5000}
    )
    return softmax(found.x @ margins)


def exploitability(strategy: Floats, payoff: Floats) -> float:
    """Returns what a best response gets against ``strategy`` in a game that is the negative of its transpose.

    Not negative, 0 at a Nash equilibrium: half of NashConv with both players at ``strategy``.
    """
    return max(0.0, float((payoff @ strategy).max()))


def estimated_exploitability(strategy: Floats, one: Floats, other: Floats) -> float:
    """Returns ``exploitability`` from two estimates of the payoff, whose errors have nothing to do with each other.

    Either estimate chooses a best response and the other rates it; the mean of both is returned. A response that was
    chosen for its luck has none where it is rated, so that the mean over many estimates is at most the truth, but for
    this: what is below 0, as no truth is, becomes 0. Two equal estimates without errors give the exact value.
    """
    gains, others = one @ strategy, other @ strategy
    return max(0.0, float(gains[others.argmax()] + others[gains.argmax()]) / 2)


def nash_conv(row: Floats, column: Floats, payoff: Floats) -> float:
    """Returns what both players of the zero-sum game ``payoff`` together would gain by best responses (Lanctot 2017).

    Args:
        row: (rows,) the strategy of who gets ``payoff``.
        column: (columns,) the strategy of who pays it.
        payoff: (rows, columns).
    """
    return float((payoff @ column).max() - (row @ payoff).min())


def projected_replicator(
    payoff: Floats, *, exploration: float = 1e-6, step: float = 0.03, steps: int = 10_000
) -> tuple[Floats, Floats]:
    """Returns both players' average strategies under projected replicator dynamics (Lanctot 2017, PSRO).

    Both start with equal chances, move along the replicator's gradient and are projected back to strategies in which
    everything has at least ``exploration`` / (K + 1). The averages are within about log(K) / (step * steps) + step / 8
    of a Nash equilibrium, in units of the payoffs' range.

    Args:
        payoff: (rows, columns) to the row player, who is paid by the other.
        exploration: gamma, in [0, 1].
        step: length of a step in time, for payoffs whose range is 1.
        steps: how many, >= 1.
    """
    row, column = (np.full(size, 1.0 / size) for size in payoff.shape)
    sums = np.zeros(len(row)), np.zeros(len(column))
    pace = step / max(np.ptp(payoff), np.finfo(float).tiny)
    for _ in range(steps):
        gains, losses = payoff @ column, row @ payoff
        row = projected(row + pace * row * (gains - row @ gains), exploration / (len(row) + 1))
        column = projected(column - pace * column * (losses - losses @ column), exploration / (len(column) + 1))
        sums[0][:] += row
        sums[1][:] += column
    return sums[0] / steps, sums[1] / steps


def projected(point: Floats, least: float) -> Floats:
    """Returns the strategy nearest to ``point`` of those whose entries are all at least ``least``, < 1 / K."""
    room = 1.0 - least * len(point)
    falling = np.sort(point - least)[::-1]
    excess = (np.cumsum(falling) - room) / np.arange(1, len(point) + 1)
    return least + np.maximum(point - least - excess[falling > excess][-1], 0.0)


def total_variation(one: Floats, other: Floats) -> float:
    """Returns half the sum of the differences of two strategies, in [0, 1]."""
    return float(0.5 * np.abs(one - other).sum())
