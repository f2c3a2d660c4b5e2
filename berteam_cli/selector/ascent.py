"""Searches teams of a high value where there are too many to look at all: coordinate ascent."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from berteam_cli.outcomes import Bools, Floats, Ints
from berteam_cli.selector.listed import distinct

SWEEPS = 4  # over all places, at most


def climbed(teams: Ints, value: Callable[[Ints], Floats], allowed: Bools) -> Ints:
    """Returns the distinct teams, (K, T), where climbing from each of ``teams``, (J, T), ends.

    Place after place is given to whoever makes the team best, until nothing is better or all places had ``SWEEPS``
    turns; of equally good members the first is taken, and whoever stands there stays where nobody is better.

    Args:
        teams: where to start.
        value: returns (K,) of (K, T) teams.
        allowed: (T, N) who may stand at each place.
    """
    teams = teams[distinct(teams)]
    best = value(teams)
    for _ in range(SWEEPS):
        before = teams.copy()
        for place in range(teams.shape[1]):
            options = np.flatnonzero(allowed[place])
            tried = np.repeat(teams[:, np.newaxis], len(options), axis=1)  # (J, M, T)
            tried[:, :, place] = options
            values = value(tried.reshape(-1, teams.shape[1])).reshape(len(teams), -1)
            choice = values.argmax(axis=1)
            found = values[np.arange(len(teams)), choice]
            better = found > best
            teams = np.where(better[:, np.newaxis], tried[np.arange(len(teams)), choice], teams)
            best = np.where(better, found, best)
        if (teams == before).all():
            break
        kept = distinct(teams)  # climbs that met go on as one
        teams, best = teams[kept], best[kept]
    return teams
