from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN

from berteam_cli.acting import GREEDY, act
from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.temporal import schedule
from berteam_cli.outcomes import Experience
from berteam_cli.workers import Workers

ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}
SMALL = Dqn(
    observation_size=9,
    actions=5,
    network=(16, 12),
    activation="relu",
    learning_rate=1e-3,
    buffer_size=150,
    batch_size=8,
    gamma=0.9,
    n_steps=1,
    train_freq=4,
    gradient_steps=1,
    learning_starts=20,
    target_update_interval=50,
    tau=1.0,
    exploration_initial=1.0,
    exploration_final=0.1,
    exploration_steps=200,
    max_grad_norm=10.0,
)


def grown(dqn, members, seed=1):
    """A state whose networks say something and whose targets are others."""
    rng = np.random.default_rng(seed)
    state = dqn.init(members, rng)
    state.target[:] += 0.2 * rng.standard_normal(state.target.shape, dtype=np.float32)
    return state


@pytest.fixture
def twin(sb3_model, load):
    """A function that returns Stable-Baselines3's DQN with the settings and the weights of one of our members."""

    def built(dqn, weights, target):
        model = sb3_model(
            DQN,
            learning_rate=dqn.learning_rate,
            buffer_size=dqn.buffer_size,
            batch_size=dqn.batch_size,
            gamma=dqn.gamma,
            n_steps=dqn.n_steps,
            tau=dqn.tau,
            target_update_interval=dqn.target_update_interval,
            max_grad_norm=dqn.max_grad_norm,
            policy_kwargs={"net_arch": list(dqn.network), "activation_fn": ACTIVATIONS[dqn.activation]},
        )
        load(weights, dqn.sizes, model.q_net)
        load(target, dqn.sizes, model.q_net_target)
        return model

    return built


def remember(model, experience, trajectories):
    """Fills the model's replay buffer as OffPolicyAlgorithm does with one environment."""
    for game, player in trajectories:
        length = experience.lengths[game]
        for t in range(length):
            seen = experience.observations[game, player]
            done = np.array([t == length - 1])
            late = bool(done[0] and not experience.terminated[game])
            action, reward = experience.actions[game, player, t : t + 1], experience.rewards[game, player, t : t + 1]
            model.replay_buffer.add(
                seen[t][None], seen[t + 1][None], action, reward, done, [{"TimeLimit.truncated": late}]
            )


def sampler(model, batches, q_values):
    """A replacement of ReplayBuffer.sample that takes these batches, and notes the mean Q of their actions."""
    left = iter(batches)

    def sample(batch_size, env):
        data = model.replay_buffer._get_samples(next(left), env)
        q_values.append(model.q_net(data.observations).gather(1, data.actions.long()).mean().item())
        return data

    return sample


@pytest.mark.parametrize(
    ("network", "scale", "changes"),
    [
        ((64, 64), 1.0, {}),
        ((96, 96), 1.0, {"max_grad_norm": 0.05}),
        ((16,), 4.0, {}),
        ((16, 12), 1.0, {"tau": 0.3, "activation": "tanh"}),
        ((16, 12), 1.0, {"n_steps": 4}),
        ((16,), 1.0, {"n_steps": 3, "buffer_size": 400}),
        ((16,), 1.0, {"tau": 0.05, "target_update_interval": 1}),
    ],
)
def test_gradient_steps_are_those_of_stable_baselines(twin, flat, random_games, monkeypatch, network, scale, changes):
    dqn = replace(SMALL, network=network, buffer_size=600, batch_size=32)
    dqn = replace(dqn, learning_starts=100, **({"target_update_interval": 200} | changes))
    state = grown(dqn, 2)
    games = random_games([[4, 8, 3, 5]] * 5, [120, 80, 100, 99, 103], [True, False, True, False, True])
    games.rewards[:] *= scale
    models = [twin(dqn, *each) for each in zip(state.trained.weights, state.target, strict=True)]
    before = state.trained.weights.copy()
    figures = dqn.learn(state, games, 4, np.random.default_rng(3), Workers(2))

    for row, (model, rng) in enumerate(zip(models, np.random.default_rng(3).spawn(2), strict=True)):
        remember(model, games, [(game, (0, 3)[row]) for game in range(5)])
        q_values = []
        drawn = sampler(model, rng.integers(0, min(502, dqn.buffer_size), (100, 32)), q_values)
        monkeypatch.setattr(model.replay_buffer, "sample", drawn)
        losses = []
        for t in range(1, 503):
            model._on_step()
            if t > 100 and t % 4 == 0:
                model.train(1, 32)
                losses.append(model.logger.name_to_value["train/loss"])
        assert len(losses) == 100
        np.testing.assert_allclose(state.trained.weights[row], flat(model.q_net), atol=1e-5)
        np.testing.assert_allclose(state.target[row], flat(model.q_net_target), atol=1e-5)
        assert np.abs(state.trained.weights[row] - before[row]).max() > 10 * 1e-5
        ours = figures[row]
        assert (ours.row, ours.updates, ours.steps) == (row, 100, 502)
        assert ours.loss == pytest.approx(np.mean(losses), abs=1e-5)
        assert ours.q_value == pytest.approx(np.mean(q_values), abs=1e-5)


def test_the_buffer_holds_the_newest_steps(random_games):
    state = SMALL.init(1, np.random.default_rng(0))
    games = random_games([[0], [0]], [100, 90], [True, False])
    SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    seen = np.concatenate([games.observations[0, 0, 40:100], games.observations[1, 0, :90]])  # steps 40 to 189
    after = np.concatenate([games.observations[0, 0, 41:101], games.observations[1, 0, 1:91]])
    rewards = np.concatenate([games.rewards[0, 0, 40:100], games.rewards[1, 0, :90]])
    at = np.arange(40, 190) % 150
    np.testing.assert_array_equal(state.replay.observations[0, at], seen)
    np.testing.assert_array_equal(state.replay.next_observations[0, at], after)
    np.testing.assert_array_equal(state.replay.rewards[0, at], rewards)
    assert state.replay.terminated[0].nonzero()[0].tolist() == [99]  # the second game ran out of time


def test_of_a_game_longer_than_the_buffer_the_last_steps_stay(random_games):
    state = SMALL.init(1, np.random.default_rng(0))
    games = random_games([[0]], [400], [True])
    SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    at = np.arange(250, 400) % 150
    np.testing.assert_array_equal(state.replay.actions[0, at], games.actions[0, 0, 250:])
    assert state.replay.terminated[0, 399 % 150]


def test_schedule_by_hand():
    # Learning at 24, 28, ..., 48, a target at 30 and one at 45, and one at 50 after the last learning.
    count, renewals = schedule(10, 50, 4, 1, 20, 15)
    assert count == 7
    assert renewals.tolist() == [1, 0, 1, 0, 0, 0, 1, 0]
    count, renewals = schedule(46, 51, 4, 3, 20, 50)
    assert count == 3  # at 48, three times
    assert renewals.tolist() == [0, 0, 0, 1]
    assert schedule(16, 27, 4, 1, 0, 2)[1].tolist() == [2, 2, 1]  # at 18 and 20, then 22 and 24, then 26
    assert schedule(0, 20, 4, 1, 20, 100)[0] == 0  # not before more than learning_starts steps
    assert schedule(0, 23, 4, 1, 20, 100)[0] == 0
    assert schedule(0, 24, 4, 1, 20, 100)[0] == 1


def test_one_gradient_step_for_four_steps_whatever_the_games_are(random_games):
    dqn = replace(SMALL, learning_starts=0)
    state = dqn.init(2, np.random.default_rng(0))
    lengths = [7, 13, 3, 30, 2]
    for epoch, length in enumerate(lengths):
        games = random_games([[1, 1]], [length], [True], seed=epoch)
        dqn.learn(state, games, 0, np.random.default_rng(epoch), Workers(1))
    assert state.collected.tolist() == [0, 2 * sum(lengths)]
    assert state.trained.updates.tolist() == [0, 2 * sum(lengths) // 4]


def test_the_target_is_renewed_at_the_interval_and_not_before(random_games):
    state = SMALL.init(1, np.random.default_rng(0))
    first = state.target.copy()
    SMALL.learn(state, random_games([[0]], [49], [True]), 0, np.random.default_rng(0), Workers(1))
    np.testing.assert_array_equal(state.target, first)
    assert not np.array_equal(state.trained.weights, first)
    SMALL.learn(state, random_games([[0]], [1], [True]), 0, np.random.default_rng(0), Workers(1))
    np.testing.assert_array_equal(state.target, state.trained.weights)


def test_exploration_falls_with_the_members_own_steps(random_games):
    state = SMALL.init(3, np.random.default_rng(0))
    assert SMALL.policies(state, explore=True).epsilon.tolist() == [1.0, 1.0, 1.0]
    (figure,) = SMALL.learn(state, random_games([[1]], [50], [True]), 0, np.random.default_rng(0), Workers(1))
    np.testing.assert_allclose(SMALL.policies(state, explore=True).epsilon, [1.0, 1.0 - 0.9 / 4, 1.0])
    assert figure.epsilon == pytest.approx(1.0 - 0.9 / 4)
    SMALL.learn(state, random_games([[1, 1]], [100], [True]), 0, np.random.default_rng(0), Workers(1))
    np.testing.assert_allclose(SMALL.policies(state, explore=True).epsilon, [1.0, 0.1, 1.0])
    assert SMALL.policies(state, explore=False).epsilon.tolist() == [0.0, 0.0, 0.0]


def test_members_act_as_the_network_of_stable_baselines(twin):
    dqn = replace(SMALL, network=(64, 64))
    state = grown(dqn, 2)
    policies = dqn.policies(state, explore=False)
    assert policies.kind.tolist() == [GREEDY, GREEDY]
    work = np.empty(2 * policies.sizes.max(), dtype=np.float32)
    observations = np.random.default_rng(0).standard_normal((200, 9), dtype=np.float32)
    for k in range(2):
        model = twin(dqn, state.trained.weights[k], state.target[k])
        theirs = model.q_net(torch.tensor(observations)).argmax(1).tolist()
        assert [act(policies, k, each, work, 0.0, 0.5) for each in observations] == theirs
        assert len(set(theirs)) > 1


def test_begins_as_torch_does():
    (matrix, bias) = SMALL.init(50, np.random.default_rng(0)).trained.weights[:, : 9 * 16], 1 / 3
    assert np.abs(matrix).max() <= bias
    assert matrix.std() == pytest.approx(bias / np.sqrt(3), rel=0.02)
    state = SMALL.init(2, np.random.default_rng(0))
    np.testing.assert_array_equal(state.target, state.trained.weights)
    assert not np.shares_memory(state.target, state.trained.weights)


def test_the_same_bytes_for_any_number_of_workers(random_games):
    games = random_games(np.arange(40).reshape(4, 10) % 11, [30, 70, 45, 64], [True, False, True, True])
    results = []
    for count in (1, 2, 3):
        state = grown(SMALL, 11)
        figures = []
        for epoch in range(3):
            figures += SMALL.learn(state, games, 0, np.random.default_rng(epoch), Workers(count))
        results.append((repr(figures), {n: t.numpy().tobytes() for n, t in SMALL.tensors(state).items()}))
    assert results[0] == results[1] == results[2]


def test_what_a_member_learns_does_not_depend_on_the_others(random_games):
    everybody = random_games([[0, 1, 2, 1]] * 2, [60, 41], [True, False])
    one = replace(everybody, members=np.where(everybody.members == 1, 1, 9))
    states = grown(SMALL, 3), grown(SMALL, 3)
    for state, games in zip(states, (everybody, one), strict=True):
        SMALL.learn(state, games, 0, np.random.default_rng(5), Workers(2))
    for name, tensor in SMALL.tensors(states[0]).items():
        assert torch.equal(tensor[1], SMALL.tensors(states[1])[name][1]), name


def test_a_restored_state_goes_on_to_the_same_bytes(random_games):
    games = random_games([[0, 1, 2, 2]] * 2, [30, 41], [True, False])
    state = grown(SMALL, 3)
    SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    again = SMALL.restored({name: tensor.clone() for name, tensor in SMALL.tensors(state).items()})
    for each in (state, again):
        SMALL.learn(each, games, 0, np.random.default_rng(1), Workers(1))
    for name, tensor in SMALL.tensors(state).items():
        assert torch.equal(tensor, SMALL.tensors(again)[name]), name


def test_a_copy_remembers_all_that_its_parent_does(random_games):
    games = random_games([[0, 1, 2, 1]] * 2, [60, 41], [True, False])
    state = grown(SMALL, 3)
    SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    before = {name: tensor.clone() for name, tensor in SMALL.tensors(state).items()}
    SMALL.copy(state, 2, 1)
    for name, tensor in SMALL.tensors(state).items():
        assert torch.equal(tensor[2], before[name][1]), name
        assert torch.equal(tensor[:2], before[name][:2]), name
        assert not torch.equal(before[name][2], before[name][1]), name
    np.testing.assert_array_equal(
        SMALL.policies(state, explore=True).epsilon[2], SMALL.policies(state, explore=True).epsilon[1]
    )


def test_learns_which_action_is_rewarded():
    dqn = replace(SMALL, learning_rate=1e-2, buffer_size=1000)
    state = dqn.init(2, np.random.default_rng(0))
    observations = np.ones((1, 2, 401, 9), dtype=np.float32)
    actions = np.random.default_rng(1).integers(0, 5, (1, 2, 400)).astype(np.int16)
    rewards = (actions == np.array([3, 1])[:, np.newaxis]).astype(np.float32)
    games = Experience(np.array([[0, 1]]), observations, actions, rewards, np.array([400]), np.array([True]))
    for epoch in range(3):
        dqn.learn(state, games, 0, np.random.default_rng(epoch), Workers(1))
    policies = dqn.policies(state, explore=False)
    work = np.empty(2 * policies.sizes.max(), dtype=np.float32)
    assert [act(policies, k, observations[0, 0, 0], work, 0.0, 0.5) for k in range(2)] == [3, 1]
