"""How training games start: some of them where something happens soon, fewer of them as the training goes on.

Only the population's own games do; games that measure, in the training and after it, start as the rules say.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from berteam_cli.env.base import Env
from berteam_cli.games import Games
from mctf.practice import Starts


@runtime_checkable
class Practising(Protocol):
    """A kind of game that can start otherwise than its rules say."""

    def practice(self, starts: Starts) -> Env:
        """Returns the game with such starts."""


@dataclass(frozen=True)
class Curriculum:
    """The shares of training games that start otherwise.

    Attributes:
        starts: shares of the kinds in the first epoch.
        until: epochs after which they have fallen linearly to 0; 0: they stay.
    """

    starts: Starts
    until: int

    def __post_init__(self) -> None:
        """Checks the shares.

        Raises:
            ValueError: they are more than all games.
        """
        if self.total > 1:
            raise ValueError(f"random, near_flag and carrying must be at most 1 together, but are {self.total:g}")

    @property
    def total(self) -> float:
        """The share of games that start otherwise in the first epoch."""
        return round(self.starts.random + self.starts.near_flag + self.starts.carrying, 12)  # .7 + .2 + .1 is above 1

    def in_epoch(self, epoch: int) -> Starts:
        """Returns the shares in ``epoch``, counted from 0."""
        left = max(1.0 - epoch / self.until, 0.0) if self.until else 1.0
        random, near_flag, carrying, near_flag_m = self.starts
        return Starts(left * random, left * near_flag, left * carrying, near_flag_m)

    def practice(self, games: Games, epoch: int) -> Games:
        """Returns ``games`` as the population plays them in ``epoch`` to learn."""
        starts = self.in_epoch(epoch)
        if not any(starts[:3]):
            return games
        assert isinstance(games.env, Practising)  # build.py refuses others
        return replace(games, env=games.env.practice(starts))
