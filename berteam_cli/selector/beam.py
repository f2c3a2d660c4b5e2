"""Finds the most probable teams where there are too many to list: a beam search over partial teams."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Floats, Ints
from berteam_cli.selector.base import Field, TeamDistribution
from berteam_cli.selector.chances import unordered_chances
from berteam_cli.selector.filling import Odds

NARROWEST = 200  # partial teams that are followed, at least
CANDIDATES = 100_000  # ways to fill one more place that are looked at, at most, the likeliest


def likeliest(
    odds: Odds, field: Field, count: int, rng: Generator, *, exchangeable: bool, sources: int = 1
) -> TeamDistribution:
    """Returns the most probable unordered teams that a beam search finds, at most ``count``.

    From each place to the next, the partial teams that are reached most often are followed, however they came about,
    and the others given up. The chances of the teams it ends with are then told exactly, or estimated with their errors
    where a team has too many orders. A team whose parts are all improbable may be missed.

    Args:
        odds: what the places are drawn from.
        field: N and T.
        count: how many teams.
        rng: for the estimate of chances where the orders are too many.
        exchangeable: whether ``odds`` does not tell places apart.
        sources: what can be known, as of Odds: one search for each, and the mean of the chances.
    """
    teams = np.unique(
        np.concatenate([found(odds, field, count, source, exchangeable=exchangeable) for source in range(sources)]),
        axis=0,
    )
    parts = [unordered_chances(odds, teams, source, rng, exchangeable=exchangeable) for source in range(sources)]
    chances = np.mean([chance for chance, _ in parts], axis=0)
    errors = np.sqrt(np.sum([error**2 for _, error in parts], axis=0)) / sources
    top = np.argsort(-chances, kind="stable")[:count]
    top = top[np.lexsort(teams[top].T[::-1])]
    other = max(0.0, 1.0 - float(chances[top].sum()))
    return TeamDistribution(teams[top], chances[top], other, error=errors[top] if errors.any() else None)


def found(odds: Odds, field: Field, count: int, source: int, *, exchangeable: bool) -> Ints:
    """Returns (K, T) teams, members ascending, that the search ends with: twice as many as are wanted, if it can."""
    width = max(NARROWEST, 4 * count)
    teams, reach = np.full((1, field.team_size), OPEN), np.ones(1)
    for filled in range(field.team_size):
        last = filled + 1 == field.team_size
        teams, reach = grown(odds, teams, reach, source, width, merged=exchangeable or last)
    return teams[np.argsort(-reach, kind="stable")[: 2 * count]]


def grown(odds: Odds, teams: Ints, reach: Floats, source: int, width: int, *, merged: bool) -> tuple[Ints, Floats]:
    """Returns the ``width`` partial teams reached most often with one more place filled, and how often each is.

    Args:
        odds: what the places are drawn from.
        teams: (K, T), all with the same number of OPEN places.
        reach: (K,) how often each comes about.
        source: as of Odds.
        width: how many are kept.
        merged: whether teams of the same members are the same whatever their places.
    """
    open_ = teams == OPEN
    flow = odds(teams, np.full(len(teams), source)) * (reach / open_.sum(axis=1))[:, np.newaxis, np.newaxis]
    flow = np.where(open_[:, :, np.newaxis], flow, 0.0)
    likely = np.argsort(-flow, axis=None, kind="stable")[:CANDIDATES]  # several of them may be the same team
    row, place, member = np.unravel_index(likely, flow.shape)
    after = teams[row]
    after[np.arange(len(after)), place] = member
    unique, which = np.unique(np.sort(after, axis=1) if merged else after, axis=0, return_inverse=True)
    sent = flow[row, place, member]
    # numpy's types forget the weights.
    reached: Floats = np.bincount(which.reshape(-1), weights=sent, minlength=len(unique))  # type: ignore[assignment]
    kept = np.argsort(-reached, kind="stable")[:width]
    kept = kept[reached[kept] > 0]
    return unique[kept], reached[kept]
