"""Elo with draws as an outcome of their own (Davidson 1970), by maximum likelihood.

For strengths s in nats, p = exp(s), a game is won, drawn or lost in proportion to p_i, nu sqrt(p_i p_j) and p_j.
Without draws that is Bradley and Terry's model. One nu is taken for all games: the model says that equals draw most.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from berteam_cli.outcomes import Floats
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected
from berteam_cli.rating.elo import points

FEWEST_DRAWS = 0.25  # that are taken to have happened, so that nu stays finite and positive
FEWEST_DECIDED = 0.25  # likewise, between equals
PRECISE: Any = {"ftol": 1e-15, "gtol": 1e-8, "maxiter": 5000, "maxcor": 30}


@dataclass(frozen=True)
class Davidson:
    """A fit.

    Attributes:
        elos: (K,) with mean 1000.
        nu: two equals draw with chance nu / (2 + nu).
    """

    elos: Floats
    nu: float


def davidson(wins: Floats, draws: Floats, prior: Floats | float = PRIOR_DRAWS) -> Davidson:
    """Returns the fit to the games of K players.

    Args:
        wins: (K, K) games that row won against column.
        draws: (K, K) games that they drew, symmetric.
        prior: (K,) or one number, draws against an average player that everyone is given, by Bradley and Terry's model.
    """
    first, second = np.triu_indices(len(wins), 1)
    won, lost, drawn = wins[first, second], wins[second, first], draws[first, second]
    prior = np.broadcast_to(np.asarray(prior, dtype=float), len(wins))

    def loss_and_slope(values: Floats) -> tuple[float, Floats]:
        strengths, log_nu = values[:-1], values[-1]
        half = 0.5 * (strengths[first] - strengths[second])
        log_odds = np.stack([half, np.full(len(half), log_nu), -half])
        total = np.logaddexp.reduce(log_odds, axis=0)
        chance = np.exp(log_odds - total)
        played = won + lost + drawn
        loss = (played * total - (won - lost) * half - drawn * log_nu).sum()
        loss += (prior * (np.logaddexp(0.0, -strengths) + 0.5 * strengths)).sum()
        loss -= FEWEST_DRAWS * log_nu - (FEWEST_DRAWS + FEWEST_DECIDED) * np.log(2 + np.exp(log_nu))
        pull = 0.5 * (played * (chance[0] - chance[2]) - (won - lost))
        slope = np.zeros(len(values))
        np.add.at(slope, first, pull)
        np.add.at(slope, second, -pull)
        slope[:-1] += prior * (expected(strengths, 0.0) - 0.5)
        slope[-1] = (played * chance[1] - drawn).sum() - FEWEST_DRAWS
        slope[-1] += (FEWEST_DRAWS + FEWEST_DECIDED) * np.exp(log_nu) / (2 + np.exp(log_nu))
        return float(loss), slope

    fit = minimize(loss_and_slope, np.zeros(len(wins) + 1), jac=True, method="L-BFGS-B", options=PRECISE)
    strengths = fit.x[:-1] - fit.x[:-1].mean()
    return Davidson(np.asarray(points(strengths)), float(np.exp(fit.x[-1])))
