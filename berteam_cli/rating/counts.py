"""What came of games between teams and others, a game and its copies counted once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from berteam_cli.outcomes import Bools, Floats, Ints

POINTS = np.array([1.0, 0.5, 0.0])  # of a game won, drawn, lost


@dataclass(frozen=True)
class Counts:
    """The games of K teams against J others.

    Attributes:
        different: (3, K, J, M) games won, drawn and lost that are not copies of each other.
        copies: (M,) how often each of these was played.
        settled: (K, J) whether all that can happen between the two was played, so that nothing is left to chance.
    """

    different: Ints
    copies: Ints
    settled: Bools

    @property
    def results(self) -> Ints:
        """(3, K, J) games won, drawn and lost, copies included."""
        return self.different @ self.copies

    @property
    def repetition(self) -> Floats:
        """(K,) by what the variance of a team's mean score is larger than if none of its games were copies."""
        games = self.different.sum(axis=(0, 2))
        return games @ self.copies**2 / np.maximum(games @ self.copies, 1)


def independent(won: Ints, drawn: Ints, lost: Ints) -> Counts:
    """Returns (K, J) games of each kind, none of them copies, all left to chance."""
    results = np.stack([won, drawn, lost])
    return Counts(results[..., np.newaxis], np.ones(1, dtype=np.int64), np.zeros(results.shape[1:], dtype=np.bool_))


def counts(kinds: Ints, clusters: Ints, shape: tuple[int, int, int], settled: Bools) -> Counts:
    """Returns the games of K teams against J others, G against each, counted.

    Args:
        kinds: (K J G,) 0, 1 or 2: won, drawn or lost; those of a team in a row.
        clusters: (K J G,) the first game of which each is a copy (``copies.clusters``).
        shape: (K, J, G).
        settled: (K, J).
    """
    teams, others, each = shape
    often = np.bincount(clusters, minlength=len(kinds))
    first = np.flatnonzero(often)
    copies, which = np.unique(often[first], return_inverse=True)
    different = np.zeros((3, teams, others, len(copies)), dtype=np.int64)
    team, other = np.divmod(first // each, others)
    np.add.at(different, (kinds[first], team, other, which), 1)
    return Counts(different, copies, settled)
