import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected, held_ratings, ratings
from berteam_cli.rating.elo import nats, points


def test_expected_score_by_hand():
    assert expected(np.array(np.log(3.0)), np.array(0.0)) == pytest.approx(0.75)


@given(st.integers(0, 2**32))
def test_held_ratings_balance_points_made_and_expected(seed):
    """O11: where the likelihood is highest, sum of (S - Y) is 0 for every team."""
    rng = np.random.default_rng(seed)
    anchors = rng.normal(1000, 200, size=7)
    games = rng.integers(1, 9, size=(5, 7))
    scores = rng.integers(0, 2 * games + 1) / 2
    elos, _ = held_ratings(scores, games, anchors)
    chances = expected(nats(elos)[:, np.newaxis], nats(anchors))
    prior = PRIOR_DRAWS * (0.5 - expected(nats(elos), np.zeros(5)))
    np.testing.assert_allclose((scores - games * chances).sum(axis=1) + prior, 0, atol=1e-6)


def test_held_rating_by_hand():
    # Three of four points against 1000: odds of 3 to 1, with a quarter of a drawn game beside.
    made = (3 + 0.5 * PRIOR_DRAWS) / (4 + PRIOR_DRAWS)
    elos, widths = held_ratings(np.array([[3.0]]), np.array([[4.0]]), np.array([1000.0]))
    assert elos[0] == pytest.approx(points(np.log(made / (1 - made))), abs=1e-6)
    information = (4 + PRIOR_DRAWS) * made * (1 - made) - PRIOR_DRAWS * made * (1 - made) + PRIOR_DRAWS / 4
    assert widths[0] == pytest.approx(1.959964 * 400 / np.log(10) / np.sqrt(information), rel=1e-6)


def test_a_perfect_record_stays_finite_and_a_longer_one_is_better():
    anchors = np.full(2, 1000.0)
    elos, _ = held_ratings(np.array([[2.0, 2], [20, 20]]), np.array([[2.0, 2], [20, 20]]), anchors)
    assert 1000 < elos[0] < elos[1] < 3000


def test_tournament_finds_the_strengths_that_made_it():
    strengths = np.array([-1.0, -0.2, 0.3, 0.9])
    chances = expected(strengths[:, np.newaxis], strengths)
    games = np.full((4, 4), 1e6)
    elos, widths = ratings(games * chances, games)
    np.testing.assert_allclose(elos, points(strengths), atol=0.1)
    assert (widths < 1).all()


def test_tournament_does_not_mind_the_order_of_the_players():
    rng = np.random.default_rng(1)
    games = np.full((5, 5), 8.0)
    scores = np.triu(rng.integers(0, 17, size=(5, 5)) / 2, 1)
    scores += np.tril(8 - scores.T, -1)
    order = rng.permutation(5)
    elos, _ = ratings(scores, games)
    np.testing.assert_allclose(ratings(scores[np.ix_(order, order)], games)[0], elos[order], atol=1e-4)
    assert elos.mean() == pytest.approx(1000)
    total = scores[~np.eye(5, dtype=bool)].reshape(5, 4).sum(axis=1)
    assert (np.argsort(elos) == np.argsort(total, kind="stable")).all()


def test_anchored_and_free_fits_agree():
    """A team rated against the others' Elos, held, gets the Elo it has in the tournament."""
    rng = np.random.default_rng(2)
    games = np.full((6, 6), 50.0)
    scores = np.triu(rng.integers(10, 41, size=(6, 6)), 1).astype(float)
    scores += np.tril(50 - scores.T, -1)
    elos, _ = ratings(scores, games)
    held, _ = held_ratings(scores[:1, 1:], games[:1, 1:], elos[1:])
    assert held[0] == pytest.approx(elos[0], abs=0.5)  # the prior pulls to a mean that is not quite the same


def three_sided(strengths, games, seed):
    """Points and games of players that each stood alone against two copies of each other, drawn from the softmax."""
    rng = np.random.default_rng(seed)
    odds = np.exp(strengths)
    chances = odds[:, np.newaxis] / (odds[:, np.newaxis] + 2 * odds)
    played = np.full(chances.shape, games) * (1.0 - np.eye(len(strengths)))
    return rng.binomial(played.astype(int), chances).astype(float), played


@given(st.integers(0, 2**32))
def test_alone_or_in_copies_points_made_and_expected_balance(seed):
    """O11 among three sides: sum of (S - Y) over all sides that a player held is 0."""
    scores, games = three_sided(np.random.default_rng(seed).normal(size=4), 9, seed)
    strengths = nats(ratings(scores, games, np.log(2))[0])
    odds = np.exp(strengths)
    alone = odds[:, np.newaxis] / (odds[:, np.newaxis] + 2 * odds)
    own = (scores - games * alone).sum(axis=1)
    copies = ((games - scores) - games * (1 - alone)).sum(axis=0)
    assert (np.abs(own + copies) < PRIOR_DRAWS / 2).all()  # what the prior's draws add at most
    assert (own + copies).sum() == pytest.approx(0, abs=1e-4)


def test_a_tournament_of_three_sides_finds_the_strengths_that_made_it():
    strengths = np.array([-1.0, -0.2, 0.3, 0.9])
    scores, games = three_sided(strengths, 4_000_000, 0)
    elos, widths = ratings(scores, games, np.log(2))
    np.testing.assert_allclose(elos, points(strengths), atol=0.5)
    assert (widths < 0.5).all()
    # Without the handicap players seem equal who score a third of the points alone.
    even, played = three_sided(np.zeros(2), 3_000_000, 1)
    np.testing.assert_allclose(even[0, 1] / played[0, 1], 1 / 3, atol=0.001)
    np.testing.assert_allclose(ratings(even, played, np.log(2))[0], 1000, atol=0.5)


def test_held_ratings_with_a_handicap_by_hand():
    """Alone against two copies and, with a copy of oneself, against one: a third and two thirds are expected."""
    elos, _ = held_ratings(np.array([[2.0, 4.0]]), np.full((1, 2), 6.0), np.full(2, 1000.0), np.log([2, 0.5]))
    assert elos[0] == pytest.approx(1000, abs=1e-6)
    anchors = np.array([900.0, 1100.0])
    shifted = anchors + points(np.log(2.0)) - 1000
    one = held_ratings(np.array([[1.0, 2.0]]), np.full((1, 2), 6.0), anchors, np.log(2))
    two = held_ratings(np.array([[1.0, 2.0]]), np.full((1, 2), 6.0), shifted)
    np.testing.assert_allclose(one, two)
