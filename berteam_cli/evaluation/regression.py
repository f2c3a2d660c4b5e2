"""How much the selector's probabilities say about Elos: a line through the teams, and how far the Elos' noise bends it.

Measured Elos scatter more than true ones. A line fitted to them is flatter than that through the true ones by their
reliability, the share of their variance that is not noise, and explains less by the same factor (attenuation).
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.stats import rankdata

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.rating.bootstrap import Interval, redrawn, with_interval

FEWEST = 3  # teams of a line that says anything
DIGITS = 10  # of a value that are not rounding, relative to the largest one
ROUNDING = 10.0**-DIGITS


def regression(elos: Floats, probability: Floats, error_variance: Floats, rng: Generator) -> dict[str, Interval]:
    """Returns the figures of the ordinary least squares of probability on Elo, by name, with 95 % intervals.

    ``slope`` is per Elo point; ``r_squared``, ``rank_correlation`` (Spearman's) and ``reliability`` have no unit;
    those called ``corrected`` are what true Elos would have given. NaN where all teams are alike, and of the corrected
    ones where the Elos scatter no more than their errors. The intervals come from drawing the teams anew (bootstrap).

    Args:
        elos: (K,) as measured, K >= FEWEST.
        probability: (K,) of each team, without error.
        error_variance: (K,) of each Elo.
        rng: the only source of chance.
    """
    count = len(elos)
    # One statistic after the other for all samples at once; the first row is the teams as they are.
    rows: Ints = np.concatenate([np.arange(count)[np.newaxis], redrawn(count, rng)])
    found = figures(elos[rows], probability[rows], error_variance[rows])
    return {name: with_interval(values[0], values[1:]) for name, values in found.items()}


def figures(x: Floats, y: Floats, error_variance: Floats) -> dict[str, Floats]:
    """Returns (R,) each figure of ``regression`` for R samples of teams, (R, K)."""
    slope, intercept, r_squared = line(x, y)
    by_rank, _, shared = line(ranks(x), ranks(y))
    variance = scatter(x, x - x.mean(axis=1, keepdims=True)) / (x.shape[1] - 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        reliability = (variance - error_variance.mean(axis=1)) / variance
        known = np.where(reliability > 0, reliability, np.nan)
        steeper = slope / known
        return {
            "slope": slope,
            "intercept": intercept,
            "r_squared": r_squared,
            "rank_correlation": np.sign(by_rank) * np.sqrt(shared),
            "reliability": reliability,
            "slope_corrected": steeper,
            "intercept_corrected": y.mean(axis=1) - steeper * x.mean(axis=1),
            "r_squared_corrected": r_squared / known,
        }


def line(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Returns (R,) slope, intercept and R^2 of the least squares of each row of ``y`` on that of ``x``, (R, K)."""
    across, up = x - x.mean(axis=1, keepdims=True), y - y.mean(axis=1, keepdims=True)
    both = (across * up).sum(axis=1)
    slope = both / scatter(x, across)
    return slope, y.mean(axis=1) - slope * x.mean(axis=1), slope * both / scatter(y, up)


def ranks(values: Floats) -> Floats:
    """Returns the rank of each value in its row, from 1; those that differ by rounding only share the mean of theirs.

    Args:
        values: (R, K) or (K,).
    """
    return rankdata(np.round(values / np.abs(values).max(), DIGITS), axis=-1)


def scatter(values: Floats, deviations: Floats) -> Floats:
    """Returns (R,) the sum of squared ``deviations``, NaN where ``values`` differ by no more than rounding."""
    alike = np.abs(deviations).max(axis=1) <= ROUNDING * np.abs(values).max(axis=1)
    return np.where(alike, np.nan, (deviations**2).sum(axis=1))
