"""A member goes on in Stable-Baselines3 as it would have gone on here."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from gymnasium.spaces import Box, Discrete
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.logger import configure

from berteam_cli.acting import act
from berteam_cli.learner.exporting import exported
from berteam_cli.learner.fixed import Fixed
from berteam_cli.learner.mlp import weight_count
from berteam_cli.learner.ppo import outputs
from berteam_cli.workers import Workers
from tests.learner import test_dqn, test_ppo
from tests.learner.conftest import ACTIONS, OBSERVATION

SPACE = Box(-1, 1, (OBSERVATION,), np.float32)
ROW = 1


@pytest.fixture
def loaded(tmp_path):
    """A function that exports and saves a member, and returns it as loaded without an environment."""

    def back(kind, learner, state):
        exported(learner, state, ROW, SPACE).save(tmp_path / "member.zip")
        model = kind.load(tmp_path / "member.zip", device="cpu")
        model.set_logger(configure(None, []))
        return model

    return back


def observations(count=50):
    return np.random.default_rng(9).uniform(-1, 1, (count, OBSERVATION)).astype(np.float32)


def taught_ppo(random_games, **changes):
    """PPO and a state whose members have learnt twice, from 100 steps each."""
    ppo = replace(test_ppo.SMALL, **changes)
    state = test_ppo.grown(ppo, 3)
    ppo.learn(state, random_games([[0, 1, 2, 9]], [100], [True]), 0, np.random.default_rng(2), Workers(1))
    return ppo, state


def taught_dqn(games):
    dqn = replace(test_dqn.SMALL, buffer_size=600)
    state = test_dqn.grown(dqn, 3)
    dqn.learn(state, games, 0, np.random.default_rng(2), Workers(1))
    return dqn, state


def test_ppo_has_the_same_chances_of_actions_and_the_same_values(loaded, random_games):
    ppo, state = taught_ppo(random_games)
    model, seen = loaded(PPO, ppo, state), observations()
    cut = weight_count(np.array(ppo.policy_sizes))
    weights = state.trained.weights[ROW]
    with torch.no_grad():
        chances = model.policy.get_distribution(torch.from_numpy(seen)).distribution.probs
        values = model.policy.predict_values(torch.from_numpy(seen))
    logits = torch.from_numpy(outputs(weights[:cut], ppo.policy_sizes, ppo.smooth, seen).copy())
    np.testing.assert_allclose(chances, logits.softmax(dim=1), atol=1e-6)
    np.testing.assert_allclose(values, outputs(weights[cut:], ppo.value_sizes, ppo.smooth, seen), atol=1e-5)
    assert (model.observation_space, model.action_space) == (SPACE, Discrete(ACTIONS))


def test_ppo_keeps_its_settings_and_counts(loaded, random_games):
    ppo, state = taught_ppo(random_games, clip_range=0.13, learning_rate=2e-3)
    ppo.learn(state, random_games([[ROW]], [20], [True]), 0, np.random.default_rng(2), Workers(1))
    model = loaded(PPO, ppo, state)
    assert (model.n_steps, model.batch_size, model.n_epochs) == (50, 16, 2)
    assert (model.gamma, model.gae_lambda, model.ent_coef, model.vf_coef) == (0.9, 0.8, 0.01, 0.5)
    assert (model.max_grad_norm, model.normalize_advantage) == (0.5, True)
    assert (model.clip_range(1.0), model.lr_schedule(0.3)) == (0.13, 2e-3)
    assert (model.num_timesteps, model._n_updates) == (120, 4)
    assert model.policy.net_arch == [16, 12]


def test_ppo_goes_on_learning_the_same(loaded, flat, random_games, monkeypatch):
    ppo, state = taught_ppo(random_games)
    model = loaded(PPO, ppo, state)
    games = random_games([[ROW]], [50], [True], seed=4)
    before = state.trained.weights[ROW].copy()
    ppo.learn(state, games, 0, np.random.default_rng(5), Workers(1))
    test_ppo.collect(model, games, [(0, 0)])
    monkeypatch.setattr(np.random, "permutation", np.random.default_rng(5).spawn(3)[ROW].permutation)
    model.train()
    theirs = np.concatenate([flat(*modules) for _, modules in test_ppo.parts(ppo, model)])
    np.testing.assert_allclose(state.trained.weights[ROW], theirs, atol=1e-5)
    assert np.abs(theirs - before).max() > 10 * 1e-5


def test_dqn_takes_the_same_greedy_actions(loaded, random_games):
    dqn, state = taught_dqn(random_games([[0, 1, 2, 9]], [100], [True]))
    model, seen = loaded(DQN, dqn, state), observations()
    policies = dqn.policies(state, explore=False)
    work = np.zeros(2 * policies.sizes.max(), dtype=np.float32)
    ours = [act(policies, ROW, each, work, 0.5, 0.5) for each in seen]
    theirs, _ = model.predict(seen, deterministic=True)
    assert list(theirs) == ours
    assert len(set(ours)) > 1


def test_dqn_keeps_its_target_its_settings_and_counts(loaded, flat, random_games):
    dqn, state = taught_dqn(random_games([[0, 1, 2, 9]], [70], [True]))
    model = loaded(DQN, dqn, state)
    np.testing.assert_array_equal(flat(model.q_net_target), state.target[ROW])
    np.testing.assert_array_equal(flat(model.q_net), state.trained.weights[ROW])
    assert (model.buffer_size, model.learning_starts, model.batch_size, model.gamma) == (600, 20, 8, 0.9)
    assert (model.train_freq.frequency, model.gradient_steps, model.target_update_interval) == (4, 1, 50)
    assert (model.exploration_initial_eps, model.exploration_final_eps) == (1.0, 0.1)
    assert (model.max_grad_norm, model.lr_schedule(0.3)) == (10.0, 1e-3)
    assert (model.num_timesteps, model._n_updates) == (70, 12)
    assert model.exploration_rate == pytest.approx(dqn.epsilon(np.array([70]))[0])


def test_dqn_goes_on_learning_the_same(loaded, flat, random_games, monkeypatch):
    first, second = random_games([[ROW]], [70], [True]), random_games([[ROW]], [60], [False], seed=4)
    dqn, state = taught_dqn(first)
    model = loaded(DQN, dqn, state)
    before = state.trained.weights[ROW].copy()
    dqn.learn(state, second, 0, np.random.default_rng(5), Workers(1))
    for games in (first, second):
        test_dqn.remember(model, games, [(0, 0)])
    steps = [t for t in range(71, 131) if t % 4 == 0]
    drawn = np.random.default_rng(5).spawn(3)[ROW].integers(0, 130, (len(steps), 8))
    monkeypatch.setattr(model.replay_buffer, "sample", test_dqn.sampler(model, drawn, []))
    for t in range(71, 131):
        model._on_step()
        if t in steps:
            model.train(1, 8)
    np.testing.assert_allclose(state.trained.weights[ROW], flat(model.q_net), atol=1e-5)
    np.testing.assert_allclose(state.target[ROW], flat(model.q_net_target), atol=1e-5)
    assert np.abs(state.trained.weights[ROW] - before).max() > 10 * 1e-5


def test_who_has_not_learnt_has_no_moments(loaded):
    ppo = test_ppo.SMALL
    model = loaded(PPO, ppo, test_ppo.grown(ppo, 3))
    assert model.policy.optimizer.state_dict()["state"] == {}
    assert model.num_timesteps == 0


def test_the_model_is_apart_from_the_member(random_games):
    ppo, state = taught_ppo(random_games)
    before = state.trained.weights.copy()
    model = exported(ppo, state, ROW, SPACE)
    with torch.no_grad():
        for parameter in model.policy.parameters():
            parameter.zero_()
    np.testing.assert_array_equal(state.trained.weights, before)


def test_fixed_policies_have_no_network():
    fixed = Fixed(indices=(0, 1), policies_by_name=("a", "b"))
    with pytest.raises(
        ValueError, match="its learner is fixed, and only members of ppo, dqn, A2C, DQN, PPO, QRDQN, TRPO can be"
    ):
        exported(fixed, fixed.init(2, np.random.default_rng(0)), 1, SPACE)
