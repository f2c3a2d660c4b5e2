"""Nobody is met beside the population, as in the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.random import Generator

from berteam_cli.opponents.base import Choose, Guests, Met, Whose, nobody
from berteam_cli.population import Population


@dataclass(frozen=True)
class Nobody:
    """Brings no opponents; its state is None.

    Attributes:
        sides: S.
        team_size: T.
    """

    sides: int
    team_size: int

    games = 0

    def begun(self, population: Population) -> None:
        """Returns nothing: there is nothing to keep."""

    def invited(self, state: None, members: int, choose: Choose, rng: Generator) -> Guests:
        """Returns no guests; draws nothing."""
        return nobody(self.sides, self.team_size)

    def renewed(
        self, state: None, met: Met, population: Population, epoch: int, rng: Generator
    ) -> tuple[Population, None]:
        """Returns the population as it is."""
        return population, None

    def standings(self, state: None) -> dict[Whose, tuple[float, float]]:
        """Returns nobody."""
        return {}

    def remarks(self) -> list[str]:
        """Returns nothing to remark."""
        return []

    def tensors(self, state: None) -> dict[str, Any]:
        """Returns no tensors."""
        return {}
