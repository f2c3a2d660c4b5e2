import numpy as np
import pytest
from hypothesis import given

from berteam_cli.optimizer.fitness import CaptainElo, MovingAverage, proportional
from tests.strategies import floats, outcomes, played


@given(played(), floats(6))
def test_elo_is_conserved(games, fitness):
    """O5: what one captain wins the other loses."""
    after = CaptainElo(32, 0).rated(fitness, games)
    assert after.sum() == pytest.approx(fitness.sum())


@given(played(sides=3), floats(6))
def test_elo_of_three_captains_is_conserved(games, fitness):
    assert CaptainElo(32, 0).rated(fitness, games).sum() == pytest.approx(fitness.sum())
    assert CaptainElo(0, 8).rated(fitness, games).sum() == pytest.approx(fitness.sum())


@given(played(), floats(6))
def test_elo_of_members_is_conserved(games, fitness):
    assert CaptainElo(0, 8).rated(fitness, games).sum() == pytest.approx(fitness.sum())


def test_a_draw_between_equals_changes_nothing():
    drawn = outcomes([[[0, 1], [2, 3]]], [[0.5, 0.5]], [[0, 2]])
    np.testing.assert_array_equal(CaptainElo(32, 1).rated(np.zeros(4), drawn), np.zeros(4))


def test_captain_elo_by_hand():
    # Equals: the winner expected 1/2, so it gains half of K: 16 points. Then it is 32 points ahead.
    won = outcomes([[[0, 1], [2, 3]]] * 2, [[1, 0]] * 2, [[0, 2]] * 2)
    rule = CaptainElo(32, 0)
    once = rule.shown(rule.rated(np.zeros(4), outcomes([[[0, 1], [2, 3]]], [[1, 0]], [[0, 2]])))
    np.testing.assert_allclose(once, [1016, 1000, 984, 1000])
    expected = 1 / (1 + 10 ** (-32 / 400))
    twice = rule.shown(rule.rated(np.zeros(4), won))
    np.testing.assert_allclose(twice, [1016 + 32 * (1 - expected), 1000, 984 - 32 * (1 - expected), 1000])


def test_three_captains_by_hand():
    rule = CaptainElo(30, 0)
    teams, captains = [[[0], [1], [2]]], [[0, 1, 2]]
    # Equals: each expected a third of the point.
    for scores, gains in (([1, 0, 0], [20, -10, -10]), ([0.5, 0, 0.5], [5, -10, 5]), ([1 / 3] * 3, [0, 0, 0])):
        after = rule.shown(rule.rated(np.zeros(3), outcomes(teams, [scores], captains)))
        np.testing.assert_allclose(after, 1000 + np.array(gains), atol=1e-9)
    # With odds of 3 : 1 : 1 they expect 0.6, 0.2 and 0.2.
    strong = np.log([3.0, 1.0, 1.0])
    after = rule.rated(strong, outcomes(teams, [[0, 1, 0]], captains))
    np.testing.assert_allclose((after - strong) * 400 / np.log(10), [-18, 24, -6])


def test_a_captain_of_two_of_three_sides_is_paid_for_both():
    won = outcomes([[[0], [0], [1]]], [[1, 0, 0]], [[0, 0, 1]])
    after = CaptainElo(30, 0).rated(np.zeros(2), won) * 400 / np.log(10)
    np.testing.assert_allclose(after, [10, -10])


def test_members_of_three_teams_by_hand():
    # The teams' means are 1, 0 and 0 times ln 2: they expect 1/2, 1/4 and 1/4.
    fitness = np.log(2.0) * np.array([2.0, 0, 0, 0])
    drawn = outcomes([[[0, 1], [1, 2], [3, 3]]], [[1 / 3] * 3])
    gains = (CaptainElo(0, 12).rated(fitness, drawn) - fitness) * 400 / np.log(10)
    np.testing.assert_allclose(gains, [-2, -2 + 1, 1, 2], atol=1e-9)


def test_member_elo_by_hand():
    won = outcomes([[[0, 0], [1, 2]]], [[1, 0]], [[0, 1]])
    rule = CaptainElo(0, 10)
    np.testing.assert_allclose(rule.shown(rule.rated(np.zeros(3), won)), [1010, 995, 995])


def test_the_same_captain_on_both_sides_changes_nothing():
    won = outcomes([[[0, 1], [0, 2]]], [[1, 0]], [[0, 0]])
    np.testing.assert_array_equal(CaptainElo(32, 0).rated(np.array([1.0, 2, 3]), won), [1, 2, 3])


def test_no_captain_no_elo():
    won = outcomes([[[0, 1], [2, 2]]], [[1, 0]])
    np.testing.assert_array_equal(CaptainElo(32, 0).rated(np.zeros(3), won), np.zeros(3))


def test_moving_average_by_hand():
    # Game 1: 0 and 1 win; game 2: 0 holds both places and loses, so it moves twice.
    games = outcomes([[[0, 1], [2, 2]], [[0, 0], [1, 2]]], [[1, 0], [0, 1]])
    after = MovingAverage(0.1).rated(np.full(3, 0.5), games)
    np.testing.assert_allclose(after, [0.55 * 0.9**2, 0.55 * 0.9 + 0.1, 0.5 * 0.9**2 * 0.9 + 0.1])


@given(floats(5))
def test_400_points_are_ten_times_the_clones(fitness):
    fitness[1] = fitness[0] + np.log(10)
    rule = CaptainElo(32, 0)
    chances = rule.clone_chances(fitness)
    assert chances.sum() == pytest.approx(1)
    assert chances[1] / chances[0] == pytest.approx(10)
    removal = rule.removal_chances(fitness)
    assert removal[0] / removal[1] == pytest.approx(10)


def test_moving_average_chances_by_hand():
    rule = MovingAverage(0.01)
    np.testing.assert_allclose(rule.clone_chances(np.array([0.2, 0.6])), [0.25, 0.75])
    np.testing.assert_allclose(rule.removal_chances(np.array([0.2, 0.6])), [2 / 3, 1 / 3])
    np.testing.assert_allclose(proportional(np.zeros(4)), 0.25)


@given(floats(5))
def test_centred_elo_has_mean_zero_and_the_average_is_left_alone(fitness):
    assert CaptainElo(32, 0).centred(fitness).mean() == pytest.approx(0, abs=1e-9)
    np.testing.assert_array_equal(MovingAverage(0.1).centred(fitness), fitness)
