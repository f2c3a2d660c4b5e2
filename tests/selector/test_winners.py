import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import NOBODY, Lineups, Outcomes
from berteam_cli.selector.winners import harvest, minibatch, no_winners, pushed


def outcomes_of(teams, scores, log_chances=None):
    teams, scores = np.array(teams), np.array(scores, dtype=float)
    games, sides = scores.shape
    chances = np.full(scores.shape, np.nan) if log_chances is None else np.array(log_chances)
    lineups = Lineups(teams, np.full(scores.shape, NOBODY), chances)
    return Outcomes(
        lineups, scores, np.ones(games, int), np.zeros((games, sides, 4), int), np.zeros(games, dtype=np.uint64)
    )


THREE_GAMES = ([[[0, 1], [2, 3]], [[4, 5], [6, 7]], [[8, 9], [0, 0]]], [[1, 0], [0.5, 0.5], [0, 1]])


@settings(deadline=None)
@given(st.integers(1, 7), st.lists(st.integers(0, 12), max_size=6))
def test_property_the_ring_holds_the_newest_and_knows_their_ages(capacity, pushes):
    winners, history = no_winners(capacity, 2), []
    for count in pushes:
        before = (winners.teams.copy(), winners.weights.copy(), winners.pushed)
        teams = len(history) + np.stack([np.arange(count), np.arange(count)], axis=1)
        after = pushed(winners, teams, teams[:, 0] + 0.5)
        assert np.array_equal(winners.teams, before[0])
        assert np.array_equal(winners.weights, before[1])
        assert winners.pushed == before[2]
        winners = after
        history += list(range(len(history), len(history) + count))
    newest = history[-capacity:]
    assert len(winners) == len(newest)
    held = winners.teams[: len(winners), 0]
    assert sorted(held) == newest
    assert np.array_equal(winners.weights[: len(winners)], held + 0.5)
    assert np.array_equal(winners.ages, len(history) - 1 - held)


def test_the_next_team_takes_the_place_of_the_oldest():
    winners = no_winners(3, 1)
    for k in range(4):
        winners = pushed(winners, np.array([[k]]), np.ones(1))
    assert winners.teams.ravel().tolist() == [3, 1, 2]


def test_minibatch_weights_decay_with_age_by_hand_and_have_mean_one():
    winners = pushed(no_winners(4, 1), np.arange(4)[:, np.newaxis], np.array([8.0, 4, 3, 1]))
    teams, weights = minibatch(winners, 200, 2.0, np.random.default_rng(0))
    np.testing.assert_allclose(weights.mean(), 1.0)
    each = np.array([weights[teams[:, 0] == k][0] for k in range(4)])
    # Ages 3, 2, 1, 0 pushes with half-life 2.
    np.testing.assert_allclose(each / each[3], [8 * 2**-1.5, 4 * 2**-1, 3 * 2**-0.5, 1])
    teams, weights = minibatch(winners, 200, 0.0, np.random.default_rng(0))
    each = np.array([weights[teams[:, 0] == k][0] for k in range(4)])
    np.testing.assert_allclose(each / each[3], [8, 4, 3, 1])


def test_minibatches_are_drawn_uniformly_with_replacement_from_what_is_there():
    winners = pushed(no_winners(100, 1), np.arange(4)[:, np.newaxis], np.array([9.0, 1, 1, 1]))
    teams, _ = minibatch(winners, 20_000, 0.0, np.random.default_rng(1))
    np.testing.assert_allclose(np.bincount(teams[:, 0]) / 20_000, 0.25, atol=5 * 0.44 / np.sqrt(20_000))


def test_very_old_winners_still_have_weights():
    winners = pushed(no_winners(5000, 1), np.zeros((5000, 1), int), np.ones(5000))
    for seed in range(20):
        _, weights = minibatch(winners, 2, 1.0, np.random.default_rng(seed))
        np.testing.assert_allclose(weights.mean(), 1.0)


def test_only_winners_are_harvested_when_draws_weigh_nothing():
    teams, weights = harvest(outcomes_of(*THREE_GAMES), 0.0, 13.0, None)
    assert teams.tolist() == [[0, 1], [0, 0]]
    assert weights.tolist() == [1, 1]


def test_both_teams_of_a_draw_are_harvested_with_their_weight():
    teams, weights = harvest(outcomes_of(*THREE_GAMES), 0.25, 13.0, None)
    assert teams.tolist() == [[0, 1], [4, 5], [6, 7], [0, 0]]
    assert weights.tolist() == [1, 0.25, 0.25, 1]


def test_sides_that_share_a_draw_are_harvested_however_they_share_it():
    scores = [[1, 0, 0], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]]
    three_sides = outcomes_of(np.arange(9).reshape(3, 3, 1), scores)
    teams, weights = harvest(three_sides, 0.25, 13.0, None)
    assert teams.ravel().tolist() == [0, 3, 5, 6, 7, 8]
    assert weights.tolist() == [1] + [0.25] * 5
    assert harvest(three_sides, 0.0, 13.0, None)[0].tolist() == [[0]]


def test_inverse_probability_weights_by_hand():
    chances = np.log([[0.05, 1], [0.02, 0.5], [1, 0.0001]])  # of 100 ordered teams
    teams, weights = harvest(outcomes_of(*THREE_GAMES, chances), 0.5, 13.0, 10)
    assert teams.tolist() == [[0, 1], [4, 5], [6, 7], [0, 0]]
    np.testing.assert_allclose(weights, [0.2, 0.5 * 0.5, 0.5 * 0.02, 13])
    _, weights = harvest(outcomes_of(*THREE_GAMES, chances), 0.0, math.inf, 10)
    np.testing.assert_allclose(weights, [0.2, 100])


def test_weighting_refuses_teams_of_unknown_chance():
    with pytest.raises(ValueError, match="log_chances"):
        harvest(outcomes_of(*THREE_GAMES), 0.0, 13.0, 10)
