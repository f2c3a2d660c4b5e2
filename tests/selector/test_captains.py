import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.selector.captains import SCHEMES, captains, dealt, distinct, opening
from berteam_cli.selector.filling import towards_uniform

seeds = st.integers(0, 2**32 - 1)


def free(size, members):
    return np.ones((size, members), dtype=np.bool_)


def asked(first, games, sides=2):
    """Returns (B, S, N) the captains' chances for teams that all begin as ``first``, (T, N), says."""
    return np.tile(first.sum(axis=0), (games, sides, 1))


@settings(deadline=None)
@given(st.integers(1, 30), seeds)
def test_property_with_half_as_many_games_everyone_captains_once(half, seed):
    assert np.array_equal(np.sort(dealt(half, 2, 2 * half, np.random.default_rng(seed)).ravel()), np.arange(2 * half))


@settings(deadline=None)
@given(st.integers(1, 40), st.integers(1, 4), st.integers(1, 11), seeds)
def test_property_nobody_comes_again_before_all_came(games, sides, members, seed):
    cards = dealt(games, sides, members, np.random.default_rng(seed))
    assert cards.shape == (games, sides)
    for first in range(0, cards.size, members):
        deck = cards.ravel()[first : first + members]
        assert len(set(deck)) == len(deck)


@settings(deadline=None)
@given(st.sampled_from([dealt, distinct]), st.integers(1, 40), st.integers(2, 4), st.integers(2, 11), seeds)
def test_property_captains_of_a_game_are_distinct(scheme, games, sides, members, seed):
    game = scheme(games, sides, max(members, sides), np.random.default_rng(seed))
    assert game.shape == (games, sides)
    assert all(len(set(row)) == sides for row in game)


@pytest.mark.parametrize("scheme", [dealt, distinct])
def test_a_lone_member_captains_everywhere(scheme):
    assert np.array_equal(scheme(3, 2, 1, np.random.default_rng(0)), np.zeros((3, 2)))


@pytest.mark.parametrize("scheme", [dealt, distinct])
def test_every_member_is_equally_likely_on_each_seat(scheme):
    rng = np.random.default_rng(0)
    draws = np.array([scheme(2, 2, 3, rng) for _ in range(6000)])  # the second game straddles two decks
    for game in range(2):
        for side in range(2):
            share = np.bincount(draws[:, game, side], minlength=3) / 6000
            np.testing.assert_allclose(share, 1 / 3, atol=5 * np.sqrt(2 / 9 / 6000))


def test_opening_by_hand():
    odds = np.array([[0.6, 0.4], [0.2, 0.8]])
    expected = [[0.5 * 0.75, 0.5 / 3], [0.5 * 0.25, 0.5 * 2 / 3]]  # half for each captain, then 0.6 : 0.2 and 0.4 : 0.8
    for scheme in ("matching", "uniform"):
        np.testing.assert_allclose(opening(scheme, odds, np.ones(2), free(2, 2)), expected)
    np.testing.assert_allclose(opening("berteam", odds, np.zeros(2), free(2, 2)), odds / 2)
    np.testing.assert_allclose(opening("berteam", odds, np.ones(2), free(2, 2)), 0.25)


@settings(deadline=None)
@given(st.sampled_from(SCHEMES), st.integers(1, 4), st.integers(1, 6), seeds)
def test_property_opening_is_a_distribution(scheme, size, members, seed):
    rng = np.random.default_rng(seed)
    odds, doubt = rng.dirichlet(np.ones(members), size=size), rng.random(members)
    allowed = rng.random((size, members)) < 0.6
    allowed[np.arange(size), rng.integers(members, size=size)] = True
    chances = opening(scheme, odds, doubt, allowed)
    assert not chances[~allowed].any()
    if scheme != "berteam":
        somewhere = allowed.any(axis=0)
        np.testing.assert_allclose(chances.sum(axis=0), somewhere / somewhere.sum())
    chances = opening(scheme, odds, doubt, free(size, members))
    assert np.all(chances >= 0)
    np.testing.assert_allclose(chances.sum(), 1.0)


def test_a_captain_unthinkable_everywhere_still_stands_somewhere():
    chances = opening("uniform", np.array([[0.0, 1.0], [0.0, 1.0]]), np.zeros(2), free(2, 2))
    np.testing.assert_allclose(chances, 0.25)


def test_berteam_draws_captains_from_the_noisy_first_choice():
    odds = np.array([[0.7, 0.2, 0.1], [0.1, 0.1, 0.8]])
    doubt = np.array([0.0, 1.0, 0.5])
    first = opening("berteam", odds, doubt, free(2, 3))
    drawn = captains("berteam", asked(first, 10_000), np.random.default_rng(0))
    assert drawn.shape == (10_000, 2)
    share = np.bincount(drawn.ravel(), minlength=3) / 20_000
    np.testing.assert_allclose(share, towards_uniform(odds, doubt).mean(axis=0), atol=5 * 0.5 / np.sqrt(20_000))


def test_the_schemes_are_told_apart():
    first = np.full((2, 6), 1 / 12)
    matched = captains("matching", asked(first, 3), np.random.default_rng(0))
    assert len(np.unique(matched)) == 6
    games = [captains("uniform", asked(first, 3), np.random.default_rng(seed)) for seed in range(20)]
    assert any(len(np.unique(game)) < 6 for game in games)
    assert all(row[0] != row[1] for game in games for row in game)


@pytest.mark.parametrize("scheme", ["matching", "uniform"])
def test_who_may_stand_nowhere_is_no_captain(scheme):
    allowed = np.array([[True, False, True, False], [True, False, False, False]])
    first = opening(scheme, np.full((2, 4), 0.25), np.zeros(4), allowed)
    leaders = captains(scheme, asked(first, 50), np.random.default_rng(0))
    assert set(leaders.ravel()) == {0, 2}
    assert (leaders[:, 0] != leaders[:, 1]).all()


def test_each_team_has_the_captain_that_its_own_odds_give():
    chances = np.eye(5)[np.array([[3, 1], [0, 4]])]
    np.testing.assert_array_equal(captains("berteam", chances, np.random.default_rng(0)), [[3, 1], [0, 4]])
