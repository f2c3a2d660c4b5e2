"""Alpha-rank: how long a population stays with each team if, now and then, one that does better takes over.

One population of size ``POPULATION`` plays a symmetric game, all with the same team. A mutant takes over with the
chance of a Moran process with selection of strength alpha, rho(u) = (1 - e^-u) / (1 - e^-mu) with u = alpha times what
it gains. The distribution at which this chain is at rest ranks the teams (Omidshafiei and others 2019, single
population). Teams that beat each other in a circle share it, where an Elo cannot tell.
"""

from __future__ import annotations

import numpy as np

from berteam_cli.outcomes import Floats

ALPHA = 10.0  # of a score in [0, 1], in a population of 50: whoever wins three games of four takes over nearly always
POPULATION = 50


def alpha_rank(scores: Floats, alpha: float = ALPHA, population: int = POPULATION) -> Floats:
    """Returns (K,) the share of time that each team is everybody's, with sum 1.

    Args:
        scores: (K, K) what row is expected to score against column, in [0, 1].
        alpha: strength of selection, >= 0.
        population: m, at least 2.
    """
    size = len(scores)
    if size == 1:
        return np.ones(1)
    takes_over = fixation(alpha * (scores.T - scores), population)  # (K, K): column invades row
    chain = takes_over / (size - 1)
    np.fill_diagonal(chain, 0.0)
    np.fill_diagonal(chain, 1.0 - chain.sum(axis=1))
    return at_rest(chain)


def fixation(gain: Floats, population: int) -> Floats:
    """Returns the chance that one mutant takes over a population of m, by its ``gain`` times alpha."""
    gain = np.clip(gain, -500.0 / population, 500.0 / population)
    small = np.abs(gain) < 1e-9
    u = np.where(small, 1.0, gain)
    return np.where(small, 1.0 / population, np.expm1(-u) / np.expm1(-population * u))


def at_rest(chain: Floats) -> Floats:
    """Returns (K,) the stationary distribution of a (K, K) ``chain`` that comes from everywhere to everywhere.

    State after state is taken out of the chain (Grassmann, Taksar and Heyman 1985): without subtraction, so that
    chances of 1e-200 do no harm.
    """
    left = chain.copy()
    size = len(left)
    for n in range(size - 1, 0, -1):
        left[:n, n] /= left[n, :n].sum()
        left[:n, :n] += np.outer(left[:n, n], left[n, :n])
    share = np.ones(size)
    for n in range(1, size):
        share[n] = share[:n] @ left[:n, n]
        share[: n + 1] /= share[: n + 1].max()
    return share / share.sum()
