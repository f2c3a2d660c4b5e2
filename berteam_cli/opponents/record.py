"""How often somebody was beaten, as it is estimated while games come in."""

from __future__ import annotations

from typing import NamedTuple


class Record(NamedTuple):
    """Games against somebody, older ones counting less.

    Attributes:
        beaten: sum of what their scores lacked to 1.
        games: how many.
    """

    beaten: float = 0.0
    games: float = 0.0

    def after(self, beaten: float, games: int, half_life: float) -> Record:
        """Returns the record after an epoch with ``games`` games.

        One of ``half_life`` epochs ago counts half; where that is 0, all count in full.
        """
        kept = 0.5 ** (1 / half_life) if half_life else 1.0
        return Record(kept * self.beaten + beaten, kept * self.games + games)

    def chance(self, prior_games: float, prior: float) -> float:
        """Returns the estimated chance to beat them, where ``prior_games`` games with mean ``prior`` came first."""
        return (prior * prior_games + self.beaten) / (prior_games + self.games)
