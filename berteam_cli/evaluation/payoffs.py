"""The payoff matrix of teams: how likely each wins and draws against each, itself included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.evaluation.tournament import schedule
from berteam_cli.games import Games, as_side_0, both_sides
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.progress import progress

GAMES_PER_PAIR = 8  # every order of the members of teams of two, from both sides
BATCH = 2_000  # games played between two words of how far it is


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


def payoffs(games: Games, policies: Policies, teams: Ints, games_per_pair: int, rng: Generator) -> Payoffs:
    """Returns what comes of ``games_per_pair`` games between every two of ``teams``, and of each against itself.

    Members stand in every order and teams on both sides in turn, as in a tournament. Teams whose play knows no chance
    have their exact chances after one game for each order and side, 2 (T!)^2; for the others they are frequencies.

    Args:
        games: of two sides, and its threads.
        policies: how the members act.
        teams: (K, T).
        games_per_pair: an even number looks at both sides equally.
        rng: seeds the games and, where not all are played, draws the orders of the members.
    """
    size = len(teams)
    counts = np.zeros((3, size, size))  # won, drawn, lost by the row
    first, second = np.triu_indices(size)
    pairs = max(1, BATCH // games_per_pair)
    with progress("Playing all teams against each other", len(first) * games_per_pair) as tell:
        for start in range(0, len(first), pairs):
            i, j = first[start : start + pairs], second[start : start + pairs]
            lineups = both_sides(*schedule(teams, i, j, games_per_pair, 2, rng), games_per_pair)
            outcomes, _ = games.play(policies, lineups, int(rng.integers(2**63)))
            scores = as_side_0(outcomes, games_per_pair).scores[:, 0].reshape(len(i), games_per_pair)
            counts[:, i, j] = [(scores == result).sum(axis=1) for result in (1.0, 0.5, 0.0)]
            tell(len(i) * games_per_pair)
    won, drawn, lost = counts / games_per_pair
    wins = np.triu(won, 1) + np.triu(lost, 1).T + np.diag((won + lost).diagonal() / 2)
    return Payoffs(wins, np.triu(drawn) + np.triu(drawn, 1).T)


def payoff_steps(teams: int, games_per_pair: int, longest: int) -> int:
    """Returns how many env steps ``payoffs`` takes at most, each game having at most ``longest``."""
    return teams * (teams + 1) // 2 * games_per_pair * longest
