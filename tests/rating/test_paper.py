"""The paper's ways to Elos, and what is wrong with them."""

import numpy as np
import pytest

from berteam_cli.rating.bradley_terry import expected
from berteam_cli.rating.elo import nats
from berteam_cli.rating.paper import in_order, online_elos, squared_error_elos


def test_online_elo_by_hand():
    """Equals: the winner gets 16; then 516 against 484 is expected .546, and a draw gives back 32 * .046."""
    assert online_elos(2, [(0, 1, 1.0)]) == pytest.approx([1016, 984])
    back = 32 * (1 / (1 + 10 ** (-32 / 400)) - 0.5)
    assert online_elos(2, [(0, 1, 1.0), (1, 0, 0.5)]) == pytest.approx([1016 - back, 984 + back])
    games = in_order(np.array([[0, 1], [1, 0]]), np.array([1.0, 0.5]))
    assert online_elos(2, games) == pytest.approx([1016 - back, 984 + back])


def test_online_elo_depends_on_the_order_of_games():
    games = [(0, 1, 1.0)] * 8 + [(0, 1, 0.0)] * 8
    last, first = online_elos(2, games), online_elos(2, games[::-1])
    assert last[1] > 1040
    assert first[0] > 1040


def test_squared_error_finds_scores_that_a_model_can_have():
    strengths = np.array([-0.8, 0.0, 0.3, 0.5])
    scores = expected(strengths[:, np.newaxis], strengths)
    found = nats(squared_error_elos(scores, np.ones((4, 4))))
    assert found == pytest.approx(strengths - strengths.mean(), abs=0.02)


def test_squared_error_takes_no_heed_of_how_often_a_pair_met():
    rng = np.random.default_rng(0)
    mean = np.triu(rng.random((5, 5)), 1)
    mean = mean + np.tril(1 - mean.T, -1)
    often = rng.integers(1, 1000, (5, 5)).astype(float)
    often = np.triu(often, 1) + np.triu(often, 1).T
    once = squared_error_elos(mean, np.ones((5, 5)))
    np.testing.assert_allclose(squared_error_elos(mean * often, often), once, atol=1e-6)
    few = np.ones((5, 5))
    few[0, 1] = few[1, 0] = 0  # as if they had not met
    assert np.abs(squared_error_elos(mean * few, few) - once).max() > 1


def test_squared_error_stops_before_a_perfect_record_is_endless():
    wins = np.array([[0.0, 100.0], [0.0, 0.0]])
    found = squared_error_elos(wins, wins + wins.T)
    assert 1200 < found[0] < 2000  # it would be endless, and depends on when it stops
