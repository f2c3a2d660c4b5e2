"""The Elo scale: points for people, nats for formulas."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from berteam_cli.outcomes import Floats

POINTS_PER_NAT = 400 / math.log(10)  # 173.7: ten times the odds are 400 points
MEAN_POINTS = 1000.0  # the fixed teams' mean

Numbers = TypeVar("Numbers", float, Floats)


def points(strength_nat: Numbers) -> Numbers:
    """Returns Elo points of strengths in nats; 0 nat are MEAN_POINTS."""
    return MEAN_POINTS + POINTS_PER_NAT * strength_nat


def nats(elo: Numbers) -> Numbers:
    """Returns strengths in nats of Elo points; the inverse of ``points``."""
    return (elo - MEAN_POINTS) / POINTS_PER_NAT


def softmax(values: Floats) -> Floats:
    """Returns the softmax over the last axis: expected scores of strengths in nats (paper, Elo equation)."""
    odds = np.exp(values - values.max(axis=-1, keepdims=True))
    return odds / odds.sum(axis=-1, keepdims=True)
