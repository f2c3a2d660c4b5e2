"""The payoff matrix of teams: how likely each wins and draws against each, itself included."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.tournament import plays_every_order, schedule
from berteam_cli.games import Games, as_side_0, both_sides
from berteam_cli.outcomes import Bools, Floats, Ints
from berteam_cli.rating.copies import chancy_teams
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

    def where(self, pairs: Bools, others: Payoffs) -> Payoffs:
        """Returns these chances for ``pairs`` (K, K), symmetric, and those of ``others`` for all others."""
        return Payoffs(np.where(pairs, self.wins, others.wins), np.where(pairs, self.draws, others.draws))


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
    return counted(pair_scores(games, policies, teams, games_per_pair, rng, sheet), len(teams))


def halved_payoffs(
    games: Games, policies: Policies, teams: Ints, games_per_pair: int, rng: Generator
) -> tuple[Payoffs, Payoffs]:
    """Returns ``payoffs`` twice, of either half of the games of each pair, so that one can judge what the other says.

    Pairs whose chances are exact, as nothing is left to chance and all is played, have them in both.

    Args:
        games: of two sides, and its threads.
        policies: how the members act.
        teams: (K, T).
        games_per_pair: a multiple of 4.
        rng: as of ``payoffs``, which plays the same games.
    """
    scores = pair_scores(games, policies, teams, games_per_pair, rng)
    whole = counted(scores, len(teams))
    chance = chancy_teams(games.env, policies, teams)
    exact = ~(chance[:, np.newaxis] | chance) & plays_every_order(2, teams, games_per_pair)
    # Both sides in turn belong to one half, then to the other, the other, and the one: of teams of two, whose four
    # orders come in turn, each half then has either order of either team.
    turns = np.arange(games_per_pair) // 2
    later = (turns + turns // 2) % 2 == 1
    one, other = (counted(scores[:, mine], len(teams)) for mine in (~later, later))
    return whole.where(exact, one), whole.where(exact, other)


def pair_scores(
    games: Games, policies: Policies, teams: Ints, games_per_pair: int, rng: Generator, sheet: Path | None = None
) -> Floats:
    """Returns (P, G) what the first of each two of ``teams`` scores, pairs as of ``triu_indices``; see ``payoffs``."""
    first, second = np.triu_indices(len(teams))
    lineups = both_sides(*schedule(teams, first, second, games_per_pair, 2, rng), games_per_pair)
    outcomes = play_all(games, policies, lineups, key(rng), "Playing all teams against each other", sheet)
    return as_side_0(outcomes, games_per_pair).scores[:, 0].reshape(len(first), games_per_pair)


def counted(scores: Floats, size: int) -> Payoffs:
    """Returns how often each of K = ``size`` teams wins and draws, from ``scores`` (P, G) of their pairs."""
    counts = np.zeros((3, size, size))  # won, drawn, lost by the row
    first, second = np.triu_indices(size)
    counts[:, first, second] = [(scores == result).sum(axis=1) for result in (1.0, 0.5, 0.0)]
    won, drawn, lost = counts / scores.shape[1]
    wins = np.triu(won, 1) + np.triu(lost, 1).T + np.diag((won + lost).diagonal() / 2)
    return Payoffs(wins, np.triu(drawn) + np.triu(drawn, 1).T)


def payoff_steps(teams: int, games_per_pair: int, longest: int) -> int:
    """Returns how many env steps ``payoffs`` takes at most, each game having at most ``longest``."""
    return teams * (teams + 1) // 2 * games_per_pair * longest
