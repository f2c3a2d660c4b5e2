"""A member with settings of its own learns exactly as one of a learner that has them for all."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.learner.stacked_ppo import StackedPpo
from berteam_cli.learner.traits import TRAITS, traits_of
from berteam_cli.workers import Workers
from tests.learner import test_dqn, test_ppo

LEARNERS = [
    test_ppo.SMALL,
    replace(test_dqn.SMALL, n_steps=3),
    StackedPpo(**asdict(test_ppo.SMALL), device="cpu"),
    StackedDqn(**asdict(replace(test_dqn.SMALL, n_steps=3)), device="cpu"),
]
OTHER = {"learning_rate": 3e-3, "entropy_coef": 0.2, "gamma": 0.7}


def learnt(learner, games, traits=None):
    """The weights (4, W) of four members that begin alike, after an epoch in which two of them see the same."""
    state = learner.init(4, np.random.default_rng(3))
    for column in state.trained[:1]:
        column[:] = column[:1]
    if hasattr(state, "target"):
        state.target[:] = state.trained.weights
    given = () if traits is None else (traits,)
    learner.learn(state, games, 0, np.random.default_rng(8), Workers(2), *given)
    return np.asarray(state.trained.weights)


def games_of(random_games):
    """Two games in which all four members play, the same in each other's eyes."""
    games = random_games([[0, 1, 2, 3], [3, 2, 1, 0]], [60, 70], [False, True])
    for column in (games.observations, games.actions, games.rewards):
        column[:] = column[:, :1]
    return games


@pytest.mark.parametrize("name", TRAITS)
@pytest.mark.parametrize("learner", LEARNERS, ids=[type(x).__name__ for x in LEARNERS])
def test_each_member_learns_by_its_own_value(learner, name, random_games):
    if name not in learner.own_traits:
        assert np.isnan(traits_of(learner)[TRAITS.index(name)])
        return
    games = games_of(random_games)
    traits = np.tile(traits_of(learner), (4, 1))
    usual = learnt(learner, games)
    np.testing.assert_array_equal(learnt(learner, games, traits), usual)
    traits[[1, 3], TRAITS.index(name)] = OTHER[name]
    mixed = learnt(learner, games, traits)
    others = learnt(replace(learner, **{name: OTHER[name]}), games)
    np.testing.assert_array_equal(mixed[[0, 2]], usual[[0, 2]])
    np.testing.assert_array_equal(mixed[[1, 3]], others[[1, 3]])
    assert (np.abs(mixed[[1, 3]] - usual[[1, 3]]).max(axis=1) > 1e-5).all()
