"""Which games each member of an island played."""

from __future__ import annotations

from berteam_cli.outcomes import Experience


def by_member(experience: Experience, first: int, size: int) -> dict[int, list[tuple[int, int]]]:
    """Returns (game, player) of each trajectory, in order, of every member that played.

    Args:
        experience: all games.
        first: the first member of the island.
        size: its members; they are counted from ``first`` in the result.
    """
    played: dict[int, list[tuple[int, int]]] = {}
    for row, game, player in experience.trajectories(first, size):
        played.setdefault(row, []).append((game, player))
    return played
