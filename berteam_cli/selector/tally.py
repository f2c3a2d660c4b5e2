"""How teams fared in the games they played."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from berteam_cli.outcomes import Floats, Ints, Outcomes
from berteam_cli.selector.listed import places_of


@dataclass(frozen=True)
class Tally:
    """Teams with what they scored.

    Attributes:
        teams: (K, T) no two with the same members.
        points: (K,) sum of the scores.
        games: (K,) how many.
    """

    teams: Ints
    points: Floats
    games: Ints

    def __len__(self) -> int:
        return len(self.teams)

    @property
    def mean(self) -> Floats:
        """(K,) mean score; 0 for a team that did not play."""
        return self.points / np.maximum(self.games, 1)

    def after(self, outcomes: Outcomes) -> Tally:
        """Returns the tally with the games of ``outcomes`` that its teams played."""
        which = places_of(outcomes.lineups.teams, self.teams)
        known = which >= 0
        size = len(self)
        return Tally(
            self.teams,
            self.points + np.bincount(which[known], weights=outcomes.scores[known], minlength=size),
            self.games + np.bincount(which[known], minlength=size),
        )

    def after_all(self, outcomes: Outcomes) -> Tally:
        """Returns the tally with all games of ``outcomes``, also those of teams it did not know; members ascending."""
        played = np.sort(outcomes.lineups.teams.reshape(-1, self.teams.shape[1]), axis=1)
        teams, which = np.unique(np.concatenate([self.teams, played]), axis=0, return_inverse=True)
        which = which.reshape(-1)
        points = np.concatenate([self.points, outcomes.scores.ravel()])
        games = np.concatenate([self.games, np.ones(len(played), dtype=np.int64)])
        return Tally(
            teams,
            # numpy's types forget the weights.
            np.bincount(which, weights=points, minlength=len(teams)),  # type: ignore[arg-type]
            np.rint(np.bincount(which, weights=games, minlength=len(teams))).astype(np.int64),
        )


def no_games(teams: Ints) -> Tally:
    """Returns the tally of ``teams``, (K, T), before their first game."""
    return Tally(teams, np.zeros(len(teams)), np.zeros(len(teams), dtype=np.int64))
