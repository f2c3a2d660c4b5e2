"""The learners in one batch of torch products do what the compiled ones do, up to rounding."""

from dataclasses import asdict, replace

import numpy as np
import pytest
import torch

from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.learner.stacked_ppo import StackedPpo
from berteam_cli.workers import Workers
from tests.learner import test_dqn, test_ppo

DEVICES = ["cpu", pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA"))]
LENGTHS, TERMINATED = [100, 90, 120], [True, False, True]
PPO = replace(test_ppo.SMALL, n_steps=128, minibatch_size=64, n_epochs=3)
DQN = replace(test_dqn.SMALL, target_update_interval=120, batch_size=16)
SETTINGS = [
    PPO,
    replace(PPO, activation="relu", clip_range_vf=0.1, entropy_coef=0.02),
    replace(PPO, target_kl=0.002, learning_rate=3e-3),
    replace(PPO, normalize_advantage=False, network=(16,), max_grad_norm=1e-3),
    DQN,
    replace(DQN, tau=0.3, activation="tanh", gradient_steps=-1),
    replace(DQN, n_steps=4, max_grad_norm=0.05),
    replace(DQN, tau=0.05, target_update_interval=1),
]


def stacked(learner, device):
    kind = StackedPpo if hasattr(learner, "n_epochs") else StackedDqn
    return kind(**asdict(learner), device=device)


def grown(learner, members):
    made = (test_ppo if hasattr(learner, "n_epochs") else test_dqn).grown(learner, members)
    made.trained.updates[:] = np.arange(members)  # members of different ages learn beside each other
    return made


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("learner", SETTINGS, ids=range(len(SETTINGS)))
def test_the_same_as_compiled(learner, device, random_games):
    batched, ours = stacked(learner, device), grown(learner, 4)
    theirs = batched.restored({name: x.clone() for name, x in learner.tensors(ours).items()})
    before = ours.trained.weights.copy()
    for epoch in range(3):
        games = random_games([[7, 5, 6, 6], [9, 9, 5, 6], [6, 5, 8, 9]], LENGTHS, TERMINATED, seed=epoch)
        one = learner.learn(ours, games, 5, np.random.default_rng(epoch), Workers(1))
        two = batched.learn(theirs, games, 5, np.random.default_rng(epoch), Workers(1))
        assert [x.row for x in one] == [x.row for x in two]
        for a, b in zip(one, two, strict=True):
            for name, value in asdict(a).items():
                assert getattr(b, name) == pytest.approx(value, abs=2e-4, rel=1e-4, nan_ok=True), name
    assert np.abs(ours.trained.weights - before).max() > 1e-3
    for name, tensor in learner.tensors(ours).items():
        np.testing.assert_allclose(batched.tensors(theirs)[name].cpu(), tensor, atol=2e-5, err_msg=name)
    for explore in (True, False):
        for a, b in zip(
            learner.policies(ours, explore=explore), batched.policies(theirs, explore=explore), strict=True
        ):
            np.testing.assert_allclose(a, b, atol=1e-5)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("learner", [PPO, DQN], ids=["ppo", "dqn"])
def test_begins_copies_and_goes_on_as_compiled(learner, device, random_games):
    batched = stacked(learner, device)
    ours, theirs = learner.init(3, np.random.default_rng(2)), batched.init(3, np.random.default_rng(2))
    games = random_games([[0, 1, 2, 1]] * 2, [60, 41], [True, False])
    for one, state in ((learner, ours), (batched, theirs)):
        one.learn(state, games, 0, np.random.default_rng(0), Workers(1))
        one.copy(state, 2, 1)
    for name, tensor in learner.tensors(ours).items():
        np.testing.assert_allclose(batched.tensors(theirs)[name].cpu(), tensor, atol=2e-5, err_msg=name)
    again = batched.restored({name: x.clone() for name, x in batched.tensors(theirs).items()})
    for state in (theirs, again):
        batched.learn(state, games, 0, np.random.default_rng(1), Workers(1))
    for name, tensor in batched.tensors(theirs).items():
        assert torch.equal(tensor, batched.tensors(again)[name]), name


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("learner", [PPO, DQN], ids=["ppo", "dqn"])
def test_what_is_not_finite_is_undone_and_hurts_nobody_else(learner, device, random_games):
    batched = stacked(learner, device)
    state = batched.init(3, np.random.default_rng(2))
    state.trained.weights[1] = 3e38
    before = state.trained.weights.clone()
    games = random_games([[0, 1, 2, 1]] * 2, [80, 61], [True, False])
    learnt = batched.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    assert [x.failures > 0 for x in learnt] == [False, True, False]
    assert [x.updates > 0 for x in learnt] == [True, False, True]
    assert torch.isfinite(state.trained.weights).all()
    assert torch.equal(state.trained.weights[1], before[1])


def test_nobody_played(random_games):
    for learner in (PPO, DQN):
        batched = stacked(learner, "cpu")
        games = random_games([[9, 9]], [10], [True])
        assert (
            batched.learn(batched.init(2, np.random.default_rng(0)), games, 0, np.random.default_rng(0), Workers(1))
            == []
        )
