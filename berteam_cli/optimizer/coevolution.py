"""Coevolutionary deep reinforcement learning (paper, Algorithm 1): learn, then clone the fit over the unfit."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from berteam_cli.learner.base import Learning
from berteam_cli.learner.traits import Tunable
from berteam_cli.optimizer.base import Replacement
from berteam_cli.optimizer.breeding import Breeding
from berteam_cli.optimizer.fixed import Fixed
from berteam_cli.outcomes import Experience, Floats, Ints
from berteam_cli.population import ARRAYS, Island, Population
from berteam_cli.workers import Workers

log = logging.getLogger("berteam")

HOPELESS = 2  # epochs in a row in which nothing but undone updates came


@dataclass(frozen=True)
class Coevolution(Fixed):
    """Members learn from their own steps; the least fit are replaced by copies of the fittest.

    Attributes:
        workers: threads that share the learning.
        replacements: n_rem, at most so many members are replaced in an epoch, over all islands.
        elites: so many of the fittest of each island are never replaced.
        protect_new: a member of at most this age, in epochs, is never replaced.
        draw_protected: whether protected members are drawn for removal, in vain, as in the published code; else the
            draw is among those who can be replaced.
        breeding: in what a copy differs from its parent.
    """

    workers: Workers
    replacements: int
    elites: int
    protect_new: int
    draw_protected: bool
    breeding: Breeding

    learns = True
    reason = "fitness"

    @property
    def terms(self) -> tuple[str, ...]:
        """The terms of the game's reward, where members have factors of their own for them; else none."""
        return self.breeding.perturbation.terms

    def train(
        self, population: Population, experience: Experience, rng: Generator
    ) -> tuple[Population, list[tuple[int, Learning]], list[Replacement]]:
        """Returns the population after each member learnt from its own steps.

        Also returns what was learnt, (island, figures), and who was replaced for being unable to learn any more.
        """
        learnt = []
        for i, (island, mind, stream) in enumerate(
            zip(self.islands, population.minds, rng.spawn(len(self.islands)), strict=True)
        ):
            given = (mind, experience, island.first, stream, self.workers)
            if self.breeding.perturbation.moved and isinstance(island.learner, Tunable):
                figures = island.learner.learn(*given, population.traits[island.members])
            else:
                figures = island.learner.learn(*given)
            learnt += [(i, x) for x in figures]
        population = own(population)
        for i, x in learnt:
            member = self.islands[i].first + x.row
            population.stale[member] |= x.updates > 0
            if x.updates or x.failures:
                population.failed[member] = 0 if x.updates else population.failed[member] + 1
        return population, learnt, self.healed(population, learnt)

    def healed(self, population: Population, learnt: list[tuple[int, Learning]]) -> list[Replacement]:
        """Replaces members whose weights no update can move to finite ones; changes the population's arrays.

        One update that was undone is bad luck, and the member goes on from its last good weights. If nothing but
        such updates came twice in a row, it becomes a copy of who is on its parent's place, or of the fittest of its
        island.
        """
        failed = [(i, self.islands[i].first + x.row) for i, x in learnt if x.failures]
        if failed:
            who = ", ".join(str(member) for _, member in failed)
            log.warning("Updates gave weights or a loss that are not finite, and were undone; of members: %s.", who)
        replaced = []
        for i, member in failed:
            if population.failed[member] < HOPELESS:
                continue
            island = self.islands[i]
            able = np.flatnonzero(population.failed[island.members] == 0) + island.first
            if len(able) == 0:
                log.warning("Nobody of island %s can learn any more: its settings do not work.", island.name)
                continue
            parent = int(population.parent[member])
            if parent not in able:
                parent = int(able[np.argmax(population.fitness[able])])
            replaced.append(self.replacement(population, i, member, parent, "not finite"))
            log.warning("Member %d cannot learn from there any more; it becomes a copy of %d.", member, parent)
        return replaced

    def renew(self, population: Population, rng: Generator) -> tuple[Population, list[Replacement]]:
        """Returns the population one epoch older, after at most ``replacements`` members were replaced.

        The islands are visited in random order. In each, members are drawn for removal without replacement and as
        many parents with replacement; a protected member keeps its place, and who is drawn as its own parent stays as
        it is (paper, section on coevolution). Places change hands one after the other: a parent whose own place was
        just taken passes on what it became.
        """
        population = own(population)
        replaced: list[Replacement] = []
        for i in rng.permutation(len(self.islands)):
            left = self.replacements - len(replaced)
            if left <= 0:
                break
            candidates, chances = self.removable(population, self.islands[i])
            count = min(left, int((chances > 0).sum()))
            if count == 0:
                continue
            removed = candidates[rng.choice(len(candidates), size=count, replace=False, p=chances)]
            everyone = np.array(self.islands[i].numbers)
            likely = self.fitness.clone_chances(population.fitness[everyone])
            parents = everyone[rng.choice(len(everyone), size=count, p=likely)]
            for place, parent in zip(removed, parents, strict=True):
                if place != parent and population.age[place] > self.protect_new:
                    second = self.breeding.second(everyone, likely, rng)
                    replaced.append(self.child(population, int(i), int(place), int(parent), second, rng))
        older, _ = super().renew(population, rng)
        return older, replaced

    def removable(self, population: Population, island: Island) -> tuple[Ints, Floats]:
        """Returns (K,) members of ``island`` that may be drawn for removal, and (K,) their chances."""
        candidates = self.candidates(population, island)
        return candidates, self.fitness.removal_chances(population.fitness[candidates]) if len(candidates) else empty()

    def candidates(self, population: Population, island: Island) -> Ints:
        """Returns the members of ``island`` that are no elites, nor protected where those are not drawn.

        Nobody of exploiters, whose games are not rated.
        """
        if island.exploits:
            return np.zeros(0, dtype=np.int64)
        everyone = np.array(island.numbers)
        fittest_first = everyone[np.argsort(-population.fitness[everyone], kind="stable")]
        candidates = np.sort(fittest_first[self.elites :])
        return candidates if self.draw_protected else candidates[population.age[candidates] > self.protect_new]

    def child(
        self, population: Population, i: int, place: int, parent: int, second: int, rng: Generator
    ) -> Replacement:
        """Puts a child of ``parent`` on ``place``; changes the arrays and minds of ``population``.

        Args:
            population: whose arrays may be changed.
            i: index of the island.
            place: who gives way.
            parent: of whom the child is a copy.
            second: who gives it layers, NOBODY for none; as they are before the place changes hands.
            rng: what the child differs by is drawn from it.
        """
        island, mind, breeding = self.islands[i], population.minds[i], self.breeding
        theirs = breeding.layers_of(island, mind, second)
        record = self.replacement(population, i, place, parent, self.reason)
        if breeding.vary(island, mind, place, theirs, rng):
            population.stale[place] = True
        own = breeding.perturbation.child(population.traits[place], population.pay[place], rng)
        population.traits[place], population.pay[place] = own
        return replace(record, second_parent=second)

    def replacement(self, population: Population, i: int, place: int, parent: int, reason: str) -> Replacement:
        """Puts a copy of ``parent`` on ``place``; changes the arrays and minds of ``population``."""
        fitness = self.fitness.shown(population.fitness[[place, parent]])
        record = Replacement(i, place, parent, float(fitness[0]), float(fitness[1]), int(population.age[place]), reason)
        first = self.islands[i].first
        self.islands[i].learner.copy(population.minds[i], place - first, parent - first)
        population.fitness[place] = population.fitness[parent]
        population.behaviour[place] = population.behaviour[parent]
        population.stale[place] = population.stale[parent]
        population.failed[place] = population.failed[parent]
        population.traits[place], population.pay[place] = population.traits[parent], population.pay[parent]
        population.age[place] = 0
        population.games[place] = population.captain_games[place] = 0
        population.parent[place] = parent
        return record


def own(population: Population) -> Population:
    """Returns the population with arrays of its own, which may be changed."""
    return replace(population, **{x: getattr(population, x).copy() for x in ARRAYS})


def empty() -> Floats:
    """Returns the chances of nobody."""
    return np.zeros(0)
