"""What several seeds say of an algorithm (Agarwal et al. 2021, Deep RL at the Edge of the Statistical Precipice)."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.stats import trim_mean

from berteam_cli.outcomes import Floats, Ints


def iqm(values: Floats, axis: int = -1) -> Floats:
    """Returns the interquartile mean along ``axis``: a quarter of the values is left out at either end.

    Of fewer than four values it is their mean.
    """
    return np.asarray(trim_mean(values, 0.25, axis=axis))


def improvement(ours: Floats, theirs: Floats) -> Floats:
    """Returns the probability that a run of ours is above one of theirs, a tie counting half (Mann and Whitney).

    Args:
        ours: (..., n) figures of our runs.
        theirs: (..., m) of theirs.
    """
    gap = ours[..., :, np.newaxis] - theirs[..., np.newaxis, :]
    return (0.5 + 0.5 * np.sign(gap)).mean(axis=(-2, -1))


def drawn_seeds(of: Ints, resamples: int, rng: Generator) -> Ints:
    """Returns (resamples, R) which run stands in for each run when every algorithm's seeds are drawn anew.

    An algorithm of one run keeps it: nothing is known of its other seeds.

    Args:
        of: (R,) the algorithm of each run.
        resamples: how often.
        rng: the only source of chance.
    """
    chosen = np.empty((resamples, len(of)), dtype=np.int64)
    for algorithm in np.unique(of):
        runs = np.flatnonzero(of == algorithm)
        chosen[:, runs] = runs[rng.integers(len(runs), size=(resamples, len(runs)))]
    return chosen
