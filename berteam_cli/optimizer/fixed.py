"""Nobody learns and nobody is replaced: experiment 1 of the paper."""

from __future__ import annotations

from dataclasses import dataclass, replace

from numpy.random import Generator

from berteam_cli.learner.base import Learning
from berteam_cli.optimizer.base import Probe, Replacement
from berteam_cli.optimizer.fitness import FitnessRule
from berteam_cli.outcomes import Experience, Outcomes
from berteam_cli.population import Island, Population, counted, rated


@dataclass(frozen=True)
class Fixed:
    """Rates the members and leaves them as they are.

    Attributes:
        islands: of the population.
        fitness: how games become fitness.
    """

    islands: tuple[Island, ...]
    fitness: FitnessRule

    learns = False

    @property
    def terms(self) -> tuple[str, ...]:
        """None: all members are paid alike."""
        return ()

    def rate(self, population: Population, outcomes: Outcomes) -> Population:
        """Returns the population with the fitness that ``outcomes`` give."""
        return replace(counted(population, outcomes), fitness=self.fitness.rated(population.fitness, outcomes))

    def train(
        self, population: Population, experience: Experience, rng: Generator
    ) -> tuple[Population, list[tuple[int, Learning]], list[Replacement]]:
        """Returns the population as it is."""
        return population, [], []

    def project(self, population: Population, number: int, probe: Probe) -> Population:
        """Returns the population as it is."""
        return population

    def renew(self, population: Population, rng: Generator) -> tuple[Population, list[Replacement]]:
        """Returns the population one epoch older."""
        fitness, able = population.fitness.copy(), rated(self.islands)
        fitness[able] = self.fitness.centred(fitness[able])
        return replace(population, age=population.age + 1, fitness=fitness), []
