"""Teams whose places are filled independently of each other: what uniform choice and MCAA have in common."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.selector.base import Field, TeamDistribution, most_probable, orderings, unordered_teams
from berteam_cli.selector.beam import likeliest
from berteam_cli.selector.chances import total_distribution
from berteam_cli.selector.filling import Odds, drawn, within


def sampled(chances: Floats, count: int, rng: Generator) -> Ints:
    """Returns (count, T) teams.

    Args:
        chances: (T, N) of each member at each place.
        count: how many.
        rng: the only source of chance.
    """
    size, members = chances.shape
    return drawn(np.broadcast_to(chances, (count, size, members)).reshape(-1, members), rng).reshape(count, size)


def log_chances(chances: Floats, teams: Ints) -> Floats:
    """Returns (...,) ln of the chance of ordered ``teams``, (..., T); ``chances`` as above."""
    return np.log(chances[np.arange(len(chances)), teams]).sum(axis=-1)


def distribution(chances: Floats, field: Field) -> TeamDistribution:
    """Returns the chance of every unordered team that can come about; ``chances`` as above."""
    teams = unordered_teams(field.members, field.team_size)
    if field.alike:
        probability = orderings(teams) * chances[0][teams].prod(axis=1)
    else:
        probability = total_distribution(odds_of(chances), field, 0, exchangeable=False)
    possible = probability > 0
    return TeamDistribution(teams[possible], probability[possible])


def anybody(field: Field) -> Floats:
    """Returns (T, N) equal chances for all who may stand at each place."""
    return within(np.full((field.team_size, field.members), 1 / field.members), field.allowed)


def with_all_teams(listed: TeamDistribution, field: Field) -> TeamDistribution:
    """Returns the exact distribution ``listed`` with a row for each team that may be, also where its chance is 0."""
    teams = distribution(anybody(field), field).teams
    chance = dict(zip(map(tuple, listed.teams), listed.probability, strict=True))
    return TeamDistribution(teams, np.array([chance.get(tuple(team), 0.0) for team in teams]))


def top(chances: Floats, field: Field, count: int, rng: Generator, *, listed: bool) -> TeamDistribution:
    """Returns the ``count`` most probable teams, from the whole distribution if they may be ``listed``."""
    if listed:
        return most_probable(distribution(chances, field), count)
    return likeliest(odds_of(chances), field, count, rng, exchangeable=field.alike)


def odds_of(chances: Floats) -> Odds:
    """Returns ``chances`` as conditionals that depend on nothing."""

    def odds(teams: Ints, known: Ints, places: Ints | None = None) -> Floats:
        return np.broadcast_to(chances, (len(teams), *chances.shape)) if places is None else chances[places]

    return odds
