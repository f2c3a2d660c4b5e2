"""How games become fitness, and fitness becomes chances to be cloned or replaced.

Two rules: Elo of captains (paper, section on coevolution), and the moving average of scores that comes with the MCAA
mainland.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from berteam_cli.outcomes import NOBODY, Floats, Outcomes
from berteam_cli.rating.elo import POINTS_PER_NAT, points, softmax


class FitnessRule(Protocol):
    """Turns outcomes into fitness."""

    @property
    def initial(self) -> float:
        """Fitness before the first game."""

    def rated(self, fitness: Floats, outcomes: Outcomes) -> Floats:
        """Returns (N,) fitness after the games of ``outcomes``, taken one after the other."""

    def clone_chances(self, fitness: Floats) -> Floats:
        """Returns the chances to be the parent of a replacement; they sum to 1."""

    def removal_chances(self, fitness: Floats) -> Floats:
        """Returns the chances to be replaced; they sum to 1."""

    def centred(self, fitness: Floats) -> Floats:
        """Returns the fitness moved to where the rule wants its mean."""

    def shown(self, fitness: Floats) -> Floats:
        """Returns the fitness as the tables show it."""


@dataclass(frozen=True)
class CaptainElo:
    """Elo of the captains, in nats: f += c (S - Y), Y = softmax of the captains' f (paper, Algorithm 1).

    Attributes:
        captain_k: c of a captain, in Elo points (chess writes 32).
        member_k: c of every member of a team, captain included, where the mean fitness of a team's members takes the
            captain's place; 0 in the paper's experiments with learners.
    """

    captain_k: float
    member_k: float
    initial: float = 0.0

    def rated(self, fitness: Floats, outcomes: Outcomes) -> Floats:  # noqa: D102
        fitness = fitness.copy()
        captain_step, member_step = self.captain_k / POINTS_PER_NAT, self.member_k / POINTS_PER_NAT
        for teams, captains, scores in zip(
            outcomes.lineups.teams, outcomes.lineups.captains, outcomes.scores, strict=True
        ):
            if captain_step and NOBODY not in captains and len(set(captains)) > 1:
                # The same captain on all sides would win what it loses; on some of them it is paid for each.
                np.add.at(fitness, captains, captain_step * (scores - softmax(fitness[captains])))
            if member_step:
                gain = member_step * (scores - softmax(fitness[teams].mean(axis=1)))
                np.add.at(fitness, teams, gain[:, np.newaxis])
        return fitness

    def clone_chances(self, fitness: Floats) -> Floats:  # noqa: D102
        return softmax(fitness)

    def removal_chances(self, fitness: Floats) -> Floats:  # noqa: D102
        return softmax(-fitness)

    def centred(self, fitness: Floats) -> Floats:  # noqa: D102
        return fitness - fitness.mean()

    def shown(self, fitness: Floats) -> Floats:  # noqa: D102
        return points(fitness)


@dataclass(frozen=True)
class MovingAverage:
    """Mean score of the games a member was in, later ones weighing more: f <- rate S + (1 - rate) f.

    Attributes:
        rate: in (0, 1].
    """

    rate: float
    initial: float = 0.5

    def rated(self, fitness: Floats, outcomes: Outcomes) -> Floats:  # noqa: D102
        fitness = fitness.copy()
        for teams, scores in zip(outcomes.lineups.teams, outcomes.scores, strict=True):
            for team, score in zip(teams, scores, strict=True):
                for member in team:
                    fitness[member] += self.rate * (score - fitness[member])
        return fitness

    def clone_chances(self, fitness: Floats) -> Floats:  # noqa: D102
        return proportional(fitness)

    def removal_chances(self, fitness: Floats) -> Floats:  # noqa: D102
        return proportional(1.0 - fitness)

    def centred(self, fitness: Floats) -> Floats:  # noqa: D102
        return fitness

    def shown(self, fitness: Floats) -> Floats:  # noqa: D102
        return fitness


def proportional(weights: Floats) -> Floats:
    """Returns ``weights``, none negative, scaled to sum to 1; equal chances where all are 0."""
    total = weights.sum()
    return weights / total if total > 0 else np.full(len(weights), 1 / len(weights))
