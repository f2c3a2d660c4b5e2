"""How sure the standings of a tournament are, and what they say of games in circles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.stats import norm

from berteam_cli.evaluation.alpha_rank import alpha_rank
from berteam_cli.evaluation.equilibria import nash
from berteam_cli.evaluation.tournament import Standings
from berteam_cli.outcomes import Bools, Floats, Ints
from berteam_cli.rating.bootstrap import CONFIDENCE, RESAMPLES, cell_samples, interval
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS
from berteam_cli.rating.davidson import davidson

STRATEGY_RESAMPLES = 200  # each needs a linear programme of K teams
MOST_TEAMS = 300  # that are fitted 1,000 times in half a minute
LARGEST_GAME = 60  # teams, above which an equilibrium is computed once only


@dataclass(frozen=True)
class Cells:
    """The games of a tournament, those alike put together; a game and its copies are one.

    Attributes:
        alone: (C,) the team that stood alone.
        others: (C,) its opponent.
        scored: (C,) what the former made.
        copies: (C,) how many copies each of these games has, itself included.
        counts: (C,) games of this kind.
        known: (C,) whether all that can happen between the two has been played, so that nothing is left to chance.
    """

    alone: Ints
    others: Ints
    scored: Floats
    copies: Ints
    counts: Ints
    known: Bools


def cells(standings: Standings, clusters: Ints, chance: Bools, every_order: bool) -> Cells:
    """Returns the games of ``standings``.

    Args:
        standings: of the tournament.
        clusters: (B,) the first game of which each is a copy.
        chance: (K,) whether games of the team are left to chance.
        every_order: whether members stood in every order on all sides.
    """
    held = standings.first_held
    two_sides = held.shape[1] == 2
    first_alone = (held.sum(axis=1) == 1) | two_sides
    i = np.where(first_alone, standings.pairs[:, 0], standings.pairs[:, 1])
    j = np.where(first_alone, standings.pairs[:, 1], standings.pairs[:, 0])
    side = np.where(first_alone[:, np.newaxis], held, ~held).argmax(axis=1)
    scored = standings.outcomes.scores[np.arange(len(i)), side]
    copies = np.bincount(clusters, minlength=len(i))
    kept = np.flatnonzero(copies)
    kinds = np.stack([i[kept], j[kept], scored[kept], copies[kept]], axis=1)
    found, counts = np.unique(kinds, axis=0, return_counts=True)
    alone, others = found[:, 0].astype(np.int64), found[:, 1].astype(np.int64)
    known = ~(chance[alone] | chance[others]) & every_order
    return Cells(alone, others, found[:, 2], found[:, 3].astype(np.int64), counts, known)


def elo_samples(standings: Standings, games: Cells, rng: Generator) -> Floats:
    """Returns (R, K) Elos of the tournament's games drawn anew: 1,000 times, less often above MOST_TEAMS."""
    players = len(standings.teams)
    resamples = RESAMPLES if players <= MOST_TEAMS else max(40, int(RESAMPLES * (MOST_TEAMS / players) ** 3))
    return cell_samples(
        games.alone,
        games.others,
        games.scored,
        games.counts,
        players,
        rng,
        resamples,
        handicap=math.log(len(standings.results) - 1),
        start=standings.elos,
        copies=games.copies,
    )


DAVIDSON_RESAMPLES = 200  # each is fitted on its own


def davidson_samples(games: Cells, players: int, rng: Generator) -> Floats:
    """Returns (R, K) Elos by Davidson's model of the tournament's games, between two sides, drawn anew."""

    def drawn() -> Floats:
        wins, draws = results_of(games, players, rng.poisson(games.counts).astype(float))
        return davidson(wins, draws, rng.exponential(PRIOR_DRAWS, players)).elos

    return np.array([drawn() for _ in range(DAVIDSON_RESAMPLES)])


def results_of(games: Cells, players: int, counts: Floats) -> tuple[Floats, Floats]:
    """Returns (K, K) games that row won against column, and drawn ones, of two sides, from ``counts`` (C,) of games."""
    wins, draws = np.zeros((2, players, players))
    weight = counts * games.copies
    for (row, column), won in (((games.alone, games.others), 1.0), ((games.others, games.alone), 0.0)):
        np.add.at(wins, (row, column), weight * (games.scored == won))
        np.add.at(draws, (row, column), weight * (games.scored == 0.5))
    return wins, draws


def scores_of(games: Cells, players: int, counts: Floats) -> Floats:
    """Returns (K, K) mean scores of row against column, 0.5 where they did not meet, from ``counts`` (C,) of games."""
    made, played = np.zeros((2, players, players))
    weight = counts * games.copies
    np.add.at(made, (games.alone, games.others), weight * games.scored)
    np.add.at(made, (games.others, games.alone), weight * (1.0 - games.scored))
    np.add.at(played, (games.alone, games.others), weight)
    played = played + played.T
    return np.where(played > 0, made / np.maximum(played, 1.0), 0.5)


@dataclass(frozen=True)
class Strategies:
    """How much of the mix each of K teams is; ``low`` and ``high`` are NaN where they were not computed.

    Attributes:
        alpha_rank: (3, K) share of time, low and high.
        nash: (3, K) share of the equilibrium, low and high.
    """

    alpha_rank: Floats
    nash: Floats


def strategies(games: Cells, players: int, rng: Generator) -> Strategies:
    """Returns alpha-rank and Nash of the teams' mean scores, with intervals from games drawn anew."""
    scores = scores_of(games, players, games.counts.astype(float))
    ranked, mixed = alpha_rank(scores), nash(scores - scores.T).strategy
    if players > LARGEST_GAME:
        unknown = np.full((2, players), math.nan)
        return Strategies(np.vstack([ranked, unknown]), np.vstack([mixed, unknown]))
    if games.known.all():
        return Strategies(np.stack([ranked] * 3), np.stack([mixed] * 3))
    drawn = [
        scores_of(games, players, np.where(games.known, games.counts, rng.poisson(games.counts)))
        for _ in range(STRATEGY_RESAMPLES)
    ]
    of_rank = interval(np.array([alpha_rank(matrix) for matrix in drawn]))
    of_mix = interval(np.array([nash(matrix - matrix.T).strategy for matrix in drawn]))
    return Strategies(np.stack([ranked, *of_rank]), np.stack([mixed, *of_mix]))


def surely_beaten(games: Cells, players: int) -> tuple[Floats, Floats]:
    """Returns (K, K) mean scores of row against column and the low ends of their intervals.

    The intervals hold together, all pairs at once, with 95 % (Bonferroni). They are Wilson's, for n different games of
    which points are wins: draws scatter less, so they are rather too wide. What is known has no width.
    """
    scores = scores_of(games, players, games.counts.astype(float))
    different = np.zeros((players, players))
    np.add.at(different, (games.alone, games.others), games.counts)
    n = np.maximum(different + different.T, 1e-9)
    z = norm.isf(0.5 * (1.0 - CONFIDENCE) / max(1, players * (players - 1) // 2))
    middle = (scores + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(scores * (1 - scores) / n + z * z / (4 * n * n))
    known = np.zeros((players, players), dtype=np.bool_)
    known[games.alone, games.others] = known[games.others, games.alone] = games.known
    return scores, np.where(known, scores, middle - half)


def cycles(games: Cells, players: int) -> list[tuple[tuple[int, ...], float, float]]:
    """Returns the circles of three teams in which each surely beats the next: teams, weakest score and its low end.

    Wherever teams beat each other in a longer circle and every two differ surely, some three of them do so already.
    """
    scores, low = surely_beaten(games, players)
    beats = low > 0.5
    found: list[tuple[tuple[int, ...], float, float]] = []
    for a in range(players):  # the first of the three by index, so that no circle is found twice
        for b in np.flatnonzero(beats[a, a + 1 :]) + a + 1:
            for c in np.flatnonzero(beats[b, a + 1 :] & beats[a + 1 :, a]) + a + 1:
                links = ((a, b), (b, c), (c, a))
                found.append(((a, int(b), int(c)), min(scores[x] for x in links), min(low[x] for x in links)))
    return found
