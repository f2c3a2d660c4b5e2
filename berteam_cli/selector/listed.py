"""Selectors that choose from a list of teams: what they share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Floats, Ints, Lineups
from berteam_cli.selector import independent
from berteam_cli.selector.base import (
    Field,
    Plain,
    TeamDistribution,
    exactly,
    log_orderings,
    most_probable,
    unordered_teams,
)

ORDERS_EACH = 20  # where places differ, ordered teams are listed up to so many for each team that may be listed
TRIES = 20  # teams drawn for each one that is to be new


@dataclass(frozen=True)
class Mixture:
    """Teams with the chance of each.

    Attributes:
        teams: (K, T) no two with the same members, each in an order in which its members may stand.
        probability: (K,) sums to 1.
    """

    teams: Ints
    probability: Floats


@dataclass(frozen=True, eq=False)
class Listed(Plain):
    """A selector whose own will is a mixture of listed teams; subclasses say which.

    A team of the list stands in an order drawn at random where the same members may stand at all places, else in the
    order of the list. In training games every team is, with chance ``explore``, a random one instead, so that all
    members play and learn.

    Attributes:
        field: among whom it chooses.
        explore: chance of a team of a training game to be a random one.
    """

    field: Field
    explore: float

    def mixture(self, state: Any) -> Mixture | None:
        """Returns its own will; None where nothing is known yet, and every place is given to all alike."""
        raise NotImplementedError

    def sample(self, state: Any, count: int, rng: Generator) -> Ints:
        """Returns (count, T) teams."""
        will = self.mixture(state)
        if will is None:
            return random_teams(self.field, count, rng)
        return ordered(will.teams[picked(will.probability, count, rng)], self.field, rng)

    def distribution(self, state: Any) -> TeamDistribution:
        """Returns the chance of each unordered team."""
        will = self.mixture(state)
        if will is None:
            return independent.distribution(independent.anybody(self.field), self.field)
        possible = will.probability > 0
        teams, chances = np.sort(will.teams[possible], axis=1), will.probability[possible]
        order = np.lexsort(teams.T[::-1])
        return TeamDistribution(teams[order], chances[order])

    def lists(self, state: Any) -> bool:
        """Returns whether it knows whom it wants."""
        return self.mixture(state) is not None

    def likeliest(self, state: Any, count: int, rng: Generator) -> TeamDistribution:
        """Returns the ``count`` most probable teams."""
        if self.mixture(state) is None:
            return independent.top(independent.anybody(self.field), self.field, count, rng, listed=exactly(self.field))
        return most_probable(self.distribution(state), count)

    def captains(self, state: Any) -> Floats:
        """Returns (N,) how often each member stands at a place: a captain stands at a place drawn at random."""
        will = self.mixture(state)
        if will is None:
            return independent.anybody(self.field).mean(axis=0)
        weights = np.repeat(will.probability / self.field.team_size, self.field.team_size)
        # numpy's types forget the weights.
        chances: Floats = np.bincount(will.teams.ravel(), weights=weights, minlength=self.field.members)  # type: ignore[assignment]
        return chances

    def drawn_games(self, state: Any, games: int, rng: Generator) -> Lineups:
        """Returns ``games`` training games between teams of its own will, and random ones."""
        will, teams = self.mixture(state), games * self.field.sides
        if will is None:
            return lineups(self.field, random_teams(self.field, teams, rng), None, 0.0, rng)
        return lineups(self.field, will.teams[picked(will.probability, teams, rng)], will, self.explore, rng)

    def scheduled_games(self, teams: Ints, schedule: Ints, rng: Generator) -> Lineups:
        """Returns the training games of a ``schedule``, in random order and sides, with random teams among them.

        The chance of a team is its share of the places of the schedule.

        Args:
            teams: (K, T) as of a mixture.
            schedule: (B, S) which of them play.
            rng: the only source of chance.
        """
        schedule = rng.permuted(rng.permutation(schedule), axis=1).ravel()
        shares = np.bincount(schedule, minlength=len(teams)) / len(schedule)
        return lineups(self.field, teams[schedule], Mixture(teams, shares), self.explore, rng)


def random_teams(field: Field, count: int, rng: Generator) -> Ints:
    """Returns (count, T) teams, every place given to all who may stand there alike."""
    teams = np.empty((count, field.team_size), dtype=np.int64)
    for place, row in enumerate(field.allowed):
        options = np.flatnonzero(row)
        teams[:, place] = options[rng.integers(len(options), size=count)]
    return teams


def picked(chances: Floats, count: int, rng: Generator) -> Ints:
    """Returns (count,) indices of ``chances``, (K,), drawn in proportion to them."""
    reached = np.cumsum(chances)
    return np.searchsorted(reached / reached[-1], rng.random(count), side="right")


def lineups(field: Field, chosen: Ints, will: Mixture | None, explore: float, rng: Generator) -> Lineups:
    """Returns the games between ``chosen`` teams, (B S, T), of which some give way to random ones.

    A captain is a member of its team at a place drawn at random.

    Args:
        field: S and who may stand where.
        chosen: teams of ``will``; where that is None, random ones.
        will: what they were drawn from.
        explore: chance of a team to give way.
        rng: the only source of chance.
    """
    rows = np.arange(len(chosen))
    random = rng.random((len(chosen), 1)) < explore
    teams = np.where(random, random_teams(field, len(chosen), rng), ordered(chosen, field, rng))
    captains = teams[rows, rng.integers(field.team_size, size=len(teams))]
    told = log_chances(field, teams, will, explore)
    shape = -1, field.sides
    return Lineups(teams.reshape(*shape, field.team_size), captains.reshape(shape), told.reshape(shape))


def log_chances(field: Field, teams: Ints, will: Mixture | None, explore: float) -> Floats:
    """Returns (K,) ln of the chance that each of the ordered ``teams``, (K, T), plays; see ``lineups``."""
    with np.errstate(divide="ignore"):  # what cannot be has the chance 0
        uniform = independent.log_chances(independent.anybody(field), teams)
        if will is None:
            return uniform
        which = places_of(teams, will.teams)
        own = np.log(will.probability[which])
        if field.alike:
            own = own - log_orderings(np.sort(teams, axis=1))
            known = which >= 0
        else:
            known = (will.teams[which] == teams).all(axis=1)
        own = np.where(known, own, -np.inf)
        return np.logaddexp(np.log(explore) + uniform, np.log1p(-explore) + own)


def ordered(teams: Ints, field: Field, rng: Generator) -> Ints:
    """Returns ``teams``, (K, T), in random order where places are alike."""
    return rng.permuted(teams, axis=1) if field.alike else teams


def places_of(teams: Ints, listed: Ints) -> Ints:
    """Returns (...,) which of the ``listed``, (K, T), has the members of each of ``teams``, (..., T); -1 for none."""
    rows = {tuple(team): k for k, team in enumerate(np.sort(listed, axis=1).tolist())}
    flat = np.sort(teams, axis=-1).reshape(-1, teams.shape[-1]).tolist()
    return np.array([rows.get(tuple(team), -1) for team in flat], dtype=np.int64).reshape(teams.shape[:-1])


def every_team(field: Field, limit: int) -> Ints | None:
    """Returns (K, T) all teams there can be, in lexicographic order of their members; None if above ``limit``.

    Where places differ, each team comes in the first order in which its members may stand; None too where there are so
    many orders that they are not looked through.
    """
    size, allowed = field.team_size, field.allowed
    if field.alike:
        eligible = np.flatnonzero(allowed[0])
        return eligible[unordered_teams(len(eligible), size)] if field.teams <= limit else None
    if math.prod(int(x) for x in allowed.sum(axis=1)) > ORDERS_EACH * limit:
        return None
    standing = np.stack(np.meshgrid(*(np.flatnonzero(row) for row in allowed), indexing="ij"), axis=-1)
    teams = standing.reshape(-1, size)
    first = distinct(teams)
    return teams[first] if len(first) <= limit else None


def fresh(field: Field, count: int, taken: Ints, rng: Generator) -> Ints:
    """Returns (K, T) up to ``count`` random teams that differ from each other and from those ``taken``, (J, T).

    Fewer where many tries find no more.
    """
    return new_among(random_teams(field, TRIES * count, rng), count, taken)


def new_among(teams: Ints, count: int, taken: Ints) -> Ints:
    """Returns the first ``count`` of ``teams``, (J, T), that differ from those before and from those ``taken``."""
    found = teams[np.sort(distinct(teams))]
    return found[places_of(found, taken) < 0][:count]


def distinct(teams: Ints) -> Ints:
    """Returns the first row of each of the different ``teams``, (J, T), in lexicographic order of their members."""
    return np.unique(np.sort(teams, axis=1), axis=0, return_index=True)[1]
