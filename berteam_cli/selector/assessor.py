"""A network that foretells games chooses the teams that should do best against those that play now.

After the neural assessor of Zhao et al. 2024 (Complex & Intelligent Systems), which learns from games of few line-ups
which line-up will win.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import OPEN, Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.rating.elo import softmax
from berteam_cli.selector.ascent import climbed
from berteam_cli.selector.base import Selecting
from berteam_cli.selector.listed import Listed, Mixture, every_team, fresh, new_among
from berteam_cli.selector.network import seeded
from berteam_cli.selector.outcome_network import OutcomeNetwork, foretold
from berteam_cli.selector.updates import Learnt, check_minibatches, check_weights, restored, untrained, updated
from berteam_cli.tensors import below

CPU = torch.device("cpu")
STARTS = 4  # random teams that a search climbs from, beside as many of those that played


class Games(NamedTuple):
    """Games to learn from.

    Attributes:
        teams: (K, S, T).
        scores: (K, S), each game's sum to 1.
    """

    teams: Ints
    scores: Floats


@dataclass(frozen=True)
class AssessorState:
    """What the assessor has learnt.

    Attributes:
        learnt: weights of the network and Adam's memory.
        ring: C games, the newest in place of the oldest.
        pushed: games pushed since the start; the next goes to row ``pushed % C``.
        will: what it chooses from; without teams before the first update.
        epochs: learnt from so far.
    """

    learnt: Learnt
    ring: Games
    pushed: int
    will: Mixture
    epochs: int

    @property
    def held(self) -> int:
        """Games in the ring."""
        return min(self.pushed, len(self.ring.teams))


@dataclass(frozen=True, eq=False)
class Assessor(Listed):
    """Chooses teams by the softmax of the score that a network foretells them against the latest line-ups.

    Before the first update every place is given to all alike.

    Attributes:
        capacity: games that are remembered.
        window: of them, the latest ones, against whose sides a team is judged.
        train_every: epochs from one update to the next.
        batch_size: games of an update, drawn with replacement.
        minibatch_size: games of one gradient step; divides ``batch_size``.
        width: of the network's layers.
        learning_rate: Adam's.
        temperature: expected score that makes a team e times as likely; 0 for the best team alone.
    """

    capacity: int
    window: int
    train_every: int
    batch_size: int
    minibatch_size: int
    width: int
    learning_rate: float
    temperature: float

    def __post_init__(self) -> None:
        """Refuses settings that exclude each other."""
        check_minibatches(self.batch_size, self.minibatch_size)

    def init(self, rng: Generator) -> AssessorState:
        """Returns random weights and no games."""
        sides, size = self.field.sides, self.field.team_size
        ring = Games(np.full((self.capacity, sides, size), OPEN), np.zeros((self.capacity, sides)))
        with seeded(rng, CPU):
            learnt = untrained(OutcomeNetwork(self.field.members, self.width), CPU)
        return AssessorState(learnt, ring, 0, Mixture(np.zeros((0, size), dtype=np.int64), np.zeros(0)), 0)

    def mixture(self, state: AssessorState) -> Mixture | None:
        """Returns what the last update led to."""
        return state.will if len(state.will.teams) else None

    def select(self, state: AssessorState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns games between teams drawn from its own will, and random ones."""
        return self.drawn_games(state, games, rng)

    def learn(
        self, state: AssessorState, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[AssessorState, Selecting]:
        """Remembers the games and, every ``train_every`` epochs, trains the network and searches anew."""
        after = replace(self._remembered(state, outcomes), epochs=state.epochs + 1)
        if after.epochs % self.train_every or not after.held:
            return after, Selecting(buffer=after.held)
        learnt, loss = updated(
            self._network,
            after.learnt,
            self._minibatches(after, rng),
            outcome_loss,
            rng,
            learning_rate=self.learning_rate,
            averaging=0.0,
        )
        after = replace(after, learnt=learnt)
        after = replace(after, will=self._searched(after, rng))
        return after, Selecting(self.batch_size // self.minibatch_size, loss, after.held)

    def foretold(self, state: AssessorState, teams: Ints, against: Ints) -> Floats:
        """Returns (K,) the expected score of ``teams``, (K, T), on average over ``against``, (C, S - 1, T)."""
        return foretold(self._loaded(state), teams, against, np.ones(len(against), dtype=np.int64))

    def tensors(self, state: AssessorState) -> dict[str, Any]:
        """Returns all that ``state`` holds as named tensors, without copies."""
        named: dict[str, Any] = {"pushed": torch.tensor(state.pushed), "epochs": torch.tensor(state.epochs)}
        named |= {f"learnt.{name}": value for name, value in state.learnt.tensors().items()}
        arrays = {
            "ring.teams": state.ring.teams,
            "ring.scores": state.ring.scores,
            "will.teams": state.will.teams,
            "will.probability": state.will.probability,
        }
        return named | {name: torch.from_numpy(array) for name, array in arrays.items()}

    def restored(self, tensors: dict[str, Any]) -> AssessorState:
        """Returns the state that ``tensors`` gave these.

        Raises:
            ValueError: they are of another network.
        """
        learnt = restored(below(tensors, "learnt."), "cpu")
        check_weights([learnt], self._network)
        return AssessorState(
            learnt,
            Games(tensors["ring.teams"].numpy(), tensors["ring.scores"].numpy()),
            int(tensors["pushed"]),
            Mixture(tensors["will.teams"].numpy(), tensors["will.probability"].numpy()),
            int(tensors["epochs"]),
        )

    @cached_property
    def _network(self) -> OutcomeNetwork:
        """The architecture; the weights it was built with are never used."""
        with seeded(np.random.default_rng(0), CPU):  # torch draws; what it draws does not matter
            return OutcomeNetwork(self.field.members, self.width)

    def _loaded(self, state: AssessorState) -> OutcomeNetwork:
        """Returns the network with its weights."""
        network = deepcopy(self._network)
        network.load_state_dict(state.learnt.weights)
        return network

    def _remembered(self, state: AssessorState, outcomes: Outcomes) -> AssessorState:
        """Returns ``state`` with the games of ``outcomes`` in the ring."""
        new = Games(outcomes.lineups.teams[-self.capacity :], outcomes.scores[-self.capacity :])
        pushed = state.pushed + len(outcomes.scores)
        rows = (pushed - len(new.teams) + np.arange(len(new.teams))) % self.capacity
        ring = Games(state.ring.teams.copy(), state.ring.scores.copy())
        ring.teams[rows], ring.scores[rows] = new
        return replace(state, ring=ring, pushed=pushed)

    def _minibatches(self, state: AssessorState, rng: Generator) -> Iterator[list[tuple[Games, float]]]:
        """Yields the minibatches of an update, each drawn anew and whole."""
        for _ in range(self.batch_size // self.minibatch_size):
            rows = rng.integers(state.held, size=self.minibatch_size)
            yield [(Games(state.ring.teams[rows], state.ring.scores[rows]), 1.0)]

    def _searched(self, state: AssessorState, rng: Generator) -> Mixture:
        """Returns the softmax over all teams, or over those that climbing finds where they are too many."""
        network, (against, often) = self._loaded(state), latest_rivals(state, self.window)

        def value(teams: Ints) -> Floats:
            return foretold(network, teams, against, often)

        teams = every_team(self.field, self.field.exact_limit)
        if teams is None:
            known = played_teams(state)
            best = known[np.argsort(-value(known), kind="stable")[:STARTS]]
            begun = np.concatenate([best, fresh(self.field, STARTS, best, rng)])
            teams = climbed(begun, value, self.field.allowed)
        expected = value(teams)
        if self.temperature == 0:
            return Mixture(teams[[expected.argmax()]], np.ones(1))
        return Mixture(teams, softmax(expected / self.temperature))


def latest_rivals(state: AssessorState, window: int) -> tuple[Ints, Ints]:
    """Returns (C, S - 1, T) whom a side met in the latest ``window`` games of the ring, and (C,) how often."""
    latest = (state.pushed - 1 - np.arange(min(window, state.held))) % len(state.ring.teams)
    teams = np.sort(state.ring.teams[latest], axis=2)
    rivals = np.concatenate([np.delete(teams, side, axis=1) for side in range(teams.shape[1])])
    return np.unique(rivals, axis=0, return_counts=True)


def played_teams(state: AssessorState) -> Ints:
    """Returns (K, T) the different teams of the remembered games, each in an order in which it played."""
    teams = state.ring.teams[: state.held].reshape(-1, state.ring.teams.shape[2])
    return new_among(teams, len(teams), teams[:0])


def outcome_loss(network: Callable[..., Tensor], games: Games, rng: Generator) -> Tensor:
    """Returns the mean cross-entropy between the sides' shares of the score and those foretold."""
    shares = torch.log_softmax(network(games.teams), dim=1)
    return -(torch.from_numpy(games.scores) * shares).sum(dim=1).mean()
