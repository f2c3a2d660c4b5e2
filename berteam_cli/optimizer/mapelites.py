"""MAP-Elites adapted to a coevolving population (paper, appendix on MAP-Elites).

It is coevolution in which a member competes only with those that behave like it: who is unique is safe, and who is
crowded is replaced by how far its fitness falls short of its neighbours' mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from berteam_cli.optimizer.aggression import aggression
from berteam_cli.optimizer.base import Probe
from berteam_cli.optimizer.coevolution import Coevolution, empty
from berteam_cli.optimizer.removal import above_neighbours, nearest
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.population import Island, Population


@dataclass(frozen=True)
class MapElites(Coevolution):
    """Coevolution with local competition.

    Attributes:
        radius: lambda, in units of aggression: who has nobody nearer is unique.
        opponents: (J, T) teams of fixed policies against which aggression is measured.
        probe_games: games against each of them.
        project_every: epochs from one measurement to the next.
        lambda_growth: where all are unique, the radius is multiplied by this until somebody is not; 1: never.
    """

    radius: float
    opponents: Ints
    probe_games: int
    project_every: int
    lambda_growth: float

    reason = "local fitness"

    def project(self, population: Population, number: int, probe: Probe) -> Population:
        """Returns the population with the aggression of the members that may matter in epoch ``number``.

        Measured are members whose policy changed since their last measurement, on islands where somebody is old enough
        to be replaced, all in one batch of games. A member is measured as a team made only of itself.
        """
        if number % self.project_every:
            return population
        due = np.concatenate(
            [
                island.first + np.flatnonzero(population.stale[island.members])
                for island in self.islands
                if (population.age[island.members] > self.protect_new).any() and not island.exploits
            ]
            or [np.zeros(0, dtype=np.int64)]
        )
        if len(due) == 0:
            return population
        games = len(self.opponents) * self.probe_games
        teams = np.repeat(due, games)[:, np.newaxis].repeat(self.opponents.shape[1], axis=1)
        others = np.tile(np.repeat(self.opponents, self.probe_games, axis=0), (len(due), 1))
        measured = aggression(probe(population, teams, others, games)).reshape(len(due), games).mean(axis=1)
        behaviour, stale = population.behaviour.copy(), population.stale.copy()
        behaviour[due], stale[due] = measured, False
        return replace(population, behaviour=behaviour, stale=stale)

    def removable(self, population: Population, island: Island) -> tuple[Ints, Floats]:
        """Returns (K,) members of ``island`` that may be drawn for removal, and (K,) their chances.

        Crowded is who has anybody of the island nearer than the radius, elites included; fitness is compared with the
        mean of those who may be drawn.
        """
        if not (population.age[island.members] > self.protect_new).any():
            return np.zeros(0, dtype=np.int64), empty()
        allowed = self.candidates(population, island)
        near, radius = nearest(population.behaviour[island.members])[allowed - island.first], self.radius
        if self.lambda_growth > 1 and len(near) and radius <= near.min() < np.inf:
            times = math.floor(math.log(near.min() / radius) / math.log(self.lambda_growth))
            radius *= self.lambda_growth**times
            while radius <= near.min():  # once or, as logarithms round, twice
                radius *= self.lambda_growth
        candidates = allowed[near < radius]
        if len(candidates) == 0:
            return candidates, empty()
        better = above_neighbours(population.fitness[candidates], population.behaviour[candidates], radius)
        return candidates, self.fitness.removal_chances(better)
