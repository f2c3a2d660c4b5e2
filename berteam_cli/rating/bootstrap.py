"""How sure Elos are: the games of a tournament are drawn anew, many times, and everything is fitted again.

Every game is drawn Poisson(1) times in a resample, independently of all others. Drawing within each pair of
teams instead would make the variance (n - 1) / n of what it is: a half with two games a pair.

What the prior weighs is drawn too (exponential, of its own mean): a perfect record, which drawing games anew never
breaks, has an interval nevertheless.

Games that are copies of each other (``rating.copies``) must be drawn together, or the intervals are too narrow.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.random import Generator

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS
from berteam_cli.rating.counts import Counts
from berteam_cli.rating.elo import nats, points

CONFIDENCE = 0.95
RESAMPLES = 1000
TOLERANCE = 1e-6  # of a strength in nats: 0.0002 Elo
FEW = 12  # games of one kind, up to which drawing by a table is faster
LONGEST_STEP = 1.0  # of Newton's method, in nats: where the slope changes little

Interval = tuple[float, float, float]
"""A value, and the ends of its 95 % interval."""


def held_samples(games: Counts, anchors: Floats, rng: Generator, resamples: int = RESAMPLES) -> Floats:
    """Returns (R, K) Elos of players who met only opponents of known Elo, one row for each resample of their games.

    Args:
        games: of K players against J anchors; a game and its copies are drawn together.
        anchors: (J,) Elo of the anchors, held.
        rng: draws the games.
        resamples: R.
    """
    different = np.ascontiguousarray(games.different.transpose(1, 2, 0, 3), dtype=np.float64)
    held = np.asarray(nats(np.asarray(anchors, dtype=np.float64)), dtype=np.float64)
    return np.asarray(points(held_strengths(different, games.copies.astype(np.float64), held, rng, resamples)))


def samples(
    wins: Ints, draws: Ints, losses: Ints, rng: Generator, resamples: int = RESAMPLES, start: Floats | None = None
) -> Floats:
    """Returns (R, K) Elos of all players of a tournament between two sides, with mean 1000 in each resample.

    Args:
        wins: (K, K) games that row won against column; the transpose of ``losses``.
        draws: (K, K) games drawn, symmetric.
        losses: (K, K) games lost.
        rng: draws the games.
        resamples: R.
        start: (K,) Elos near which to look, such as the point estimates; None looks from equal ones.
    """
    first, second = np.triu_indices(len(wins), 1)
    counts = np.concatenate([wins[first, second], draws[first, second], losses[first, second]])
    scored = np.repeat([1.0, 0.5, 0.0], len(first))
    return cell_samples(np.tile(first, 3), np.tile(second, 3), scored, counts, len(wins), rng, resamples, start=start)


def cell_samples(
    alone: Ints,
    others: Ints,
    scored: Floats,
    counts: Ints,
    players: int,
    rng: Generator,
    resamples: int = RESAMPLES,
    handicap: float = 0.0,
    start: Floats | None = None,
    copies: Ints | None = None,
) -> Floats:
    """Returns (R, K) Elos with mean 1000, of games listed by who played and what came of it.

    Each resample is fitted to the end by Newton's method, from the fit before. That takes K^3 steps: a second for 28
    players, and minutes for a thousand.

    Args:
        alone: (C,) the player that stood alone on its side; of two sides, either.
        others: (C,) the player that held the others.
        scored: (C,) what ``alone`` made, in [0, 1].
        counts: (C,) games of that kind.
        players: K.
        rng: draws the games.
        resamples: R.
        handicap: in nats, of who stands alone, as in ``bradley_terry.ratings``.
        start: (K,) Elos near which to look.
        copies: (C,) of how many copies each of these games stands for, which are drawn together; None: one.
    """
    some = counts > 0
    weights = np.ones(int(some.sum())) if copies is None else np.asarray(copies, dtype=np.float64)[some]
    alone, others, scored = alone[some], others[some], np.asarray(scored, dtype=np.float64)[some]
    kept = np.asarray(counts, dtype=np.float64)[some]
    strengths = np.zeros(players) if start is None else np.asarray(nats(np.asarray(start, dtype=np.float64)))
    return np.asarray(points(free_strengths(alone, others, scored, kept, weights, handicap, strengths, rng, resamples)))


def chances_of_few() -> Floats:
    """Returns (FEW + 1, 60) the chance that a Poisson number of mean row is at most column."""
    means, numbers = np.arange(FEW + 1.0)[:, np.newaxis], np.arange(60)
    factorials = np.array([float(math.factorial(k)) for k in numbers])
    return np.cumsum(np.exp(-means) * means**numbers / factorials, axis=1)


AT_MOST = chances_of_few()


@njit(cache=True, nogil=True)
def times(games: float, rng: Generator) -> float:
    """Returns how often a resample has a kind of which there are so many ``games``: Poisson."""
    if games > FEW:
        return float(rng.poisson(games))
    row, chance, number = int(games), rng.random(), 0
    while number < AT_MOST.shape[1] - 1 and chance >= AT_MOST[row, number]:
        number += 1
    return float(number)


@njit(cache=True, nogil=True, error_model="numpy")
def free_strengths(
    alone: np.ndarray,
    others: np.ndarray,
    scored: np.ndarray,
    counts: np.ndarray,
    copies: np.ndarray,
    handicap: float,
    start: np.ndarray,
    rng: Generator,
    resamples: int,
) -> np.ndarray:
    """Returns (R, K) strengths in nats with mean 0; the arguments are those of ``cell_samples``."""
    players = len(start)
    found = np.empty((resamples, players))
    strengths = start
    for r in range(resamples):
        prior = rng.exponential(PRIOR_DRAWS, players)
        games, made = np.zeros((players, players)), 0.5 * prior
        for c in range(len(counts)):
            drawn = times(counts[c], rng) * copies[c]
            games[alone[c], others[c]] += drawn
            made[alone[c]] += drawn * scored[c]
            made[others[c]] += drawn * (1.0 - scored[c])
        strengths = fitted(games, made, prior, handicap, strengths)
        found[r] = strengths - strengths.mean()
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def held_strengths(
    counts: np.ndarray, copies: np.ndarray, held: np.ndarray, rng: Generator, resamples: int
) -> np.ndarray:
    """Returns (R, K) strengths in nats.

    Args:
        counts: (K, J, 3, M) float64 different games won, drawn and lost.
        copies: (M,) float64 how often each was played.
        held: (J,) strengths of the anchors, nats.
        rng: draws the games.
        resamples: R.
    """
    players, anchors, _, repetitions = counts.shape
    found = np.empty((resamples, players))
    games = np.empty(anchors)
    for k in range(players):
        strength = 0.0
        for r in range(resamples):
            prior = rng.exponential(PRIOR_DRAWS)
            made = 0.5 * prior
            for j in range(anchors):
                games[j] = 0.0
                for result in range(3):
                    for m in range(repetitions):
                        if counts[k, j, result, m] > 0.0:
                            drawn = times(counts[k, j, result, m], rng) * copies[m]
                            games[j] += drawn
                            made += drawn * (1.0 - 0.5 * result)
            strength = root(games, held, made, prior, strength)
            found[r, k] = strength
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def root(games: np.ndarray, held: np.ndarray, made: float, prior: float, start: float) -> float:
    """Returns the strength whose expected points in ``games`` (J,) against ``held`` (J,) are ``made``, in nats.

    ``prior`` draws against an average player are among them.

    Newton's method from ``start``, and halving where it would leave what encloses the answer.
    """
    low, high = held.min() - 40.0, held.max() + 40.0
    strength = min(max(start, low), high)
    for _ in range(200):
        chance = 1.0 / (1.0 + np.exp(-strength))
        over = prior * chance - made
        slope = prior * chance * (1.0 - chance)
        for j in range(len(held)):
            if games[j] > 0.0:
                chance = 1.0 / (1.0 + np.exp(held[j] - strength))
                over += games[j] * chance
                slope += games[j] * chance * (1.0 - chance)
        if over > 0.0:
            high = strength
        else:
            low = strength
        after = strength - over / slope
        if not low < after < high:
            after = 0.5 * (low + high)
        if abs(after - strength) < TOLERANCE:
            return after
        strength = after
    return strength


@njit(cache=True, nogil=True, error_model="numpy")
def fitted(games: np.ndarray, made: np.ndarray, prior: np.ndarray, handicap: float, start: np.ndarray) -> np.ndarray:
    """Returns (K,) the strengths at which everyone is expected to make what it made, in nats.

    Args:
        games: (K, K) float64 games that row played alone against column, each once.
        made: (K,) points, those of the prior included.
        prior: (K,) draws against an average player.
        handicap: of who stands alone, nats.
        start: (K,) where to begin.
    """
    players = len(made)
    strengths = start.copy()
    for _ in range(100):
        over = -made.copy()
        curvature = np.zeros((players, players))
        for i in range(players):
            chance = 1.0 / (1.0 + np.exp(-strengths[i]))
            over[i] += prior[i] * chance
            curvature[i, i] += prior[i] * chance * (1.0 - chance)
            for j in range(players):
                if i != j and games[i, j] > 0.0:
                    chance = 1.0 / (1.0 + np.exp(strengths[j] + handicap - strengths[i]))
                    bent = games[i, j] * chance * (1.0 - chance)
                    over[i] += games[i, j] * chance
                    over[j] += games[i, j] * (1.0 - chance)
                    curvature[i, i] += bent
                    curvature[j, j] += bent
                    curvature[i, j] -= bent
                    curvature[j, i] -= bent
        step = np.linalg.solve(curvature, over)
        longest = np.abs(step).max()
        strengths = strengths - step * min(1.0, LONGEST_STEP / max(longest, TOLERANCE))
        if longest < TOLERANCE:
            break
    return strengths


def interval(samples: Floats, axis: int = 0) -> tuple[Floats, Floats]:
    """Returns the ends of the middle 95 % of ``samples`` along ``axis``."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(samples, [tail, 1.0 - tail], axis=axis)
    return low, high


def with_interval(value: float, resampled: Floats) -> Interval:
    """Returns ``value`` with the 95 % interval of the ``resampled`` ones that are known, if they nearly all are."""
    known = resampled[~np.isnan(resampled)]
    if np.isnan(value) or len(known) < 0.9 * len(resampled):
        return float(value), float("nan"), float("nan")
    low, high = interval(known)
    return float(value), float(low), float(high)


def redrawn(count: int, rng: Generator) -> Ints:
    """Returns (R, count) indices of ``count`` things, drawn anew."""
    return rng.integers(count, size=(RESAMPLES, count))


def superiority(samples: Floats) -> Floats:
    """Returns (K, K) in which share of the (R, K) ``samples`` row is stronger than column; ties are a half."""
    return np.stack([0.5 + 0.5 * np.sign(own[:, np.newaxis] - samples).mean(axis=0) for own in samples.T])


def rank_intervals(samples: Floats) -> tuple[Ints, Ints]:
    """Returns (K,) the ends of the middle 95 % of each player's rank in (R, K) ``samples``; 1 is the strongest."""
    ranks = np.argsort(np.argsort(-samples, axis=1, kind="stable"), axis=1, kind="stable") + 1
    tail = 0.5 * (1.0 - CONFIDENCE)
    low = np.quantile(ranks, tail, axis=0, method="lower")
    high = np.quantile(ranks, 1.0 - tail, axis=0, method="higher")
    return low.astype(np.int64), high.astype(np.int64)
