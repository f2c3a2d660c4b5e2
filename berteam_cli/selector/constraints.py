"""Who may stand at which place of a team."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from berteam_cli.errors import did_you_mean
from berteam_cli.outcomes import Bools, Ints


def allowed(places: object, islands: Sequence[str], island_of: Ints, team_size: int) -> Bools:
    """Returns (T, N) who may stand at each place.

    Args:
        places: a list with an entry for each place: None for everybody, an island's name, a member's index, or a list
            of such.
        islands: names of the islands.
        island_of: (N,) the island of each member.
        team_size: T.

    Raises:
        ValueError: it is of another form, names no island or member there is, or leaves a place without anybody.
    """
    if not isinstance(places, list) or len(places) != team_size:
        said = f"has {len(places)}" if isinstance(places, list) else f"is {places}"
        raise ValueError(f"selector.valid_members must have an entry for each of the {team_size} places, but {said}.")
    rows = np.zeros((team_size, len(island_of)), dtype=np.bool_)
    for place, entry in enumerate(places):
        key = f"selector.valid_members[{place}]"
        if entry is None:
            rows[place] = True
        for one in entry if isinstance(entry, list) else [] if entry is None else [entry]:
            rows[place] |= members_of(one, key, islands, island_of)
        if not rows[place].any():
            raise ValueError(f"{key} must leave somebody for the place, but allows nobody.")
    return rows


def members_of(one: object, key: str, islands: Sequence[str], island_of: Ints) -> Bools:
    """Returns (N,) whom ``one``, an island's name or a member's index, means; ``key`` is for what is said of it.

    Raises:
        ValueError: there is no such island or member.
    """
    count = len(island_of)
    if isinstance(one, str) and one in islands:
        return np.asarray(island_of == islands.index(one))
    if isinstance(one, int) and not isinstance(one, bool) and 0 <= one < count:
        return np.arange(count) == one
    near = did_you_mean(str(one), islands)
    raise ValueError(
        f"{key} must name islands ({', '.join(islands)}) or members (0 to {count - 1}), but has {one}.{near}"
    )
