"""Maximum-likelihood Elo (Bradley-Terry), a draw counted as half a win.

For strengths s in nats, player i scores against j with expectation 1 / (1 + exp(s_j - s_i)). Where the likelihood is
highest, every player's expected points equal the points it made.
"""

from __future__ import annotations

import numpy as np

from berteam_cli.outcomes import Floats
from berteam_cli.rating.elo import POINTS_PER_NAT, nats, points

# Draws against an average player that everyone is given, so that a perfect record stays finite. A quarter of one game
# moves a team with 47 points of 54 by 3 Elo.
PRIOR_DRAWS = 0.25

Z_95 = 1.959964  # two-sided 95 % of the normal distribution


def expected(strengths: Floats, others: Floats) -> Floats:
    """Returns the expected score of ``strengths`` against ``others``, nats, in [0, 1]; broadcasts."""
    return 0.5 * (1.0 + np.tanh(0.5 * (strengths - others)))


def ratings(scores: Floats, games: Floats) -> tuple[Floats, Floats]:
    """Returns the Elo of every player of a tournament, with mean 1000, and its 95 % half width.

    The width comes from the Fisher information of decided games. Draws scatter less than that, so where many games are
    drawn it is too wide rather than too narrow.

    Args:
        scores: (K, K) points row made against column.
        games: (K, K) games between them, symmetric; the diagonal is ignored.
    """
    games = np.where(np.eye(len(games), dtype=bool), 0.0, games)
    made = np.where(games > 0, scores, 0.0).sum(axis=1) + 0.5 * PRIOR_DRAWS

    def loss_and_slope(strengths: Floats) -> tuple[float, Floats]:
        gaps = strengths[:, np.newaxis] - strengths
        chances = expected(strengths[:, np.newaxis], strengths)
        # -ln likelihood: each pair appears in both triangles, with scores that add up to its games.
        loss = (np.where(games > 0, scores, 0.0) * np.logaddexp(0.0, -gaps)).sum()
        loss += PRIOR_DRAWS * (np.logaddexp(0.0, -strengths) + 0.5 * strengths).sum()
        slope = (games * chances).sum(axis=1) + PRIOR_DRAWS * expected(strengths, 0.0) - made
        return float(loss), slope

    from scipy.optimize import minimize  # noqa: PLC0415 (half a second, and only tournaments need it)

    fit = minimize(loss_and_slope, np.zeros(len(games)), jac=True, method="BFGS", options={"gtol": 1e-9})
    strengths = fit.x - fit.x.mean()
    chances = expected(strengths[:, np.newaxis], strengths)
    information = (games * chances * (1 - chances)).sum(axis=1) + PRIOR_DRAWS / 4
    return points(strengths), Z_95 * POINTS_PER_NAT / np.sqrt(information)


def held_ratings(scores: Floats, games: Floats, anchors: Floats) -> tuple[Floats, Floats]:
    """Returns the Elo of players who met only opponents of known Elo, and its 95 % half width.

    Each player has its own equation, sum of (score - expected score) = 0, which falls in the strength: it is solved by
    bisection, all players at once, to 1e-9 nat.

    Args:
        scores: (K, J) points of player k against anchor j.
        games: (K, J) games between them.
        anchors: (J,) Elo of the anchors, held.
    """
    held = nats(np.asarray(anchors, dtype=float))
    made = scores.sum(axis=1) + 0.5 * PRIOR_DRAWS
    low = np.full(len(scores), held.min(initial=0.0) - 40.0)
    high = np.full(len(scores), held.max(initial=0.0) + 40.0)
    for _ in range(70):
        middle = 0.5 * (low + high)
        hoped = (games * expected(middle[:, np.newaxis], held)).sum(axis=1) + PRIOR_DRAWS * expected(middle, 0.0)
        low, high = np.where(hoped < made, middle, low), np.where(hoped < made, high, middle)
    strengths = 0.5 * (low + high)
    chances = expected(strengths[:, np.newaxis], held)
    information = (games * chances * (1 - chances)).sum(axis=1) + PRIOR_DRAWS / 4
    return points(strengths), Z_95 * POINTS_PER_NAT / np.sqrt(information)
