"""Settings of a learner that each of its members may have a value of its own for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.random import Generator

from berteam_cli.learner.base import Learning
from berteam_cli.outcomes import Experience, Floats
from berteam_cli.workers import Workers

TRAITS = ("learning_rate", "entropy_coef", "gamma")
"""They travel with a member when it is copied. Shape letter H: how many there are."""

L = TypeVar("L", bound=Any)


@runtime_checkable
class Tunable(Protocol):
    """A learner whose members may learn each in its own way."""

    @property
    def own_traits(self) -> tuple[str, ...]:
        """Which of TRAITS its members have."""

    def learn(
        self,
        state: Any,
        experience: Experience,
        first: int,
        rng: Generator,
        workers: Workers,
        traits: Floats | None = None,
    ) -> list[Learning]:
        """Lets members learn as ``Learner.learn`` does, with (M, H) ``traits`` in place of the learner's settings."""


def traits_of(learner: Any) -> Floats:
    """Returns (H,) the settings of a learner, NaN for those it has not."""
    return np.array([getattr(learner, name, math.nan) for name in TRAITS])


def tuned(learner: L, traits: Floats | None, row: int) -> L:
    """Returns a learner as its member ``row`` has it.

    Args:
        learner: with ``own_traits``.
        traits: (M, H) of its island; None: as the learner's settings say.
        row: the member within the island.
    """
    if traits is None:
        return learner
    own = {name: float(x) for name, x in zip(TRAITS, traits[row], strict=True) if name in learner.own_traits}
    changed: L = replace(learner, **own)
    return changed
