"""Settings that travel with a member: a copy has its parent's, moved a little (population-based training).

Jaderberg et al., Population Based Training of Neural Networks (2017), whose "explore" multiplies or divides likewise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from berteam_cli.bounds import LIMIT
from berteam_cli.learner.traits import TRAITS
from berteam_cli.outcomes import Floats

GAMMA = TRAITS.index("gamma")


@dataclass(frozen=True)
class Perturbation:
    """How far the settings of a copy are from its parent's.

    Attributes:
        factors: (H,) of TRAITS, at least 1; 1: the copy has the same.
        reward: the same of the factors of reward weights.
        terms: of the game's reward, in the order of ``Policies.pay``; none where ``reward`` is 1.
        weighed: places of those terms that have a weight.
    """

    factors: tuple[float, ...]
    reward: float
    terms: tuple[str, ...]
    weighed: tuple[int, ...]

    @property
    def moved(self) -> tuple[int, ...]:
        """Places of the traits that are moved."""
        return tuple(k for k, factor in enumerate(self.factors) if factor > 1)

    def child(self, traits: Floats, pay: Floats, rng: Generator) -> tuple[Floats, Floats]:
        """Returns a copy's own settings: each of the parent's times its factor or divided by it, with equal chance.

        A discount is moved by its distance from 1, whose inverse is how many steps it looks ahead.

        Args:
            traits: (H,) of the parent.
            pay: (P,) of the parent.
            rng: draws one number for each setting that is moved.
        """
        traits, pay = traits.copy(), pay.copy()
        count = len(self.moved) + len(self.weighed)
        up = rng.integers(2, size=count) if count else np.zeros(0, dtype=np.int64)
        for k, more in zip(self.moved, up[: len(self.moved)], strict=True):
            if k == GAMMA:
                traits[k] = np.clip(1 - times(1 - traits[k], self.factors[k], more), 0, 1)
            else:
                traits[k] = min(times(traits[k], self.factors[k], more), LIMIT)
        for k, more in zip(self.weighed, up[len(self.moved) :], strict=True):
            pay[k] = times(pay[k], self.reward, more)
        return traits, pay


def times(value: float, factor: float, more: int) -> float:
    """Returns ``value`` times ``factor``, or divided by it; what is above 0 stays so."""
    return value * factor if more else max(value / factor, np.finfo(np.float64).tiny * (value > 0))


def reward_factors(terms: Sequence[str], pay: Floats) -> str:
    """Returns by what a member's reward weights are multiplied, in words; nothing where all are 1.

    Args:
        terms: of the game's reward.
        pay: (P,) their factors.
    """
    said = ((term, f"{factor:.6g}") for term, factor in zip(terms, pay, strict=True))
    return " ".join(f"{term}={factor}" for term, factor in said if factor != "1")
