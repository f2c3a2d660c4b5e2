"""Records of who played, what came of it and what the players saw.

Shape letters, here and in every docstring of the package: B games, S sides, T places in a team,
V = S * T players of a game (side 0 first), N members of the population, I islands, M members of one
island, L steps of the longest game, O numbers of an observation, A actions, K teams or rows.
Side 0 is blue, side 1 is red, and SIDES names all that there can be.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

OPEN = -1  # a place nobody holds yet
ABSENT = -2  # no place at all, where teams of several sizes share an array
NOBODY = -1  # no captain, no parent

SIDES = ("blue", "red", "green", "gold", "purple", "orange", "cyan", "pink")  # what the tables call them

EVENTS = ("captures", "grabs", "tags", "wall_hits")  # what a game counts for each side
HABITS = ("advance", "spread")
"""What a game with positions measures of each side, means over its steps and vehicles.

advance: where a vehicle is along the field, 0 at its own back wall and 1 at the opponents'. spread: the distance
between two team-mates as a share of the field's diagonal; 0 for who has none.
"""
BEHAVIOURS = ("aggression", *HABITS)
"""What is measured of members in probing games. Shape letter D: how many there are."""


@dataclass(frozen=True)
class Lineups:
    """Who plays whom.

    Attributes:
        teams: (B, S, T) members.
        captains: (B, S) members, NOBODY where a side has no captain.
        log_chances: (B, S) ln of the probability with which the selector makes this ordered team,
            over all the ways it could have come about; NaN where the selector was not asked for it.
    """

    teams: Ints
    captains: Ints
    log_chances: Floats

    def __len__(self) -> int:
        return len(self.teams)

    def followed_by(self, later: Lineups) -> Lineups:
        """Returns these games and then ``later`` ones."""
        return Lineups(*joined_fields(self, later))


@dataclass(frozen=True)
class Outcomes:
    """What came of a batch of games.

    Attributes:
        lineups: who played.
        scores: (B, S) summing to 1 in every game: the best sides share it. 1 is a win, 0 a loss, all between a draw.
        steps: (B,) length of each game.
        events: (B, S, len(EVENTS)) counts.
        seeds: (B,) uint64, the stream each game drew from.
        habits: (B, S, len(HABITS)), zeros in a game without positions; None where they were not kept.
    """

    lineups: Lineups
    scores: Floats
    steps: Ints
    events: Ints
    seeds: npt.NDArray[np.uint64]
    habits: Floats | None = None

    @property
    def winners(self) -> Ints:
        """(K, T) teams that won, games in order; a draw has none."""
        return self.lineups.teams[self.scores == 1.0]

    def followed_by(self, later: Outcomes) -> Outcomes:
        """Returns these games and then those of ``later``."""
        return Outcomes(self.lineups.followed_by(later.lineups), *joined_fields(self, later)[1:])

    def of(self, games: slice | Ints) -> Outcomes:
        """Returns those of some of the games, in the order in which ``games`` names them."""
        lineups = Lineups(*cut_fields(self.lineups, games))
        return Outcomes(lineups, *cut_fields(self, games)[1:])

    def event(self, name: str) -> Ints:
        """Returns (B, S) how often ``name``, one of EVENTS, happened to each side."""
        return self.events[:, :, EVENTS.index(name)]


@dataclass(frozen=True)
class Experience:
    """What every player of a batch of games saw, did and was paid for.

    Where players may leave early, a row is one player of one game: (B V, 1) in place of (B, V).

    Attributes:
        members: (B, V) who played.
        observations: (B, V, L + 1, O) float32; row ``lengths[b]`` is what was seen after the last step.
        actions: (B, V, L) int16.
        rewards: (B, V, L) float32.
        lengths: (B,) steps of each game; later rows hold no meaning.
        terminated: (B,) whether the rules ended the game; else time ran out.
    """

    members: Ints
    observations: npt.NDArray[np.float32]
    actions: npt.NDArray[np.int16]
    rewards: npt.NDArray[np.float32]
    lengths: Ints
    terminated: Bools

    def followed_by(self, later: Experience) -> Experience:
        """Returns that of these games and then that of ``later``."""
        return Experience(*joined_fields(self, later))

    def of_first(self, games: int, played: int) -> Experience:
        """Returns that of the first ``games`` of the ``played`` games it is of; no copies."""
        return Experience(*cut_fields(self, slice(games * (len(self.members) // max(played, 1)))))

    def trajectories(self, first: int, size: int) -> dict[int, list[tuple[int, int]]]:
        """Returns (game, player) of each trajectory, in order, of every member that played.

        A member with several places in one game contributes each of them, one after the other.

        Args:
            first: a member.
            size: how many members from ``first`` on to look for; in the result they are counted from ``first``.
        """
        game, player = np.nonzero((self.members >= first) & (self.members < first + size))
        row = self.members[game, player] - first
        order = np.lexsort((player, game, row))
        played: dict[int, list[tuple[int, int]]] = {}
        for k in order:
            played.setdefault(int(row[k]), []).append((int(game[k]), int(player[k])))
        return played


def cut_fields(record: Any, rows: slice | Ints) -> list[Any]:
    """Returns ``rows`` of the arrays of a record; fields that hold no array come as None."""
    values = (getattr(record, x.name) for x in fields(record))
    return [value[rows] if isinstance(value, np.ndarray) else None for value in values]


def joined_fields(first: Any, second: Any) -> list[Any]:
    """Returns the arrays of two records of one kind, one behind the other; fields that hold no array come as None."""
    pairs = ((getattr(first, x.name), getattr(second, x.name)) for x in fields(first))
    return [np.concatenate(pair) if isinstance(pair[0], np.ndarray) else None for pair in pairs]
