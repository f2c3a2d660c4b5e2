"""How sure Elos are: the games are drawn anew, many times, and the players rated each time (bootstrap).

Every game comes as often as a Poisson draw of mean 1 says, whoever played it: drawing anew only within each pair of
players, who may have met twice, would halve the scatter. What the prior weighs is drawn too (exponential, of its own
mean), so that a perfect record, which drawing anew never breaks, has an interval nevertheless.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.random import Generator
from scipy.linalg import cho_factor, cho_solve

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected, held_ratings, ratings
from berteam_cli.rating.elo import nats, points

RESAMPLES = 1000
MOST_REFITTED = 200  # players of a tournament; refitting takes the cube of their number, a thousand times
ARRIVED_NAT = 1e-7  # step at which a fit has arrived
LONGEST_STEP_NAT = 2.0
STEPS = 60  # at most
FARTHEST_NAT = 40.0


def held_samples(
    wins: Ints, draws: Ints, losses: Ints, anchors: Floats, rng: Generator, resamples: int = RESAMPLES
) -> Floats:
    """Returns (R, K) Elos of K players who met J anchors only, each row after other games were drawn.

    Args:
        wins: (K, J) games that player k won against anchor j, between two sides.
        draws: (K, J) games that were drawn.
        losses: (K, J) games that it lost.
        anchors: (J,) Elos, held.
        rng: the only source of chance.
        resamples: R.
    """
    made, played = wins + 0.5 * draws, (wins + draws + losses).astype(float)
    best = nats(held_ratings(made, played, anchors)[0])
    counts = np.stack([wins, draws, losses], axis=2).astype(np.float64)
    held = np.asarray(nats(np.asarray(anchors, dtype=float)), dtype=np.float64)
    samples = _held(counts, held, np.asarray(best, dtype=np.float64), resamples, rng)
    return np.ascontiguousarray(points(samples).T)


@njit(cache=True, nogil=True)
def _held(counts: Floats, held: Floats, best: Floats, resamples: int, rng: Generator) -> Floats:
    """Returns (K, R) strengths in nats; see ``held_samples``.

    Args:
        counts: (K, J, 3) games won, drawn and lost.
        held: (J,) strengths of the anchors.
        best: (K,) strengths to start from.
        resamples: R.
        rng: the only source of chance.
    """
    players, anchors, _ = counts.shape
    samples = np.empty((players, resamples))
    played = np.empty(anchors)
    for k in range(players):
        for r in range(resamples):
            made = 0.0
            for j in range(anchors):
                played[j] = 0.0
                for result in range(3):
                    if counts[k, j, result] > 0:
                        drawn = rng.poisson(counts[k, j, result])
                        played[j] += drawn
                        made += drawn * (1.0 - 0.5 * result)
            prior = rng.exponential(PRIOR_DRAWS)
            samples[k, r] = _solved(played, made + 0.5 * prior, prior, held, best[k])
    return samples


@njit(cache=True, nogil=True)
def _solved(played: Floats, made: float, prior: float, held: Floats, start: float) -> float:
    """Returns the strength whose expected points are those ``made``: Newton's steps, kept in a bracket."""
    low, high = start - FARTHEST_NAT, start + FARTHEST_NAT
    strength = start
    for _ in range(STEPS):
        chance = 0.5 * (1.0 + np.tanh(0.5 * strength))
        excess, slope = prior * chance - made, prior * chance * (1.0 - chance)
        for j in range(len(held)):
            if played[j] > 0:
                chance = 0.5 * (1.0 + np.tanh(0.5 * (strength - held[j])))
                excess += played[j] * chance
                slope += played[j] * chance * (1.0 - chance)
        if excess > 0:
            high = strength
        else:
            low = strength
        after = strength - excess / max(slope, 1e-300)
        if not low < after < high:
            after = 0.5 * (low + high)
        step = abs(after - strength)
        strength = after
        if step < ARRIVED_NAT:
            break
    return strength


def samples(wins: Ints, draws: Ints, rng: Generator, resamples: int = RESAMPLES) -> Floats:
    """Returns (R, K) Elos of the players of a tournament, with mean 1000, each row after other games were drawn.

    Above MOST_REFITTED players the rows are drawn from the normal distribution to which that tends as games get more:
    its covariance is that of the points, from the residuals of the games, between two inverses of their information.

    Args:
        wins: (K, K) games that row won against column.
        draws: (K, K) games that they drew; symmetric.
        rng: the only source of chance.
        resamples: R.
    """
    wins, draws = wins.astype(np.float64), draws.astype(np.float64)
    best = nats(ratings(wins + 0.5 * draws, wins + wins.T + draws)[0])
    if len(wins) <= MOST_REFITTED:
        drawn = _refitted(wins, draws, best, resamples, rng)
    else:
        drawn = _in_the_limit(wins, draws, best, resamples, rng)
    return points(drawn - drawn.mean(axis=1, keepdims=True))


@njit(cache=True, nogil=True)
def _refitted(wins: Floats, draws: Floats, best: Floats, resamples: int, rng: Generator) -> Floats:
    """Returns (R, K) strengths in nats, not centred; see ``samples``."""
    players = len(best)
    fitted = np.empty((resamples, players))
    for r in range(resamples):
        played, made = np.zeros((players, players)), np.zeros(players)
        prior = rng.exponential(PRIOR_DRAWS, players)
        for i in range(players):
            made[i] += 0.5 * prior[i]
            for j in range(i + 1, players):
                won = rng.poisson(wins[i, j]) if wins[i, j] > 0 else 0
                lost = rng.poisson(wins[j, i]) if wins[j, i] > 0 else 0
                drawn = rng.poisson(draws[i, j]) if draws[i, j] > 0 else 0
                played[i, j] = won + lost + drawn
                made[i] += won + 0.5 * drawn
                made[j] += lost + 0.5 * drawn
        fitted[r] = _fit(played, made, prior, best)
    return fitted


@njit(cache=True, nogil=True)
def _fit(played: Floats, made: Floats, prior: Floats, start: Floats) -> Floats:
    """Returns (K,) the strengths whose expected points are those ``made``, by Newton's steps, none too long.

    Args:
        played: (K, K) games of row and column, above the diagonal.
        made: (K,) points, the prior's included.
        prior: (K,) draws against an average player.
        start: (K,) strengths.
    """
    players = len(start)
    strengths = start.copy()
    for _ in range(STEPS):
        information, missing = np.zeros((players, players)), made.copy()
        for i in range(players):
            chance = 0.5 * (1.0 + np.tanh(0.5 * strengths[i]))
            missing[i] -= prior[i] * chance
            information[i, i] += prior[i] * chance * (1.0 - chance) + 1e-12
            for j in range(i + 1, players):
                games = played[i, j]
                if games > 0:
                    chance = 0.5 * (1.0 + np.tanh(0.5 * (strengths[i] - strengths[j])))
                    missing[i] -= games * chance
                    missing[j] -= games * (1.0 - chance)
                    weight = games * chance * (1.0 - chance)
                    information[i, i] += weight
                    information[j, j] += weight
                    information[i, j] -= weight
                    information[j, i] -= weight
        step = np.linalg.solve(information, missing)
        longest = np.abs(step).max()
        strengths += step if longest <= LONGEST_STEP_NAT else step * (LONGEST_STEP_NAT / longest)
        if longest < ARRIVED_NAT:
            break
    return strengths


def _in_the_limit(wins: Floats, draws: Floats, best: Floats, resamples: int, rng: Generator) -> Floats:
    """Returns (R, K) strengths in nats, not centred; see ``samples``."""
    chance = expected(best[:, np.newaxis], best)
    played = wins + wins.T + draws
    scattered = wins * (1 - chance) ** 2 + wins.T * chance**2 + draws * (0.5 - chance) ** 2
    information = laplacian(played * chance * (1 - chance)) + np.eye(len(best)) * PRIOR_DRAWS / 4
    covariance = laplacian(scattered) + np.eye(len(best)) * PRIOR_DRAWS**2 / 4
    factor = np.linalg.cholesky(covariance + np.eye(len(best)) * 1e-9)
    noise = factor @ rng.standard_normal((len(best), resamples))
    return best + cho_solve(cho_factor(information), noise).T


def laplacian(weights: Floats) -> Floats:
    """Returns the graph Laplacian of symmetric ``weights``; their diagonal is ignored."""
    off = np.where(np.eye(len(weights), dtype=bool), 0.0, weights)
    return np.diag(off.sum(axis=1)) - off


def interval(drawn: Floats, axis: int = 0) -> tuple[Floats, Floats]:
    """Returns the ends of the 95 % intervals of resampled values along ``axis``."""
    low, high = np.quantile(drawn, [0.025, 0.975], axis=axis)
    return low, high


def superiority(drawn: Floats) -> Floats:
    """Returns (K, K) the likelihood that row is stronger than column, a tie counting half; ``drawn`` is (R, K)."""
    count = drawn.shape[1]
    above = np.empty((count, count))
    for k in range(count):
        gap = drawn[:, [k]] - drawn
        above[k] = (gap > 0).mean(axis=0) + 0.5 * (gap == 0).mean(axis=0)
    return above


def rank_intervals(drawn: Floats) -> tuple[Ints, Ints]:
    """Returns (K,) the best and the worst rank, from 1, of each player's 95 % interval; ``drawn`` is (R, K)."""
    ranks = np.argsort(np.argsort(-drawn, axis=1, kind="stable"), axis=1) + 1
    low, high = np.quantile(ranks, [0.025, 0.975], axis=0, method="inverted_cdf")
    return low.astype(np.int64), high.astype(np.int64)
