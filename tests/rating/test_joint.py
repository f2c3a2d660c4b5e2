"""Players who met each other and opponents of known Elo."""

import numpy as np
import pytest

from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected, held_ratings, ratings
from berteam_cli.rating.elo import nats
from berteam_cli.rating.joint import joint_ratings

ANCHORS = np.array([900.0, 1000.0, 1250.0])


def test_players_who_never_met_are_rated_by_their_anchors():
    rng = np.random.default_rng(0)
    games = rng.integers(1, 30, (4, 3)).astype(float)
    scores = games * rng.random((4, 3))
    none = np.zeros((4, 4))
    alone = held_ratings(scores, games, ANCHORS)[0]
    np.testing.assert_allclose(joint_ratings(none, none, scores, games, ANCHORS), alone, atol=1e-6)


def test_players_without_anchors_are_rated_by_each_other():
    rng = np.random.default_rng(1)
    games = np.triu(rng.integers(1, 30, (5, 5)), 1).astype(float)
    scores = games * rng.random((5, 5))
    games, scores = games + games.T, scores + (games - scores).T
    none = np.zeros((5, 3))
    found = joint_ratings(scores, games, none, none, ANCHORS)
    np.testing.assert_allclose(found - found.mean(), ratings(scores, games)[0] - 1000, atol=1e-6)


def test_everybody_makes_what_is_expected_of_it():
    rng = np.random.default_rng(2)
    games = np.triu(rng.integers(0, 30, (6, 3, 3)), 1).astype(float)
    scores = games * rng.random((6, 3, 3))
    games, scores = games + games.transpose(0, 2, 1), scores + (games - scores).transpose(0, 2, 1)
    held_games = rng.integers(0, 40, (6, 3, 3)).astype(float)
    held_scores = held_games * rng.random((6, 3, 3))
    strengths = nats(joint_ratings(scores, games, held_scores, held_games, ANCHORS))
    for k in range(6):
        own = strengths[k][:, np.newaxis]
        hoped = (games[k] * expected(own, strengths[k])).sum(axis=1) + PRIOR_DRAWS * expected(strengths[k], 0.0)
        hoped += (held_games[k] * expected(own, nats(ANCHORS))).sum(axis=1)
        assert hoped == pytest.approx(scores[k].sum(axis=1) + held_scores[k].sum(axis=1) + PRIOR_DRAWS / 2, abs=1e-9)


def test_a_hand_worked_case():
    """Even with an anchor of 1000 and even with each other: both are 1000; one that wins 3 of 4 is 191 above."""
    many = np.array([[0.0, 1e6], [1e6, 0.0]])
    held = np.array([[1e6], [1e6]])
    anchor = np.array([1000.0])
    np.testing.assert_allclose(joint_ratings(many / 2, many, held / 2, held, anchor), [1000, 1000])
    scores = np.array([[0.0, 75e4], [25e4, 0.0]])
    elos = joint_ratings(scores, many, np.zeros((2, 1)), np.zeros((2, 1)), anchor)
    assert elos[0] - elos[1] == pytest.approx(400 * np.log10(3), abs=1e-2)
