from collections import Counter
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.outcomes import NOBODY
from berteam_cli.selector.base import Field
from berteam_cli.selector.independent import anybody
from berteam_cli.selector.listed import (
    Listed,
    Mixture,
    every_team,
    fresh,
    lineups,
    log_chances,
    new_among,
    places_of,
)

ISLANDS = np.zeros(4, dtype=int)
WILL = Mixture(np.array([[0, 1, 1], [2, 1, 0], [3, 3, 3]]), np.array([0.5, 0.3, 0.2]))
VALID = np.array([[1, 0, 1, 1], [1, 1, 0, 1], [1, 1, 0, 1]], dtype=bool)


class Willing(Listed):
    """One whose state is its mixture."""

    def mixture(self, state):
        return state


def field(valid=None, sides=2):
    return Field(ISLANDS, 3, sides, valid)


def standing(field):
    """Returns all ordered teams within the rules."""
    return np.array(list(product(*(np.flatnonzero(row) for row in field.allowed))))


@pytest.mark.parametrize("valid", [None, VALID])
@pytest.mark.parametrize("sides", [2, 3])
def test_teams_come_as_often_as_their_log_chances_say(valid, sides):
    among = field(valid, sides)
    selector = Willing(among, 0.25)
    games = selector.drawn_games(WILL, 20_000, np.random.default_rng(0))
    assert games.teams.shape == (20_000, sides, 3)
    everything = standing(among)
    chances = np.exp(log_chances(among, everything, WILL, 0.25))
    assert chances.sum() == pytest.approx(1)
    counts = Counter(map(tuple, games.teams.reshape(-1, 3).tolist()))
    assert set(counts) <= set(map(tuple, everything.tolist()))
    shares = [counts[tuple(team)] / games.captains.size for team in everything.tolist()]
    np.testing.assert_allclose(shares, chances, atol=0.008)
    told = dict(zip(map(tuple, everything.tolist()), np.log(chances), strict=True))
    for team, chance in zip(games.teams[:50].reshape(-1, 3).tolist(), games.log_chances[:50].ravel(), strict=True):
        assert chance == pytest.approx(told[tuple(team)])


def test_captains_stand_in_their_team_at_any_place():
    selector = Willing(field(), 0.0)
    games = selector.drawn_games(WILL, 20_000, np.random.default_rng(0))
    assert (games.captains != NOBODY).all()
    assert (games.teams == games.captains[:, :, np.newaxis]).any(axis=2).all()
    shares = np.bincount(games.captains.ravel(), minlength=4) / games.captains.size
    np.testing.assert_allclose(shares, [0.8 / 3, 1.3 / 3, 0.1, 0.2], atol=0.01)
    np.testing.assert_allclose(selector.captains(WILL), [0.8 / 3, 1.3 / 3, 0.1, 0.2])


def test_distribution_is_that_of_sampled_teams():
    selector = Willing(field(), 0.5)
    told = selector.distribution(WILL)
    np.testing.assert_array_equal(told.teams, [[0, 1, 1], [0, 1, 2], [3, 3, 3]])
    np.testing.assert_array_equal(told.probability, [0.5, 0.3, 0.2])
    drawn = np.sort(selector.sample(WILL, 10_000, np.random.default_rng(1)), axis=1)
    shares = [(drawn == team).all(axis=1).mean() for team in told.teams]
    np.testing.assert_allclose(shares, told.probability, atol=0.02)
    top = selector.likeliest(WILL, 1, np.random.default_rng(0))
    np.testing.assert_array_equal(top.teams, [[0, 1, 1]])
    assert top.other == 0.5


def test_a_team_that_is_never_chosen_is_not_listed():
    told = Willing(field(), 0.5).distribution(Mixture(WILL.teams, np.array([0, 1.0, 0])))
    np.testing.assert_array_equal(told.teams, [[0, 1, 2]])


@pytest.mark.parametrize("valid", [None, VALID])
def test_who_knows_nothing_gives_every_place_to_all_alike(valid):
    among = field(valid)
    selector = Willing(among, 0.3)
    told = selector.distribution(None)
    everything = Counter(map(tuple, np.sort(standing(among), axis=1).tolist()))
    assert {tuple(team) for team in told.teams.tolist()} == set(everything)
    for team, chance in zip(told.teams.tolist(), told.probability, strict=True):
        assert chance == pytest.approx(everything[tuple(team)] / everything.total())
    games = selector.drawn_games(None, 10, np.random.default_rng(0))
    np.testing.assert_allclose(games.log_chances, -np.log(everything.total()))
    np.testing.assert_allclose(selector.captains(None), anybody(among).mean(axis=0))
    assert len(selector.likeliest(None, 3, np.random.default_rng(0)).teams) == 3


def test_a_schedule_is_played_in_any_order_and_the_chance_is_the_share():
    selector = Willing(field(), 0.0)
    schedule = np.array([[0, 1], [0, 2]])
    games = selector.scheduled_games(WILL.teams, schedule, np.random.default_rng(0))
    which = places_of(games.teams, WILL.teams)
    assert sorted(map(tuple, np.sort(which, axis=1).tolist())) == [(0, 1), (0, 2)]
    np.testing.assert_allclose(np.exp(games.log_chances), np.array([0.5 / 3, 0.25 / 6, 0.25])[which])
    sides = [
        places_of(selector.scheduled_games(WILL.teams, schedule, np.random.default_rng(k)).teams, WILL.teams)[0, 0]
        for k in range(400)
    ]
    np.testing.assert_allclose(np.bincount(sides) / 400, [0.5, 0.25, 0.25], atol=0.08)


def test_what_cannot_be_has_no_chance():
    told = log_chances(field(), np.array([[0, 0, 0], [1, 0, 1]]), WILL, 0.0)
    np.testing.assert_allclose(told, [-np.inf, np.log(0.5 / 3)])
    nobody = lineups(field(), WILL.teams[[0, 1, 2, 0]], WILL, 1.0, np.random.default_rng(0))
    np.testing.assert_allclose(nobody.log_chances, -3 * np.log(4))


@given(st.integers(0, 2**32), st.integers(1, 3), st.integers(2, 5))
def test_every_team_there_can_be(seed, size, members):
    rng = np.random.default_rng(seed)
    valid = rng.random((size, members)) < 0.6
    valid[np.arange(size), rng.integers(members, size=size)] = True
    among = Field(np.zeros(members, dtype=int), size, valid=valid)
    teams = every_team(among, 1000)
    assert valid[np.arange(size), teams].all()
    listed = list(map(tuple, np.sort(teams, axis=1).tolist()))
    assert listed == sorted({tuple(sorted(team)) for team in standing(among).tolist()})
    assert every_team(among, len(listed)) is not None
    assert every_team(among, len(listed) - 1) is None
    some = fresh(among, 3, teams[:1], rng)
    assert len(some) <= 3
    assert valid[np.arange(size), some].all()
    assert len(np.unique(np.sort(some, axis=1), axis=0)) == len(some)
    assert (places_of(some, teams[:1]) == -1).all()


def test_teams_are_found_in_any_order():
    teams = np.array([[[1, 1, 0], [0, 1, 2]], [[3, 3, 1], [3, 3, 3]]])
    np.testing.assert_array_equal(places_of(teams, WILL.teams), [[0, 1], [-1, 2]])
    np.testing.assert_array_equal(places_of(teams, np.zeros((0, 3), dtype=int)), -1)
    np.testing.assert_array_equal(
        new_among(np.array([[1, 0], [2, 0], [0, 1], [2, 2]]), 5, teams[0, :, :2]), [[2, 0], [2, 2]]
    )
