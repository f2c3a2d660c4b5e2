"""The mainland of MCAA: teams are made by how many members each island should send (paper, section on MCAA).

Every place of a team is drawn by itself: an island from the softmax of the logits, then a member of it, each alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.outcomes import NOBODY, Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.rating.elo import softmax
from berteam_cli.selector import independent
from berteam_cli.selector.base import Field, Plain, Selecting, TeamDistribution, exactly
from berteam_cli.selector.filling import within


@dataclass(frozen=True)
class McaaState:
    """What MCAA has learnt.

    Attributes:
        logits: (I,) of the islands.
        wins: (I,) members of each island in the teams that won since the last update.
        epochs: learnt from so far.
    """

    logits: Floats
    wins: Ints
    epochs: int

    @property
    def shares(self) -> Floats:
        """(I,) chance that a place is given to each island."""
        return softmax(self.logits)


@dataclass(frozen=True, eq=False)
class Mcaa(Plain):
    """Moves the islands' shares towards those among the winners.

    Attributes:
        field: among whom it chooses.
        learning_rate: eta, the step on the logits.
        train_every: epochs between two steps.
    """

    field: Field
    learning_rate: float
    train_every: int

    def init(self, rng: Generator) -> McaaState:
        """Returns equal shares."""
        islands = int(self.field.island_of.max()) + 1
        return McaaState(np.zeros(islands), np.zeros(islands, dtype=np.int64), 0)

    def select(self, state: McaaState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns the teams of ``games`` games; MCAA knows neither captains nor noise for new members."""
        sides = self.field.sides
        teams = self.sample(state, games * sides, rng).reshape(games, sides, self.field.team_size)
        nobody = np.full((games, sides), NOBODY, dtype=np.int64)
        return Lineups(teams, nobody, independent.log_chances(self._chances(state), teams))

    def sample(self, state: McaaState, count: int, rng: Generator) -> Ints:
        """Returns (count, T) teams."""
        return independent.sampled(self._chances(state), count, rng)

    def distribution(self, state: McaaState) -> TeamDistribution:
        """Returns the chance of every unordered team: its orders times the product of its members' chances."""
        return independent.distribution(self._chances(state), self.field)

    def likeliest(self, state: McaaState, count: int, rng: Generator) -> TeamDistribution:
        """Returns the ``count`` most probable teams."""
        return independent.top(self._chances(state), self.field, count, rng, listed=exactly(self.field))

    def captains(self, state: McaaState) -> Floats:
        """Returns (N,) how often each member stands at a place."""
        return self._chances(state).mean(axis=0)

    def learn(
        self, state: McaaState, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[McaaState, Selecting]:
        """Returns the state after counting the winners and, every ``train_every`` epochs, one gradient step.

        The step goes down half the squared distance between the winners' island shares q and the own shares s:
        logits += eta J (q - s), with J = diag(s) - s s^T the Jacobian of the softmax.
        """
        islands = self.field.island_of[outcomes.winners.ravel()]
        wins = state.wins + np.bincount(islands, minlength=len(state.logits))
        state = replace(state, wins=wins, epochs=state.epochs + 1)
        if state.epochs % self.train_every or not wins.any():
            return state, Selecting(buffer=int(wins.sum()) // self.field.team_size)
        shares = state.shares
        error = wins / wins.sum() - shares
        step = shares * (error - shares @ error)
        learnt = replace(state, logits=state.logits + self.learning_rate * step, wins=np.zeros_like(wins))
        return learnt, Selecting(updates=1, loss=float(error @ error / 2))

    def tensors(self, state: McaaState) -> dict[str, Any]:
        """Returns ``state`` as tensors."""
        return {
            "logits": torch.from_numpy(state.logits),
            "wins": torch.from_numpy(state.wins),
            "epochs": torch.tensor(state.epochs),
        }

    def restored(self, tensors: dict[str, Any]) -> McaaState:
        """Returns the state that gave ``tensors``."""
        return McaaState(tensors["logits"].numpy(), tensors["wins"].numpy(), int(tensors["epochs"]))

    def _chances(self, state: McaaState) -> Floats:
        """Returns (T, N) the chance of each member at each place, in proportion to its island's share."""
        sizes = np.bincount(self.field.island_of)
        chances = (state.shares / sizes)[self.field.island_of]
        return within(np.tile(chances / chances.sum(), (self.field.team_size, 1)), self.field.allowed)
