"""MCAA that counts the best of the teams that played, not the winners."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.selector.base import Field
from berteam_cli.selector.mcaa import Mcaa, top_weights
from tests.strategies import floats, outcomes

ISLANDS = np.array([0, 0, 1, 2, 2, 2])
RNG = np.random.default_rng(0)
GAMES = outcomes(
    [[[0, 1], [2, 2]], [[2, 2], [3, 4]], [[1, 0], [5, 2]], [[3, 4], [5, 2]]],
    [[1, 0], [1, 0], [0.5, 0.5], [0, 1]],
)  # means: (0, 1) and (2, 5) .75, (2, 2) .5, (3, 4) 0


def mcaa(top_fraction, train_every=1, valid=None):
    return Mcaa(Field(ISLANDS, 2, valid=valid), 0.2, train_every, top_fraction)


def step(shares):
    """Returns the logits of one step from equal ones towards ``shares``."""
    theta = torch.zeros(3, dtype=torch.float64, requires_grad=True)
    (-0.2 / 2 * ((torch.tensor(shares) - torch.softmax(theta, 0)) ** 2).sum()).backward()
    return (theta + theta.grad).detach().numpy()


@pytest.mark.parametrize(
    ("fraction", "members"),
    [
        (0.5, [2, 1, 1]),  # the two best: (0, 1) and (2, 5)
        (0.25, [1, 0.5, 0.5]),  # they share one place
        (0.75, [2, 3, 1]),
        (0.625, [2, 2, 1]),  # (2, 2) counts half
        (1.0, [2, 3, 3]),
    ],
)
def test_whose_members_count_by_hand(fraction, members):
    """O7 with other shares: the step is the gradient of half the squared distance to them."""
    selector = mcaa(fraction)
    after, said = selector.learn(selector.init(RNG), GAMES, None, np.zeros(6), RNG)
    assert said.updates == 1
    np.testing.assert_allclose(after.logits, step(np.array(members) / np.sum(members)), atol=1e-12)
    assert len(after.tally) == 0


def test_games_are_counted_over_the_epochs_between_two_updates():
    selector = mcaa(0.5, train_every=2)
    state = selector.init(RNG)
    once, said = selector.learn(state, GAMES, None, np.zeros(6), RNG)
    assert (said.updates, said.buffer) == (0, 4)
    np.testing.assert_array_equal(once.logits, 0)
    again = outcomes([[[3, 4], [0, 1]]] * 7, [[1, 0]] * 7)  # (3, 4) rises to 7 / 9, (0, 1) falls
    twice, said = selector.learn(once, again, None, np.zeros(6), RNG)
    assert said.updates == 1
    np.testing.assert_allclose(twice.logits, step(np.array([0, 1, 3]) / 4), atol=1e-12)
    assert len(state.tally) == 0
    restored = selector.restored(selector.tensors(once))
    np.testing.assert_array_equal(restored.tally.teams, once.tally.teams)
    other, _ = selector.learn(restored, again, None, np.zeros(6), RNG)
    np.testing.assert_array_equal(other.logits, twice.logits)


def test_within_rules_shares_stay_where_all_teams_are_as_good():
    """One of island 0 beside one of the others, all eight teams alike: once each is as often as they are drawn."""
    selector = mcaa(1.0, valid=np.array([[1, 1, 0, 0, 0, 0], [0, 0, 1, 1, 1, 1]], dtype=bool))
    state = replace(selector.init(RNG), logits=np.log([5.0, 1, 3]))
    teams = [[a, b] for a in (0, 1) for b in (2, 3, 4, 5)]
    games = outcomes(np.reshape(teams, (4, 2, 2)), np.full((4, 2), 0.5))
    after, said = selector.learn(state, games, None, np.zeros(6), RNG)
    assert said.updates == 1
    np.testing.assert_allclose(after.logits, state.logits, atol=1e-12)


@given(floats(7, 0, 1), st.floats(0.01, 1))
def test_weights_of_the_top(scores, fraction):
    weights = top_weights(scores, fraction)
    assert weights.sum() == pytest.approx(7 * fraction)
    assert (np.diff(weights[np.argsort(-scores)]) <= 1e-12).all()
    for a in range(7):
        np.testing.assert_allclose(weights[scores == scores[a]], weights[a])


def test_scores_that_differ_by_rounding_are_equal():
    np.testing.assert_allclose(top_weights(np.array([0.1 + 0.2, 0.3, 0.0]), 1 / 3), [0.5, 0.5, 0])
