"""Every team is as likely as any other: the baseline that learns nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector import independent
from berteam_cli.selector.base import Field, Plain, Selecting, TeamDistribution, exactly
from berteam_cli.selector.captains import captains, opening
from berteam_cli.selector.filling import drawn


@dataclass(frozen=True, eq=False)
class Uniform(Plain):
    """Gives every place to all who may stand there alike; its state is None.

    Attributes:
        field: among whom it chooses.
        captain: "matching" (everyone captains before anyone does twice) or "uniform".
    """

    field: Field
    captain: str

    def init(self, rng: Generator) -> None:
        """Returns nothing: there is nothing to learn."""

    def select(self, state: None, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns the teams of ``games`` games; each captain stands at a random place among those it may stand at."""
        field, chances = self.field, self._chances()
        begun = opening(self.captain, chances, np.zeros(field.members), field.allowed)  # (T, N)
        leaders = captains(self.captain, np.tile(begun.sum(axis=0), (games, field.sides, 1)), rng)
        teams = self.sample(state, games * field.sides, rng)
        places = drawn(begun[:, leaders.ravel()].T, rng)
        teams[np.arange(len(teams)), places] = leaders.ravel()
        return Lineups(
            teams.reshape(*leaders.shape, -1), leaders, self._log_chances(teams, begun).reshape(leaders.shape)
        )

    def sample(self, state: None, count: int, rng: Generator) -> Ints:
        """Returns (count, T) teams."""
        return independent.sampled(self._chances(), count, rng)

    def distribution(self, state: None) -> TeamDistribution:
        """Returns the chance of every unordered team: as many as it has orders, over all orders of all teams."""
        return independent.distribution(self._chances(), self.field)

    def likeliest(self, state: None, count: int, rng: Generator) -> TeamDistribution:
        """Returns ``count`` of the teams that are most likely, many of them alike."""
        return independent.top(self._chances(), self.field, count, rng, listed=exactly(self.field))

    def captains(self, state: None) -> Floats:
        """Returns (N,) how often each member stands at a place."""
        return self._chances().mean(axis=0)

    def learn(
        self, state: None, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[None, Selecting]:
        """Returns nothing learnt."""
        return None, Selecting()

    def tensors(self, state: None) -> dict[str, Any]:
        """Returns no tensors."""
        return {}

    def restored(self, tensors: dict[str, Any]) -> None:
        """Returns nothing."""

    def _chances(self) -> Floats:
        """Returns (T, N) the chance of each member at each place."""
        return independent.anybody(self.field)

    def _log_chances(self, teams: Ints, begun: Floats) -> Floats:
        """Returns (K,) ln of the chance of each of ``teams``, over all captains it could have."""
        chances = self._chances()
        places = np.arange(len(chances))
        alone = np.log(chances[places, teams])  # (K, T)
        first = np.log(begun[places, teams])
        # Captain at place i, everybody else by chance.
        return np.logaddexp.reduce(first - alone, axis=1) + alone.sum(axis=1)
