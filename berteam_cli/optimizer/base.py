"""What the loop asks of an optimizer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from numpy.random import Generator

from berteam_cli.learner.base import Learning
from berteam_cli.optimizer.fitness import FitnessRule
from berteam_cli.outcomes import NOBODY, Experience, Ints, Outcomes
from berteam_cli.population import Island, Population


@dataclass(frozen=True)
class Replacement:
    """One member that gave its place to a copy of another.

    Attributes:
        island: index of the island.
        removed: the place.
        parent: whose copy took it.
        removed_fitness, parent_fitness: on the scale of the tables, before the replacement.
        removed_age: epochs.
        reason: the rule that chose the removed one.
        second_parent: who gave some of its layers, NOBODY where the copy is of one parent.
    """

    island: int
    removed: int
    parent: int
    removed_fitness: float
    parent_fitness: float
    removed_age: int
    reason: str
    second_parent: int = NOBODY


Probe = Callable[[Population, Ints, Ints, int], Outcomes]
"""Plays probing games nobody learns from.

Called with the population, the teams of the members (B, T), the opposing fixed policies (B, T), and how many games in a
row are the same team's; returns outcomes with the members as side 0 in every record, played from each side in turn.
"""


class Optimizer(Protocol):
    """Makes a population better from its games; keeps settings only."""

    @property
    def islands(self) -> tuple[Island, ...]:
        """Of the population."""

    @property
    def fitness(self) -> FitnessRule:
        """How games become fitness."""

    @property
    def learns(self) -> bool:
        """Whether ``train`` wants to know what the players saw."""

    @property
    def terms(self) -> tuple[str, ...]:
        """The terms of the game's reward, where members have factors of their own for them; else none."""

    def rate(self, population: Population, outcomes: Outcomes) -> Population:
        """Returns the population with the fitness that ``outcomes`` give."""

    def train(
        self, population: Population, experience: Experience, rng: Generator
    ) -> tuple[Population, list[tuple[int, Learning]], list[Replacement]]:
        """Returns the population after each member learnt from its own steps.

        Also returns what was learnt, (island, figures), and who was replaced for being unable to learn any more.
        """

    def project(self, population: Population, number: int, probe: Probe) -> Population:
        """Returns the population with its behaviour measured where this optimizer needs it in epoch ``number``."""

    def renew(self, population: Population, rng: Generator) -> tuple[Population, list[Replacement]]:
        """Returns the population one epoch older, after some members were replaced by copies of others."""
