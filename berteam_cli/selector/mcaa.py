"""The mainland of MCAA: teams are made by how many members each island should send (paper, section on MCAA).

Every place of a team is drawn by itself: an island from the softmax of the logits, then a member of it, each alike.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.outcomes import NOBODY, Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.rating.elo import softmax
from berteam_cli.selector import independent
from berteam_cli.selector.base import Field, Plain, Selecting, TeamDistribution, exactly
from berteam_cli.selector.filling import within
from berteam_cli.selector.tally import Tally, no_games


@dataclass(frozen=True)
class McaaState:
    """What MCAA has learnt.

    Attributes:
        logits: (I,) of the islands.
        wins: (I,) members of each island in the teams that won since the last update.
        epochs: learnt from so far.
        tally: of the teams that played since the last update; None where only wins count.
    """

    logits: Floats
    wins: Ints
    epochs: int
    tally: Tally | None = None

    @property
    def shares(self) -> Floats:
        """(I,) chance that a place at which everybody may stand is given to each island."""
        return softmax(self.logits)


@dataclass(frozen=True, eq=False)
class Mcaa(Plain):
    """Moves the islands' shares towards those among the teams that count.

    Attributes:
        field: among whom it chooses.
        learning_rate: eta, the step on the logits.
        train_every: epochs between two steps.
        top_fraction: share of the teams, by mean score, whose members are counted; None: those of winners are, once for
            each win (the paper's adaptation).
    """

    field: Field
    learning_rate: float
    train_every: int
    top_fraction: float | None = None

    def init(self, rng: Generator) -> McaaState:
        """Returns equal shares."""
        islands = int(self.field.island_of.max()) + 1
        return McaaState(np.zeros(islands), np.zeros(islands, dtype=np.int64), 0, self._nobody())

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
        """Returns the state after counting the games and, every ``train_every`` epochs, one gradient step.

        The step goes down half the squared distance between the island shares q of the teams that count and those of
        the teams that it draws, s, the mean over places of s_t: logits += eta J (q - s), where J is the mean of
        diag(s_t) - s_t s_t^T, the Jacobian of s. Where everybody may stand anywhere, s is the softmax.
        """
        state = replace(self._counted(state, outcomes), epochs=state.epochs + 1)
        teams = len(state.tally) if state.tally is not None else int(state.wins.sum()) // self.field.team_size
        if state.epochs % self.train_every:
            return state, Selecting(buffer=teams)
        members = state.wins if state.tally is None else self._of_the_best(state.tally, len(state.logits))
        if not members.any():
            return state, Selecting(buffer=teams, skipped=1)
        shares = self._shares(state)
        # q and s are means over places, not one for each: a tally does not keep who stood where.
        error = members / members.sum() - shares.mean(axis=0)
        step = (shares * (error - (shares @ error)[:, np.newaxis])).mean(axis=0)
        logits = state.logits + self.learning_rate * step
        learnt = replace(state, logits=logits, wins=np.zeros_like(state.wins), tally=self._nobody())
        return learnt, Selecting(updates=1, loss=float(error @ error / 2))

    def tensors(self, state: McaaState) -> dict[str, Any]:
        """Returns ``state`` as tensors."""
        named = {
            "logits": torch.from_numpy(state.logits),
            "wins": torch.from_numpy(state.wins),
            "epochs": torch.tensor(state.epochs),
        }
        if state.tally is not None:
            named |= {x.name: torch.from_numpy(getattr(state.tally, x.name)) for x in fields(Tally)}
        return named

    def restored(self, tensors: dict[str, Any]) -> McaaState:
        """Returns the state that gave ``tensors``."""
        tally = None
        if self.top_fraction is not None:
            tally = Tally(*(tensors[x.name].numpy() for x in fields(Tally)))
        return McaaState(tensors["logits"].numpy(), tensors["wins"].numpy(), int(tensors["epochs"]), tally)

    def _nobody(self) -> Tally | None:
        """Returns the tally of no team, where teams are ranked."""
        return None if self.top_fraction is None else no_games(np.zeros((0, self.field.team_size), dtype=np.int64))

    def _counted(self, state: McaaState, outcomes: Outcomes) -> McaaState:
        """Returns ``state`` with the games of one more epoch."""
        if state.tally is not None:
            return replace(state, tally=state.tally.after_all(outcomes))
        islands = self.field.island_of[outcomes.winners.ravel()]
        return replace(state, wins=state.wins + np.bincount(islands, minlength=len(state.logits)))

    def _of_the_best(self, tally: Tally, islands: int) -> Floats:
        """Returns (I,) the members of each island in the best of the teams that played."""
        assert self.top_fraction is not None, "no teams are ranked"
        weights = np.repeat(top_weights(tally.mean, self.top_fraction), self.field.team_size)
        places = self.field.island_of[tally.teams.ravel()]
        # numpy's types forget the weights.
        return np.bincount(places, weights=weights, minlength=islands)  # type: ignore[return-value]

    def _shares(self, state: McaaState) -> Floats:
        """Returns (T, I) the chance that each place is given to each island, within the rules.

        s_ti ~ exp(logit_i) times the part of island i that may stand at place t. Were winners compared with the softmax
        alone, the logits would move although nobody wins more often than others.
        """
        islands = len(state.logits)
        places = [np.bincount(self.field.island_of, row, minlength=islands) for row in self._chances(state)]
        return np.array(places)

    def _chances(self, state: McaaState) -> Floats:
        """Returns (T, N) the chance of each member at each place, in proportion to its island's share."""
        sizes = np.bincount(self.field.island_of)
        chances = (state.shares / sizes)[self.field.island_of]
        return within(np.tile(chances / chances.sum(), (self.field.team_size, 1)), self.field.allowed)


def top_weights(scores: Floats, fraction: float) -> Floats:
    """Returns (K,) how much of each team is in the best ``fraction`` of all; the weights sum to fraction K.

    Equally good teams at the cut share what is left for them.

    Args:
        scores: (K,) of the teams.
        fraction: in (0, 1].
    """
    best_first = -np.round(scores, 12)  # means of equal scores differ in their last digits
    _, which, counts = np.unique(best_first, return_inverse=True, return_counts=True)
    ahead = np.cumsum(counts) - counts
    return np.clip((fraction * len(scores) - ahead) / counts, 0.0, 1.0)[which.reshape(-1)]
