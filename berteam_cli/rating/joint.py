"""Elos of players who met each other and opponents of known Elo: one likelihood of all games, the latter held."""

from __future__ import annotations

import numpy as np

from berteam_cli.outcomes import Floats
from berteam_cli.rating.bradley_terry import ARRIVED_NAT, LONGEST_STEP_NAT, PRIOR_DRAWS, STEPS, expected, slope_at
from berteam_cli.rating.elo import nats, points


def joint_ratings(scores: Floats, games: Floats, held_scores: Floats, held_games: Floats, anchors: Floats) -> Floats:
    """Returns (..., K) Elos, by Newton's method; every game weighs the same, a draw counts half.

    Args:
        scores: (..., K, K) points row made against column; the diagonal is ignored.
        games: (..., K, K) those games, symmetric; the diagonal is ignored.
        held_scores: (..., K, J) points against each anchor.
        held_games: (..., K, J) those games.
        anchors: (J,) Elo of the anchors.
    """
    itself = np.eye(games.shape[-1], dtype=bool)
    games, scores = np.where(itself, 0.0, games), np.where(itself, 0.0, scores)
    held = np.asarray(nats(np.asarray(anchors, dtype=float)))
    made = scores.sum(axis=-1) + held_scores.sum(axis=-1) + 0.5 * PRIOR_DRAWS
    strengths = np.zeros(made.shape)
    for _ in range(STEPS):
        own = strengths[..., np.newaxis]
        chance, held_chance = expected(own, strengths[..., np.newaxis, :]), expected(own, held)
        missing = made - (games * chance).sum(axis=-1) - (held_games * held_chance).sum(axis=-1)
        missing -= PRIOR_DRAWS * expected(strengths, 0.0)
        spread = games * chance * (1 - chance)
        alone = (held_games * held_chance * (1 - held_chance)).sum(axis=-1) + PRIOR_DRAWS * slope_at(strengths)
        curvature = itself * (spread.sum(axis=-1) + alone)[..., np.newaxis] - spread
        step = np.linalg.solve(curvature, missing[..., np.newaxis])[..., 0]
        longest = np.abs(step).max(axis=-1, keepdims=True)
        strengths = strengths + step * np.minimum(1.0, LONGEST_STEP_NAT / np.maximum(longest, LONGEST_STEP_NAT))
        if longest.max(initial=0.0) < ARRIVED_NAT:
            break
    return np.asarray(points(strengths))
