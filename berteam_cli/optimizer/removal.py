"""Who is crowded: the one step in which MAP-Elites differs from coevolution (paper, appendix on MAP-Elites)."""

from __future__ import annotations

import numpy as np

from berteam_cli.outcomes import Bools, Floats


def crowded(behaviour: Floats, radius: float) -> Bools:
    """Returns (K,) who has another nearer than ``radius``; the others are unique and safe.

    Args:
        behaviour: (K,) aggression, no unit.
        radius: lambda of the paper, above 0.
    """
    apart = np.abs(behaviour[:, np.newaxis] - behaviour)
    return (apart < radius).sum(axis=1) > 1  # everyone is near oneself


def above_neighbours(fitness: Floats, behaviour: Floats, radius: float) -> Floats:
    """Returns (K,) how much fitter each is than the mean of all within ``radius``, itself included."""
    near = np.abs(behaviour[:, np.newaxis] - behaviour) <= radius
    return fitness - near @ fitness / near.sum(axis=1)
