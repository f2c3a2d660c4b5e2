"""Members whose weights are no numbers any more are caught, and the run goes on."""

import logging
from dataclasses import asdict, replace

import numpy as np
import pytest
import torch

from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.ppo import Ppo
from berteam_cli.learner.sb3 import Sb3
from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.outcomes import Experience
from berteam_cli.population import Island, founded
from tests.optimizer.makers import coevolution

SHAPE = {"observation_size": 3, "actions": 2, "network": (4,), "activation": "tanh"}
PPO = Ppo(
    **SHAPE, learning_rate=1e-3, n_steps=8, minibatch_size=4, n_epochs=1, gamma=0.9, gae_lambda=0.9, clip_range=0.2,
    clip_range_vf=None, target_kl=None, entropy_coef=0.0, value_coef=0.5, max_grad_norm=0.5, normalize_advantage=True,
)  # fmt: skip
DQN = Dqn(
    **SHAPE, learning_rate=1e-3, buffer_size=64, batch_size=4, gamma=0.9, n_steps=1, train_freq=2, gradient_steps=1,
    learning_starts=0, target_update_interval=4, tau=1.0, exploration_initial=1.0, exploration_final=0.1,
    exploration_steps=100, max_grad_norm=10.0,
)  # fmt: skip


SB3 = [
    Sb3(3, 2, (4,), algorithm, "tanh", 1000, options)
    for algorithm, options in (
        ("PPO", {"n_steps": 8, "batch_size": 4}),
        ("A2C", {}),
        ("TRPO", {"n_steps": 8, "batch_size": 4}),
        ("DQN", {"buffer_size": 100, "learning_starts": 0}),
        ("QRDQN", {"buffer_size": 100, "learning_starts": 0}),
    )
]


def optimizer_and_population(learner):
    places = (Island("main", 0, 4, learner),)
    optimizer = coevolution(places, replacements=0, elites=0, protect_new=9)
    people = founded(places, 0.0, np.random.default_rng(0))
    people.fitness[:] = [0, 1, 3, 2]
    return optimizer, people


def games(seed):
    rng = np.random.default_rng(seed)
    return Experience(
        members=np.array([[0, 1, 2, 3]]),
        observations=rng.standard_normal((1, 4, 9, 3), dtype=np.float32),
        actions=rng.integers(0, 2, (1, 4, 8)).astype(np.int16),
        rewards=rng.standard_normal((1, 4, 8), dtype=np.float32),
        lengths=np.array([8]),
        terminated=np.array([True]),
    )


def trained(optimizer, people, seed):
    people, learnt, replaced = optimizer.train(people, games(seed), np.random.default_rng(seed))
    return people, {x.row: x for _, x in learnt}, replaced


@pytest.mark.parametrize("learner", [PPO, DQN], ids=["ppo", "dqn"])
def test_a_sick_member_is_undone_once_and_then_replaced_by_the_fittest(learner, caplog, monkeypatch):
    monkeypatch.setattr(logging.getLogger("berteam"), "handlers", [caplog.handler])
    optimizer, people = optimizer_and_population(learner)
    weights = people.minds[0].trained.weights
    weights[1] = 3e38  # finite, but nothing computed from it is
    before = weights.copy()
    people, learnt, replaced = trained(optimizer, people, 1)
    assert [learnt[row].failures for row in range(4)] == [0, 1, 0, 0]
    assert [learnt[row].updates > 0 for row in range(4)] == [True, False, True, True]
    assert np.isnan(learnt[1].loss)
    np.testing.assert_array_equal(weights[1], before[1])
    assert np.isfinite(weights).all()
    assert replaced == []
    assert "undone; of members: 1." in caplog.text
    np.testing.assert_array_equal(people.failed, [0, 1, 0, 0])
    np.testing.assert_array_equal(people.stale, True)

    people, learnt, replaced = trained(optimizer, people, 2)
    assert [(x.removed, x.parent, x.reason) for x in replaced] == [(1, 2, "not finite")]
    np.testing.assert_array_equal(weights[1], weights[2])
    assert (people.parent[1], people.age[1], people.failed[1]) == (2, 0, 0)
    people, learnt, _ = trained(optimizer, people, 3)
    assert learnt[1].updates > 0
    assert learnt[1].failures == 0


def test_whose_policy_changed_is_to_be_measured_again():
    optimizer, people = optimizer_and_population(PPO)
    people.stale[:] = False
    half = games(1)
    half.members[:] = [[0, 9, 2, 9]]  # 1 and 3 do not play
    half.lengths[:] = 5  # too few steps to learn from
    people, _, _ = optimizer.train(people, half, np.random.default_rng(1))
    np.testing.assert_array_equal(people.stale, False)
    half.lengths[:] = 8
    people, _, _ = optimizer.train(people, half, np.random.default_rng(2))
    np.testing.assert_array_equal(people.stale, [True, False, True, False])


@pytest.mark.parametrize("kind", [Dqn, StackedDqn])
def test_the_target_is_renewed_in_time_even_where_learning_is_undone(kind):
    stacked = {"device": "cpu"} if kind is StackedDqn else {}
    optimizer, people = optimizer_and_population(kind(**asdict(replace(DQN, target_update_interval=8)), **stacked))
    mind = people.minds[0]
    mind.trained.weights[:] = 3e38
    mind.target[:] = 0.0
    people, learnt, _ = trained(optimizer, people, 1)
    assert [learnt[row].failures for row in range(4)] == [1, 1, 1, 1]
    assert (mind.target == mind.trained.weights).all()


def test_the_parent_comes_before_the_fittest_unless_it_is_sick_too():
    for sick_too, expected in ((False, 3), (True, 2)):
        optimizer, people = optimizer_and_population(PPO)
        people.parent[1] = 3
        weights = people.minds[0].trained.weights
        weights[[1, 3] if sick_too else 1] = 3e38
        people, _, _ = trained(optimizer, people, 1)
        people, _, replaced = trained(optimizer, people, 2)
        assert (1, expected) in [(x.removed, x.parent) for x in replaced]


@pytest.mark.parametrize("learner", SB3, ids=[x.algorithm for x in SB3])
def test_models_of_stable_baselines_are_watched_too(learner):
    optimizer, people = optimizer_and_population(learner)
    with torch.no_grad():
        for weights in people.minds[0][1].policy.parameters():
            weights.fill_(3e38)
    for seed in (1, 2):
        people, learnt, replaced = trained(optimizer, people, seed)
        assert [learnt[row].failures for row in range(4)] == [0, 1, 0, 0]
        assert [learnt[row].updates > 0 for row in range(4)] == [True, False, True, True]
    assert [(x.removed, x.parent) for x in replaced] == [(1, 2)]
    people, learnt, _ = trained(optimizer, people, 3)
    assert learnt[1].updates > 0


@pytest.mark.parametrize("learner", [PPO, DQN], ids=["ppo", "dqn"])
def test_an_update_that_explodes_leaves_everything_as_it_was(learner):
    exploding = replace(learner, learning_rate=1e38)
    optimizer, people = optimizer_and_population(exploding)
    guarded = {name: x.clone() for name, x in exploding.tensors(people.minds[0]).items()}
    for seed in range(3):
        people, learnt, replaced = trained(optimizer, people, seed)
        assert all(x.failures for x in learnt.values())
        assert replaced == []  # nobody is well
    for name in ("weights", "mean", "square", "updates", *(["target"] if learner is DQN else [])):
        assert (exploding.tensors(people.minds[0])[name] == guarded[name]).all(), name
