"""The payoff matrix of teams: how likely each wins and draws against each, itself included."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.tournament import schedule
from berteam_cli.games import Games, as_side_0, both_sides
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.training import key

GAMES_PER_PAIR = 8  # every order of the members of teams of two, from both sides


@dataclass(frozen=True)
class Payoffs:
    """How K teams fare against each other.

    Attributes:
        wins: (K, K) chance that the row's team wins against the column's.
        draws: (K, K) chance that they draw; symmetric.
    """

    wins: Floats
    draws: Floats

    @property
    def zero_sum(self) -> Floats:
        """(K, K) chance to win less chance to lose, in [-1, 1]; the negative of its transpose."""
        return self.wins - self.wins.T

    @property
    def scores(self) -> Floats:
        """(K, K) expected score, in [0, 1], a draw counting half; with its transpose it sums to 1."""
        return self.wins + 0.5 * self.draws


def payoffs(
    games: Games, policies: Policies, teams: Ints, games_per_pair: int, rng: Generator, sheet: Path | None = None
) -> Payoffs:
    """Returns what comes of ``games_per_pair`` games between every two of ``teams``, and of each against itself.

    Members stand in every order and teams on both sides in turn, as in a tournament. Teams whose play knows no chance
    have their exact chances after one game for each order and side, 2 (T!)^2; for the others they are frequencies.

    Args:
        games: of two sides, and its threads.
        policies: how the members act.
        teams: (K, T).
        games_per_pair: an even number looks at both sides equally.
        rng: seeds the games and, where not all are played, draws the orders of the members.
        sheet: where what is played is kept; see ``play_all``.
    """
    size = len(teams)
    first, second = np.triu_indices(size)
    lineups = both_sides(*schedule(teams, first, second, games_per_pair, 2, rng), games_per_pair)
    outcomes = play_all(games, policies, lineups, key(rng), "Playing all teams against each other", sheet)
    scores = as_side_0(outcomes, games_per_pair).scores[:, 0].reshape(len(first), games_per_pair)
    counts = np.zeros((3, size, size))  # won, drawn, lost by the row
    counts[:, first, second] = [(scores == result).sum(axis=1) for result in (1.0, 0.5, 0.0)]
    won, drawn, lost = counts / games_per_pair
    wins = np.triu(won, 1) + np.triu(lost, 1).T + np.diag((won + lost).diagonal() / 2)
    return Payoffs(wins, np.triu(drawn) + np.triu(drawn, 1).T)


def payoff_steps(teams: int, games_per_pair: int, longest: int) -> int:
    """Returns how many env steps ``payoffs`` takes at most, each game having at most ``longest``."""
    return teams * (teams + 1) // 2 * games_per_pair * longest
