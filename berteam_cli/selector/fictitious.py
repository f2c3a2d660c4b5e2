"""Fictitious play: BERTeam looks for the best response to the average of all its responses so far.

Paper, Appendix D, "Relation to Nash Equilibria"; Brown 1951; with a learnt response and a reservoir for the average as
in Heinrich and Silver 2016 (arXiv:1603.01121). In a two-sided zero-sum game the average approaches a Nash equilibrium,
however the responses go round.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.outcomes import Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector.base import Field, Selecting, TeamDistribution, most_probable
from berteam_cli.selector.berteam import Berteam
from berteam_cli.selector.berteam_state import BerteamState


@dataclass(frozen=True)
class Average:
    """Teams that stand for the average strategy, for each side that is chosen for in its own way.

    Attributes:
        teams: (S', C, T).
        responses: how many have come into it, the first included.
    """

    teams: Ints
    responses: int


def share(responses: int) -> float:
    """Returns the share of the average that response number ``responses`` takes, counted from 1: 2 / (n + 1).

    So response n weighs n, and the first ones, which were learnt against next to nothing, are soon forgotten. With
    1 / n all would weigh the same, as in Brown's fictitious play. Convergence asks only for shares that go to 0 and
    have an infinite sum (Leslie and Collins 2006, generalised weakened fictitious play).
    """
    return 2.0 / (responses + 1)


@dataclass(frozen=True)
class FictitiousState:
    """What was learnt: the response in training, and the average of all before."""

    response: BerteamState
    average: Average


@dataclass(frozen=True, eq=False)
class Fictitious:
    """Settings of fictitious play. Its own will is the average strategy; the response is how it gets there.

    Attributes:
        responder: learns the best response; with the L1 loss.
        reservoir: C, teams that stand for the average.
        sharpening: power of the conditionals of the teams by which a response joins the average: it has to be soft to
            learn what it does not choose, and what joins need not be.
    """

    responder: Berteam
    reservoir: int
    sharpening: float

    def __post_init__(self) -> None:
        """Refuses what is no best response."""
        if self.responder.loss != "l1":
            raise ValueError(
                "selector.opponents=average needs selector.loss=l1: the average of what mlm learns is no equilibrium."
            )
        if self.responder.answers:
            raise ValueError(
                "selector.opponents=average needs selector.observations.use=none or self: the average looks at nobody."
            )

    @property
    def field(self) -> Field:
        """Among whom it chooses."""
        return self.responder.field

    @property
    def observes(self) -> bool:
        """Whether it wants to know what players saw."""
        return self.responder.observes

    @property
    def seen_bytes(self) -> int:
        """Bytes that it takes to remember what they saw."""
        return self.responder.seen_bytes

    @property
    def answers(self) -> bool:
        """Whether it chooses teams for a second game on what was seen in the first."""
        return self.responder.answers

    @property
    def by_side(self) -> bool:
        """Whether a team's chance depends on the side it plays."""
        return self.responder.by_side

    def init(self, rng: Generator) -> FictitiousState:
        """Returns random weights; what they choose is the first response."""
        response = self.responder.init(rng)
        return FictitiousState(response, Average(self._made(response, self.reservoir, rng), 1))

    def select(self, state: FictitiousState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns games of a response, chosen for side b % S of game b, against teams of the average.

        Those of the average are captained by any of their members; their ``log_chances`` are NaN.
        """
        field, rows = self.field, np.arange(games)
        side = responding(games, field.sides)
        new = self.responder.select_for(state.response, side, ages, rng)
        kind = np.arange(field.sides) % self._kinds
        teams = state.average.teams[kind, rng.integers(self.reservoir, size=(games, field.sides))]
        leaders = rng.permuted(teams, axis=2)[:, :, 0]
        chances = np.full(leaders.shape, np.nan)
        teams[rows, side], leaders[rows, side] = new.teams[:, 0], new.captains[:, 0]
        chances[rows, side] = new.log_chances[:, 0]
        return Lineups(teams, leaders, chances)

    def sample(self, state: FictitiousState, count: int, rng: Generator, side: int | None = None) -> Ints:
        """Returns (count, T) teams of the average, for ``side`` or for one drawn at random for each."""
        kind = np.arange(count) % self._kinds if side is None else np.full(count, side % self._kinds)
        return state.average.teams[kind, rng.integers(self.reservoir, size=count)]

    def distribution(self, state: FictitiousState, side: int | None = None) -> TeamDistribution:
        """Returns how often each unordered team is in the average; for ``side``, or the mean over sides."""
        held = self._held(state, side)
        teams, counts = np.unique(np.sort(held, axis=1), axis=0, return_counts=True)
        return TeamDistribution(teams, counts / len(held))

    def lists(self, state: FictitiousState) -> bool:
        """Returns True: the average is a list of teams."""
        return True

    def likeliest(self, state: FictitiousState, count: int, rng: Generator) -> TeamDistribution:
        """Returns the ``count`` most frequent unordered teams of the average."""
        return most_probable(self.distribution(state), count)

    def captains(self, state: FictitiousState) -> Floats:
        """Returns (N,) how often each member is in the average: any place of a team is the first as often."""
        held = self._held(state, None)
        return np.bincount(held.ravel(), minlength=self.field.members) / held.size

    def learn(
        self, state: FictitiousState, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[FictitiousState, Selecting]:
        """Trains the response on what came of it; after each update some of its teams join the average."""
        games, sides = outcomes.scores.shape
        mine = responding(games, sides)[:, np.newaxis] == np.arange(sides)
        response, did = self.responder.study(state.response, self.responder.examples(outcomes, seen, mine), rng)
        after = replace(state, response=response)
        if did.updates:
            after = replace(after, average=self._averaged(state.average, response, rng))
        return after, did

    def remarks(self) -> list[str]:
        """Returns what a reader should know."""
        said = "selector.opponents=average: teams, distributions and captains are those of the average of all responses"
        return [f"{said}, of which {self.reservoir} teams are kept.", *self.responder.remarks()]

    def tensors(self, state: FictitiousState) -> dict[str, Any]:
        """Returns all that ``state`` holds as named tensors, without copies."""
        average = state.average
        named = {"average.teams": torch.from_numpy(average.teams), "average.responses": torch.tensor(average.responses)}
        return self.responder.tensors(state.response) | named

    def restored(self, tensors: dict[str, Any]) -> FictitiousState:
        """Returns the state that ``tensors`` gave these."""
        average = Average(tensors["average.teams"].cpu().numpy(), int(tensors["average.responses"]))
        return FictitiousState(self.responder.restored(tensors), average)

    def embeddings(self, state: FictitiousState) -> Floats:
        """Returns (N, width) the token of each member in the response."""
        return self.responder.embeddings(state.response)

    @property
    def _kinds(self) -> int:
        """S', sides that are chosen for each in its own way."""
        return self.field.sides if self.by_side else 1

    def _held(self, state: FictitiousState, side: int | None) -> Ints:
        """Returns (K, T) the teams of the average for ``side``, or for all."""
        teams = state.average.teams
        return teams.reshape(-1, teams.shape[2]) if side is None else teams[side % self._kinds]

    def _averaged(self, average: Average, response: BerteamState, rng: Generator) -> Average:
        """Returns ``average`` with its share of teams, drawn uniformly, in which ``response`` takes their place."""
        responses, teams = average.responses + 1, average.teams.copy()
        new = self._made(response, rng.binomial(self.reservoir, share(responses)), rng)
        for side in range(self._kinds):
            teams[side, rng.permutation(self.reservoir)[: new.shape[1]]] = new[side]
        return Average(teams, responses)

    def _made(self, response: BerteamState, count: int, rng: Generator) -> Ints:
        """Returns (S', count, T) teams that ``response`` makes of its own will, sharpened."""
        sides = range(self._kinds) if self.by_side else (None,)
        return np.stack(
            [self.responder.sample(response, count, rng, side, sharpening=self.sharpening) for side in sides]
        )


def responding(games: int, sides: int) -> Ints:
    """Returns (B,) the side that responds in each game."""
    return np.arange(games) % sides
