"""What one look at a training saw: how its teams fared against the teams of fixed policies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from berteam_cli.outcomes import Floats, Ints

CHOICE, BEST_MEMBER, BEST_TEAM = "choice", "best_member", "best_team"  # who was looked at
ALL = "all"  # the opponents together


@dataclass(frozen=True)
class Line:
    """What came of the games of a kind of team against one opponent, or against all.

    Attributes:
        who: CHOICE, BEST_MEMBER or BEST_TEAM.
        opponent: names of its fixed policies, or ALL.
        results: (3,) games won, drawn and lost.
        means: (8,) per game: own captures, grabs, tags and wall hits, the opponents' captures, grabs and tags, steps.
        members: names of the teams that played, nothing where the line of ALL says it.
        elo, half_width: of the team or the choice, and of the 95 % interval; NaN where they are not known.
    """

    who: str
    opponent: str
    results: Ints
    means: Floats
    members: str
    elo: float = math.nan
    half_width: float = math.nan

    @property
    def shares(self) -> Floats:
        """(3,) shares of the games won, drawn and lost."""
        return self.results / self.results.sum()

    def row(self, epoch: int) -> tuple[Any, ...]:
        """Returns the row of evaluation.csv."""
        return (
            *(epoch, self.who, self.opponent, self.results.sum(), *self.results, *self.means),
            *(self.elo, self.elo - self.half_width, self.elo + self.half_width, self.members),
        )


@dataclass(frozen=True)
class Sight:
    """The lines of one look, and the epoch after which it was taken."""

    epoch: int
    lines: list[Line]

    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Returns the rows of evaluation.csv."""
        return (line.row(self.epoch) for line in self.lines)

    def of(self, who: str) -> Line:
        """Returns the line of ``who`` against all."""
        return next(line for line in self.lines if line.who == who and line.opponent == ALL)

    def figures(self) -> dict[str, float]:
        """Returns what loggers show of it, by name."""
        choice = self.of(CHOICE)
        won, drawn, _ = choice.shares
        captures, grabs = choice.means[:2]
        return {
            "evaluation/expected_elo": choice.elo,
            "evaluation/best_elo": self.of(BEST_TEAM).elo,
            "evaluation/won": won,
            "evaluation/drawn": drawn,
            "evaluation/captures": captures,
            "evaluation/grabs": grabs,
        }

    def spoken(self) -> str:
        """Returns it in a line."""
        choice = self.of(CHOICE)
        won, drawn, _ = choice.shares
        width = "" if math.isnan(choice.half_width) else f" ±{choice.half_width:.0f}"
        return (
            f"expected Elo {choice.elo:,.0f}{width}, best {self.of(BEST_TEAM).elo:,.0f}, "
            f"{won:.0%} won {drawn:.0%} drawn (epoch {self.epoch})".replace("%", " %")
        )
