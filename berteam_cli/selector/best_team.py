"""The best single team, found by successive halving (Karnin, Koren and Somekh 2013, "Almost Optimal Exploration").

Candidates play each other. When each has played ``games_per_rung`` games, the better half by mean score stays and
begins anew, until one is left: the choice.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.outcomes import Experience, Floats, Ints, Lineups, Outcomes
from berteam_cli.selector.base import Selecting
from berteam_cli.selector.captains import dealt
from berteam_cli.selector.listed import Listed, Mixture, every_team, fresh
from berteam_cli.selector.tally import Tally, no_games


@dataclass(frozen=True)
class BestTeamState:
    """Where the bandit stands.

    Attributes:
        rung: the teams still in the running, with their games since the last halving.
        choice: (1, T) the team that won the last bandit; (0, T) before one has ended.
    """

    rung: Tally
    choice: Ints


@dataclass(frozen=True, eq=False)
class BestTeam(Listed):
    """Chooses the team that won the bandit; before the first has ended, the teams still in the running, all alike.

    Attributes:
        candidates: teams a bandit begins with: all there can be if those are not more, else random ones.
        games_per_rung: games of each team from one halving to the next.
        restart: whether the next bandit begins when one has ended, as members that learn ask for.
    """

    candidates: int
    games_per_rung: int
    restart: bool

    def init(self, rng: Generator) -> BestTeamState:
        """Returns the start of the first bandit."""
        return BestTeamState(self._begun(rng), np.zeros((0, self.field.team_size), dtype=np.int64))

    def mixture(self, state: BestTeamState) -> Mixture:
        """Returns the choice."""
        teams = state.choice if len(state.choice) else state.rung.teams
        return Mixture(teams, np.full(len(teams), 1 / len(teams)))

    def select(self, state: BestTeamState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns games between the teams that have played too little, all as often."""
        due = np.flatnonzero(state.rung.games < self.games_per_rung)
        if len(due) < self.field.sides:  # they need somebody to play against
            ordered = np.lexsort((rng.random(len(state.rung)), state.rung.games))
            due = ordered[: self.field.sides]
        schedule = due[dealt(games, self.field.sides, len(due), rng)]
        return self.scheduled_games(state.rung.teams, schedule, rng)

    def learn(
        self, state: BestTeamState, outcomes: Outcomes, seen: Experience, fitness: Floats, rng: Generator
    ) -> tuple[BestTeamState, Selecting]:
        """Returns the state after counting the games and, when all have played enough, a halving.

        ``Selecting.updates`` counts halvings, ``buffer`` the teams still in the running.
        """
        rung = state.rung.after(outcomes)
        state = replace(state, rung=rung)
        if len(rung) == 1 and not self.restart:  # it has ended
            return state, Selecting(buffer=1)
        if (rung.games < self.games_per_rung).any():
            return state, Selecting(buffer=len(rung))
        rung = no_games(better_half(rung, rng))
        if len(rung) > 1:
            return replace(state, rung=rung), Selecting(updates=1, buffer=len(rung))
        again = self._begun(rng) if self.restart else rung
        return BestTeamState(again, rung.teams.copy()), Selecting(updates=1, buffer=len(again))

    def tensors(self, state: BestTeamState) -> dict[str, Any]:
        """Returns ``state`` as tensors."""
        held = {"teams": state.rung.teams, "points": state.rung.points, "games": state.rung.games}
        return {name: torch.from_numpy(array) for name, array in (held | {"choice": state.choice}).items()}

    def restored(self, tensors: dict[str, Any]) -> BestTeamState:
        """Returns the state that gave ``tensors``."""
        held = {name: tensor.numpy() for name, tensor in tensors.items()}
        return BestTeamState(Tally(held["teams"], held["points"], held["games"]), held["choice"])

    def _begun(self, rng: Generator) -> Tally:
        """Returns the candidates of a bandit."""
        teams = every_team(self.field, self.candidates)
        if teams is None:
            nobody = np.zeros((0, self.field.team_size), dtype=np.int64)
            teams = fresh(self.field, self.candidates, nobody, rng)
        return no_games(teams)


def better_half(tally: Tally, rng: Generator) -> Ints:
    """Returns (K / 2 rounded up, T) the teams of the highest mean scores; equally good ones in random order."""
    order = np.lexsort((rng.random(len(tally)), -tally.mean))
    kept = np.sort(order[: (len(tally) + 1) // 2])
    return tally.teams[kept]
