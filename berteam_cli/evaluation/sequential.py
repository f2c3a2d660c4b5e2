"""Sequential probability ratio tests: pairs play until it is clear who is stronger (Wald 1945).

As chess engines are tested: the log likelihood ratio of two Elo differences, by the normal approximation of the mean
score with the variance of wins, draws and losses as they came.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.rating.bradley_terry import expected
from berteam_cli.rating.elo import POINTS_PER_NAT

UNSEEN = 1 / 3  # games of each result that are taken to have happened, so that the variance is never 0


@dataclass(frozen=True)
class Sprt:
    """A test of every pair: is the first ``elo1`` above the second, or ``elo0``?

    Attributes:
        rounds: at most so many rounds of games; 1 tests nothing.
        elo0: Elo difference of the hypothesis that is kept below the lower bound, < 0.
        elo1: of the one that is accepted above the upper bound, > 0.
        alpha: chance to accept elo1 where elo0 is true.
        beta: chance to keep elo0 where elo1 is true.
    """

    rounds: int
    elo0: float
    elo1: float
    alpha: float
    beta: float

    @property
    def bounds(self) -> tuple[float, float]:
        """Between these log likelihood ratios the pair plays on."""
        return math.log(self.beta / (1 - self.alpha)), math.log((1 - self.beta) / self.alpha)

    def log_ratio(self, wins: Ints | Floats, draws: Ints | Floats, losses: Ints | Floats) -> Floats:
        """Returns the log likelihood ratio of elo1 to elo0, for games of the first player; of any shape."""
        won, drawn, lost = (np.asarray(x, dtype=np.float64) + UNSEEN for x in (wins, draws, losses))
        games = won + drawn + lost
        mean = (won + 0.5 * drawn) / games
        variance = (won * (1 - mean) ** 2 + drawn * (0.5 - mean) ** 2 + lost * mean**2) / games
        low, high = (float(expected(np.asarray(elo / POINTS_PER_NAT), 0.0)) for elo in (self.elo0, self.elo1))
        return games * (high - low) * (2 * mean - low - high) / (2 * variance)

    def decided(self, log_ratio: Floats) -> Ints:
        """Returns 1 where elo1 is accepted, -1 where elo0 is kept, 0 where it is open."""
        low, high = self.bounds
        return np.where(log_ratio >= high, 1, np.where(log_ratio <= low, -1, 0))
