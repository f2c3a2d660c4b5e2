"""In what a copy of a member differs from its parent, when it takes the place of another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.random import Generator
from torch import Tensor

from berteam_cli.learner.breeding import Breedable, copied, cross, mutate
from berteam_cli.optimizer.perturbing import Perturbation
from berteam_cli.outcomes import NOBODY, Floats, Ints
from berteam_cli.population import Island


@dataclass(frozen=True)
class Breeding:
    """Settings of what is drawn at each replacement; what is off draws nothing.

    Attributes:
        perturbation: of the settings that travel with a member.
        mutation: standard deviation of the noise on its weights, as a share of each layer's root mean square; 0: none.
        crossover: chance of a second parent, from whom each layer comes with a chance of a half.
    """

    perturbation: Perturbation
    mutation: float
    crossover: float

    def second(self, members: Ints, chances: Floats, rng: Generator) -> int:
        """Returns the second parent of a child, or NOBODY.

        Args:
            members: (M,) of the island.
            chances: (M,) of each to be a parent, the first or the second, who may be the same.
            rng: source of chance.
        """
        if self.crossover == 0 or rng.random() >= self.crossover:
            return NOBODY
        return int(members[rng.choice(len(members), p=chances)])

    def layers_of(self, island: Island, mind: Any, parent: int) -> list[Tensor] | None:
        """Returns copies of the genes of ``parent``, a member of ``island``; None of NOBODY."""
        if parent == NOBODY or not isinstance(island.learner, Breedable):
            return None
        return copied(island.learner.genes(mind), parent - island.first)

    def vary(self, island: Island, mind: Any, child: int, theirs: list[Tensor] | None, rng: Generator) -> bool:
        """Changes the weights of ``child``, a copy of its first parent; returns whether it did.

        Args:
            island: of the child.
            mind: the state of its learner. Changed.
            child: the member.
            theirs: genes of the second parent, None where there is none.
            rng: source of chance.
        """
        learner = island.learner
        if not isinstance(learner, Breedable) or (theirs is None and self.mutation == 0):
            return False
        genes, row = learner.genes(mind), child - island.first
        if theirs is not None:
            cross(genes, learner.spans, row, theirs, rng)
        if self.mutation > 0:
            mutate(genes[0], learner.spans, row, self.mutation, rng)
        return True
