"""The teams that won lately, with their weights; paper, Section 3, "Training Procedure", and Appendix D."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Floats, Ints, Outcomes


@dataclass(frozen=True)
class Winners:
    """A ring: the newest team takes the place of the oldest.

    Attributes:
        teams: (C, T) members; OPEN in rows that were never used.
        weights: (C,) weight of each team on the day it won; 0 in rows that were never used.
        pushed: teams pushed since the start; the next goes to row ``pushed % C``.
    """

    teams: Ints
    weights: Floats
    pushed: int

    def __len__(self) -> int:
        return min(self.pushed, len(self.teams))

    @property
    def ages(self) -> Ints:
        """(len,) teams pushed after each one."""
        return (self.pushed - 1 - np.arange(len(self))) % len(self.teams)


def no_winners(capacity: int, team_size: int) -> Winners:
    """Returns an empty ring for ``capacity`` teams."""
    return Winners(np.full((capacity, team_size), OPEN), np.zeros(capacity), 0)


def pushed(winners: Winners, teams: Ints, weights: Floats) -> Winners:
    """Returns ``winners`` with ``teams``, (K, T), and their ``weights``, (K,), pushed one after the other."""
    capacity = len(winners.teams)
    rows = (winners.pushed + np.arange(len(teams)))[-capacity:] % capacity
    new = Winners(winners.teams.copy(), winners.weights.copy(), winners.pushed + len(teams))
    new.teams[rows] = teams[-capacity:]
    new.weights[rows] = weights[-capacity:]
    return new


def minibatch(winners: Winners, size: int, half_life: float, rng: Generator) -> tuple[Ints, Floats]:
    """Returns (size, T) teams drawn uniformly with replacement and their (size,) weights, scaled to a mean of 1.

    Args:
        winners: at least one.
        size: how many to draw.
        half_life: pushed teams after which a team counts half; 0 for never.
        rng: the only source of chance.
    """
    rows = rng.integers(len(winners), size=size)
    weights = winners.weights[rows]
    if half_life > 0:
        ages = winners.ages[rows]
        weights = weights * 0.5 ** ((ages - ages.min()) / half_life)  # only ratios matter; the youngest cannot vanish
    return winners.teams[rows], weights / weights.mean()


def harvest(outcomes: Outcomes, draw_weight: float, weight_cap: float, members: int | None) -> tuple[Ints, Floats]:
    """Returns (K, T) the teams to learn from, games in order, and their (K,) weights.

    With inverse probability weighting a team A weighs w = min(1 / (N^T P(A)), cap), so that the weighted share of
    every team is proportional to how often it wins, however often it is chosen (Appendix D, which has no cap).

    Args:
        outcomes: of one epoch.
        draw_weight: factor for the teams that share a draw; 0 leaves them out.
        weight_cap: largest weight before that factor.
        members: N to weight by inverse probability; None to give every team weight 1.
    """
    scores, lineups = outcomes.scores, outcomes.lineups
    value = np.where(scores == 1.0, 1.0, np.where(scores > 0.0, draw_weight, 0.0))  # (B, S); a draw is what is shared
    kept = value > 0
    teams, weights = lineups.teams[kept], value[kept]
    if members is not None:
        chances = lineups.log_chances[kept]
        if np.isnan(chances).any():
            raise ValueError("selector.weighting needs log_chances of every team, but some are NaN.")
        log_weights = -teams.shape[1] * math.log(members) - chances
        weights = weights * np.exp(np.minimum(log_weights, math.log(weight_cap)))
    return teams, weights
