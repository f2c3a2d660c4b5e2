"""Every team is as likely as any other: the baseline that learns nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Floats, Ints, Lineups, Outcomes
from berteam_cli.selector.base import Field, Selecting, TeamDistribution, orderings, unordered_teams
from berteam_cli.selector.captains import dealt, distinct


@dataclass(frozen=True)
class Uniform:
    """Gives every place to every member alike; its state is None.

    Attributes:
        field: among whom it chooses.
        captain: "matching" (everyone captains before anyone does twice) or "uniform".
    """

    field: Field
    captain: str

    def init(self, rng: Generator) -> None:
        """Returns nothing: there is nothing to learn."""

    def select(self, state: None, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns the teams of ``games`` games; each captain stands at a random place of its team."""
        field = self.field
        deal = dealt if self.captain == "matching" else distinct
        captains = deal(games, field.sides, field.members, rng)
        teams = self.sample(state, games * field.sides, rng).reshape(games, field.sides, field.team_size)
        places = rng.integers(field.team_size, size=captains.shape)
        np.put_along_axis(teams, places[:, :, np.newaxis], captains[:, :, np.newaxis], axis=2)
        chance = -field.team_size * math.log(field.members)
        return Lineups(teams, captains, np.full(captains.shape, chance))

    def sample(self, state: None, count: int, rng: Generator) -> Ints:
        """Returns (count, T) teams."""
        return rng.integers(self.field.members, size=(count, self.field.team_size))

    def distribution(self, state: None) -> TeamDistribution:
        """Returns the chance of every unordered team: as many as it has orders, over all orders of all teams."""
        teams = unordered_teams(self.field.members, self.field.team_size)
        return TeamDistribution(teams, orderings(teams) / float(self.field.members) ** self.field.team_size)

    def captains(self, state: None) -> Floats:
        """Returns (N,) equal chances."""
        return np.full(self.field.members, 1 / self.field.members)

    def learn(self, state: None, outcomes: Outcomes, rng: Generator) -> tuple[None, Selecting]:
        """Returns nothing learnt."""
        return None, Selecting()

    def tensors(self, state: None) -> dict[str, Any]:
        """Returns no tensors."""
        return {}

    def restored(self, tensors: dict[str, Any]) -> None:
        """Returns nothing."""
