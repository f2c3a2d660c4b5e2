"""Maximum-likelihood Elo (Bradley-Terry), a draw counted as half a win.

For strengths s in nats, player i scores against j with expectation 1 / (1 + exp(s_j - s_i)). Where the likelihood is
highest, every player's expected points equal the points it made.

In a game of S sides scores are expected to be the softmax of the sides' strengths (paper, Elo equation). So a player
that stands alone against S - 1 copies of another has the handicap ln(S - 1): 1 / (1 + exp(s_j + ln(S - 1) - s_i)).
"""

from __future__ import annotations

import numpy as np

from berteam_cli.outcomes import Floats
from berteam_cli.rating.elo import POINTS_PER_NAT, nats, points
from berteam_cli.rating.groups import warn_of_groups

# Draws against an average player that everyone is given, so that a perfect record stays finite. A quarter of one game
# moves a team with 47 points of 54 by 3 Elo.
PRIOR_DRAWS = 0.25

Z_95 = 1.959964  # two-sided 95 % of the normal distribution

STEPS = 200  # of Newton's method, at most; the likelihood is concave
LONGEST_STEP_NAT = 1.0  # farther away its parabola is not to be trusted
ARRIVED_NAT = 1e-11


def expected(strengths: Floats, others: Floats | float) -> Floats:
    """Returns the expected score of ``strengths`` against ``others``, nats, in [0, 1]; broadcasts."""
    return 0.5 * (1.0 + np.tanh(0.5 * (strengths - others)))


def slope_at(strengths: Floats) -> Floats:
    """Returns how fast the expected score against an average player grows with ``strengths``, per nat."""
    chance = expected(strengths, 0.0)
    return chance * (1 - chance)


def ratings(scores: Floats, games: Floats, handicap: float = 0.0) -> tuple[Floats, Floats]:
    """Returns the Elo of every player of a tournament, with mean 1000, and its 95 % half width.

    The width comes from the Fisher information of decided games. Draws scatter less than that, so where many games are
    drawn it is too wide rather than too narrow.

    Args:
        scores: (K, K) points row made against column; with a handicap, in the games where row stood alone.
        games: (K, K) those games; the diagonal is ignored. Without a handicap row and column are alike, so that each
            game is in both triangles: games are symmetric, and scores add up to them.
        handicap: in nats, of the player that stands alone: ln(S - 1) against the copies on S - 1 sides, 0 for S = 2.
    """
    games = np.where(np.eye(len(games), dtype=bool), 0.0, games)
    warn_of_groups(games)
    scores = np.where(games > 0, scores, 0.0)
    # What row made together with its copies, in the games where column stood alone.
    crowds = games.T if handicap > 0 else np.zeros_like(games)
    shared = (games - scores).T if handicap > 0 else np.zeros_like(games)
    made = scores.sum(axis=1) + shared.sum(axis=1) + 0.5 * PRIOR_DRAWS

    def chances(strengths: Floats) -> tuple[Floats, Floats]:
        own = strengths[:, np.newaxis]
        return expected(own, strengths + handicap), expected(own, strengths - handicap)

    strengths = np.zeros(len(games))
    for _ in range(STEPS):
        alone, together = chances(strengths)
        missing = made - (games * alone).sum(axis=1) - (crowds * together).sum(axis=1)
        missing -= PRIOR_DRAWS * expected(strengths, 0.0)
        spread = games * alone * (1 - alone) + crowds * together * (1 - together)
        spread = 0.5 * (spread + spread.T)  # equal but for rounding: each game is in both triangles
        curvature = np.diag(spread.sum(axis=1) + PRIOR_DRAWS * slope_at(strengths)) - spread
        step = np.linalg.solve(curvature, missing)
        longest = np.abs(step).max()
        strengths += step * min(1.0, LONGEST_STEP_NAT / max(longest, LONGEST_STEP_NAT))
        if longest < ARRIVED_NAT:
            break
    strengths = strengths - strengths.mean()
    alone, together = chances(strengths)
    information = (games * alone * (1 - alone)).sum(axis=1) + (crowds * together * (1 - together)).sum(axis=1)
    return points(strengths), Z_95 * POINTS_PER_NAT / np.sqrt(information + PRIOR_DRAWS / 4)


def held_ratings(
    scores: Floats, games: Floats, anchors: Floats, handicap: Floats | float = 0.0
) -> tuple[Floats, Floats]:
    """Returns the Elo of players who met only opponents of known Elo, and its 95 % half width.

    Each player has its own equation, sum of (score - expected score) = 0, which falls in the strength: it is solved by
    bisection, all players at once, to 1e-9 nat.

    Args:
        scores: (K, J) points of player k against anchor j.
        games: (K, J) games between them.
        anchors: (J,) Elo of the anchors, held.
        handicap: (J,) or one number, nats by which players are behind: ln(c / k) on k sides against c of the anchor.
    """
    held = nats(np.asarray(anchors, dtype=float)) + handicap
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
