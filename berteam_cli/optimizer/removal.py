"""Who is crowded: the one step in which MAP-Elites differs from coevolution (paper, appendix on MAP-Elites)."""

from __future__ import annotations

import numpy as np

from berteam_cli.outcomes import Floats


def distances(behaviour: Floats) -> Floats:
    """Returns (K, K) Euclidean distances between (K, D) behaviours; with one behaviour the difference, to the bit."""
    apart: Floats = np.hypot.reduce(np.abs(behaviour[:, np.newaxis] - behaviour), axis=2)
    return apart


def nearest(behaviour: Floats) -> Floats:
    """Returns (K,) how far the nearest other is; who has nobody nearer than the radius is unique and safe.

    Infinity for who is alone or was never measured.

    Args:
        behaviour: (K, D) in units of their scales; NaN where it was never measured.
    """
    apart = distances(behaviour)
    apart[np.isnan(apart)] = np.inf
    np.fill_diagonal(apart, np.inf)
    return apart.min(axis=1)


def above_neighbours(fitness: Floats, behaviour: Floats, radius: float) -> Floats:
    """Returns (K,) how much fitter each is than the mean of all within ``radius``, itself included.

    Args:
        fitness: (K,).
        behaviour: (K, D) in units of their scales.
        radius: in the same units.
    """
    near = distances(behaviour) <= radius
    return fitness - near @ fitness / near.sum(axis=1)
