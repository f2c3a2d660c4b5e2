"""Cells of behaviours, of which each keeps its fittest member.

A grid (Mouret and Clune, Illuminating search spaces by mapping elites, 2015), or the cells around centres that are
spread evenly (CVT: Vassiliades et al., Using centroidal Voronoi tessellations to scale up MAP-Elites, 2018).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial import KDTree

from berteam_cli.outcomes import NOBODY, Bools, Floats, Ints

NOWHERE = -1  # the cell of who was never measured
SAMPLES, ROUNDS = 50, 50  # of the k-means: points for each centre, and how often centres move at most


@dataclass(frozen=True, eq=False)
class Archive:
    """C cells over D behaviours.

    Attributes:
        low, high: (D,) ends of each behaviour's range; what is beyond belongs to the outermost cells.
        centres: (C, D) middle of each cell, in the behaviours' units.
        bins: (D,) cells of a grid along each behaviour, the last one counted fastest; None where whoever is nearest to
            a centre, in shares of the ranges, is in its cell.
    """

    low: Floats
    high: Floats
    centres: Floats
    bins: Ints | None

    def cells(self, behaviour: Floats) -> Ints:
        """Returns (K,) the cell of each of (K, D) behaviours; NOWHERE where one is NaN.

        In a grid the border between two cells belongs to the upper one, the end of the range to the last.
        """
        found = np.full(len(behaviour), NOWHERE, dtype=np.int64)
        known = ~np.isnan(behaviour).any(axis=1)
        shares = self.shares(behaviour[known])
        if self.bins is None:
            found[known] = KDTree(self.shares(self.centres)).query(shares)[1]
        else:
            places = np.floor(np.round(shares * self.bins, 9))  # .29 * 100 is 28.999999999999996
            places = np.clip(places, 0, self.bins - 1).astype(np.int64)
            found[known] = np.ravel_multi_index(tuple(places.T), tuple(self.bins))
        return found

    def shares(self, behaviour: Floats) -> Floats:
        """Returns (K, D) behaviours as shares of their ranges."""
        return (behaviour - self.low) / (self.high - self.low)

    def elites(self, cells: Ints, fitness: Floats) -> Ints:
        """Returns (C,) the fittest of each cell, the first of equals; NOBODY where a cell is empty.

        Args:
            cells: (K,) of each.
            fitness: (K,) of each.
        """
        found = np.full(len(self.centres), NOBODY, dtype=np.int64)
        for k in np.argsort(fitness, kind="stable"):
            if cells[k] != NOWHERE and (found[cells[k]] == NOBODY or fitness[k] > fitness[found[cells[k]]]):
                found[cells[k]] = k
        return found


def grid(low: Floats, high: Floats, bins: Ints) -> Archive:
    """Returns cells of equal size between (D,) ``low`` and ``high``, (D,) ``bins`` along each behaviour."""
    along = [a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(low, high, bins, strict=True)]
    centres = np.stack([axis.ravel() for axis in np.meshgrid(*along, indexing="ij")], axis=1)
    return Archive(low, high, centres, bins)


def voronoi(low: Floats, high: Floats, cells: int, rng: Generator) -> Archive:
    """Returns ``cells`` around the means of a k-means of uniform points between (D,) ``low`` and ``high``."""
    points = rng.random((SAMPLES * cells, len(low)))
    centres = points[:cells]
    for _ in range(ROUNDS):
        nearest = KDTree(centres).query(points)[1]
        sums = [np.bincount(nearest, weights=column, minlength=cells) for column in points.T]
        count = np.bincount(nearest, minlength=cells)[:, np.newaxis]
        moved = np.where(count > 0, np.stack(sums, axis=1) / np.maximum(count, 1), centres)
        if (moved == centres).all():
            break
        centres = moved
    return Archive(low, high, low + centres * (high - low), None)


def occupied(elites: Ints) -> Bools:
    """Returns (C,) whether each cell has anybody, by its (C,) ``elites``."""
    return elites != NOBODY


def quality(elites: Ints, shown: Floats) -> float:
    """Returns the QD score: the fitness of the fittest of each occupied cell above 0, added up.

    0 is the lowest mean score; of Elos, whose mean is 1000, what is below 0 counts as 0.

    Args:
        elites: (C,) as ``Archive.elites`` gives them.
        shown: (K,) fitness on the scale of the tables.
    """
    return float(np.maximum(shown[elites[occupied(elites)]], 0.0).sum())
