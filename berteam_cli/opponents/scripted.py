"""Fixed policies of the game as opponents."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies
from berteam_cli.opponents.base import SCRIPTED, Guest
from berteam_cli.outcomes import Ints


@dataclass(frozen=True)
class Scripted:
    """Settings of teams of fixed policies.

    Attributes:
        games: of an epoch that are against them.
        indices: of the game's fixed policies, those that are met.
        names: of these.
    """

    games: int
    indices: tuple[int, ...]
    names: tuple[str, ...]

    def invited(
        self, first: int, team_size: int, sides: Ints, rng: Generator
    ) -> tuple[Ints, list[Policies], list[Guest]]:
        """Returns teams in which each place is given to any of the policies alike; as of Past.invited."""
        drawn = rng.integers(len(self.indices), size=(len(sides), team_size))
        guests = [
            Guest(SCRIPTED, "-".join(self.names[k] for k in sorted(team)), int(side))
            for team, side in zip(drawn.tolist(), sides, strict=True)
        ]
        return first + drawn, [fixed_policies(np.array(self.indices))], guests
