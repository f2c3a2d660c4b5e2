"""Players who never met, not even by way of others: their Elos say nothing of each other."""

from __future__ import annotations

import logging

import numpy as np
from scipy.sparse.csgraph import connected_components

from berteam_cli.outcomes import Floats, Ints

log = logging.getLogger("berteam")


def groups(games: Floats | Ints) -> list[Ints]:
    """Returns the groups of players within which everybody met everybody, at least by way of others.

    Args:
        games: (K, K) that row and column played.
    """
    count, member = connected_components(np.asarray(games) > 0, directed=False)
    return [np.flatnonzero(member == k) for k in range(count)]


def warn_of_groups(games: Floats | Ints) -> None:
    """Logs which players never met, if there are such: only the prior holds their Elos to one scale."""
    apart = groups(games)
    if len(apart) > 1:
        told = "; ".join(", ".join(map(str, group[:10])) + (" ..." if len(group) > 10 else "") for group in apart[:5])
        log.warning(
            "%d groups of players never met, so that Elos can be compared within each only: %s%s.",
            *(len(apart), told, "; ..." if len(apart) > 5 else ""),
        )
