import random
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
import torch

from berteam_cli.acting import GREEDY, SAMPLED, act
from berteam_cli.learner.dqn import Dqn
from berteam_cli.learner.mlp import weight_count
from berteam_cli.learner.ppo import Ppo
from berteam_cli.learner.sb3 import Sb3, acting_layers
from berteam_cli.learner.temporal import schedule
from berteam_cli.outcomes import Experience
from berteam_cli.workers import Workers
from tests.learner.conftest import ACTIONS, OBSERVATION

ONE = Workers(1)
ACTORS = {
    "A2C": {"n_steps": 40, "learning_rate": 1e-3, "gamma": 0.9, "gae_lambda": 0.8, "ent_coef": 0.01},
    "PPO": {"n_steps": 40, "batch_size": 10, "n_epochs": 3, "learning_rate": 1e-3, "ent_coef": 0.01},
    "TRPO": {"n_steps": 40, "batch_size": 10, "n_critic_updates": 3},
}
VALUERS = {
    "DQN": {"buffer_size": 150, "learning_starts": 20, "target_update_interval": 50, "learning_rate": 1e-3},
    "QRDQN": {"buffer_size": 150, "learning_starts": 20, "target_update_interval": 50, "batch_size": 4},
}
EVERY = ACTORS | VALUERS


def learner(algorithm, activation=None, **options):
    return Sb3(OBSERVATION, ACTIONS, (16, 12), algorithm, activation, 400, EVERY[algorithm] | options)


def grown(sb3, members=1, seed=1):
    """A state whose networks are far from those of the beginning."""
    state = sb3.init(members, np.random.default_rng(seed))
    generator = torch.Generator().manual_seed(seed)
    for model in state:
        for weights in model.policy.parameters():
            weights.data += 0.2 * torch.randn(weights.shape, generator=generator)
    return state


def weights_of(model):
    return torch.cat([each.flatten() for each in model.policy.state_dict().values()]).numpy()


def bytes_of(sb3, state):
    return {name: (tuple(x.shape), x.numpy().tobytes()) for name, x in sb3.tensors(state).items()}


def part(games, epoch):
    """The games of ``epoch``, a slice."""
    columns = (games.members, games.observations, games.actions, games.rewards, games.lengths, games.terminated)
    return Experience(*(column[epoch] for column in columns))


class Scripted(gymnasium.Env):
    """Shows and pays what the games say, whatever is done, and writes down what was."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (OBSERVATION,), dtype=np.float32)
    action_space = gymnasium.spaces.Discrete(ACTIONS)

    def __init__(self, games):
        self.games, self.game, self.t = games, -1, 0

    def reset(self, *, seed=None, options=None):
        self.game, self.t = (self.game + 1) % len(self.games.lengths), 0
        return self.games.observations[self.game, 0, 0], {}

    def step(self, action):
        games, game = self.games, self.game
        games.actions[game, 0, self.t] = action
        reward = games.rewards[game, 0, self.t]
        self.t += 1
        over = self.t == games.lengths[game]
        ends = over and games.terminated[game]
        return games.observations[game, 0, self.t], reward, bool(ends), bool(over and not ends), {}


def their_own_loop(sb3, state, games, steps):
    """Stable-Baselines3's own loop from the weights of our member, in the games; their actions are written down."""
    (model,) = sb3.restored({name: tensor.clone() for name, tensor in sb3.tensors(state).items()})
    model.set_env(Scripted(games))
    model.learn(steps)
    return model


@pytest.mark.parametrize("algorithm", ACTORS)
def test_actors_learn_as_in_their_own_loop(algorithm, random_games, monkeypatch):
    # The second update cuts the last game off after 10 of its 30 steps; with the next its weights would be others.
    sb3 = learner(algorithm)
    state = grown(sb3)
    games = random_games([[0]] * 4, [25, 15, 30, 30], [True, False, False, True])
    monkeypatch.setattr(np.random, "permutation", np.random.default_rng(7).permutation)
    theirs = their_own_loop(sb3, state, games, 80)
    monkeypatch.setattr(np.random, "permutation", np.random.default_rng(7).permutation)
    before, figures = weights_of(state[0]), []
    for epoch in (slice(0, 2), slice(2, 4)):
        figures += sb3.learn(state, part(games, epoch), 0, np.random.default_rng(0), ONE)
    np.testing.assert_allclose(weights_of(state[0]), weights_of(theirs), atol=1e-5)
    assert np.abs(weights_of(state[0]) - before).max() > 1e-3
    assert state[0].rollout_buffer.pos == 20
    assert state[0].num_timesteps == 100
    assert [each.steps for each in figures] == [40, 60]

    log = theirs.logger.name_to_value
    assert figures[1].value_loss == pytest.approx(log["train/value_loss"], rel=1e-4)
    if algorithm == "TRPO":
        assert figures[1].policy_loss == pytest.approx(-log["train/policy_objective"], abs=1e-5)
        assert figures[1].approx_kl == pytest.approx(log["train/kl_divergence_loss"], abs=1e-5)
        assert np.isnan(figures[1].loss)
        assert figures[1].updates == 3 * 4
        return
    assert figures[1].updates == {"A2C": 1, "PPO": 3 * 4}[algorithm]
    policy_loss = log["train/policy_loss" if algorithm == "A2C" else "train/policy_gradient_loss"]
    assert figures[1].policy_loss == pytest.approx(policy_loss, abs=1e-5)
    assert figures[1].entropy == pytest.approx(-log["train/entropy_loss"], abs=1e-5)
    total = policy_loss + 0.01 * log["train/entropy_loss"] + 0.5 * log["train/value_loss"]
    assert figures[1].loss == pytest.approx(total, rel=1e-4)
    if algorithm == "PPO":
        assert figures[1].approx_kl == pytest.approx(log["train/approx_kl"], abs=1e-5)
        assert figures[1].clip_fraction == pytest.approx(log["train/clip_fraction"], abs=1e-5)


@pytest.mark.parametrize(
    ("algorithm", "options"),
    [
        ("DQN", {}),
        ("DQN", {"gradient_steps": -1, "train_freq": 5, "tau": 0.5}),
        ("DQN", {"n_steps": 3, "learning_starts": 0}),
        ("QRDQN", {"gradient_steps": 2, "learning_rate": 1e-3}),
    ],
)
def test_valuers_learn_as_in_their_own_loop(algorithm, options, random_games, monkeypatch):
    sb3 = learner(algorithm, **options)
    state = grown(sb3)
    games = random_games([[0]] * 5, [60, 45, 100, 30, 65], [True, False, False, True, False])
    monkeypatch.setattr(np.random, "randint", np.random.default_rng(7).integers)
    sb3 = replace(sb3, schedule_steps=300)
    theirs = their_own_loop(sb3, state, games, 300)
    monkeypatch.setattr(np.random, "randint", np.random.default_rng(7).integers)
    before, figures = weights_of(state[0]), []
    for epoch in (slice(0, 2), slice(2, 3), slice(3, 5)):
        figures += sb3.learn(state, part(games, epoch), 0, np.random.default_rng(0), ONE)
    np.testing.assert_allclose(weights_of(state[0]), weights_of(theirs), atol=1e-5)
    assert np.abs(weights_of(state[0]) - before).max() > 1e-3
    assert sum(each.updates for each in figures) == theirs._n_updates > 60
    assert [each.steps for each in figures] == [105, 100, 95]
    assert figures[-1].epsilon == pytest.approx(theirs.exploration_rate)
    for name in ("observations", "next_observations", "actions", "rewards", "dones", "timeouts"):
        ours, other = getattr(state[0].replay_buffer, name), getattr(theirs.replay_buffer, name)
        np.testing.assert_array_equal(ours, other)


def test_ppo_is_the_learner_ppo(random_games, load, flat, monkeypatch):
    settings = {"n_steps": 60, "n_epochs": 3, "learning_rate": 1e-3, "gamma": 0.9, "gae_lambda": 0.8, "clip_range": 0.2}
    settings |= {"max_grad_norm": 0.5, "normalize_advantage": True}
    own = Ppo(
        OBSERVATION,
        ACTIONS,
        (16, 12),
        "tanh",
        clip_range_vf=None,
        target_kl=None,
        minibatch_size=20,
        entropy_coef=0.01,
        value_coef=0.5,
        **settings,
    )
    mind = own.init(1, np.random.default_rng(0))
    mind.trained.weights[:] += 0.2 * np.random.default_rng(1).standard_normal(mind.trained.weights.shape)
    sb3 = Sb3(OBSERVATION, ACTIONS, (16, 12), "PPO", None, 400, settings | {"batch_size": 20, "ent_coef": 0.01})
    state = sb3.init(1, np.random.default_rng(0))
    policy = state[0].policy
    cut = weight_count(np.array(own.policy_sizes))
    actor = (policy.mlp_extractor.policy_net, policy.action_net)
    critic = (policy.mlp_extractor.value_net, policy.value_net)
    load(mind.trained.weights[0, :cut], own.policy_sizes, *actor)
    load(mind.trained.weights[0, cut:], own.value_sizes, *critic)
    before = mind.trained.weights.copy()

    for epoch in range(3):
        games = random_games([[5, 9]] * 2, [47, 38], [True, False], seed=epoch)
        ours = own.learn(mind, games, 5, np.random.default_rng(epoch), ONE)
        (alone,) = np.random.default_rng(epoch).spawn(1)
        monkeypatch.setattr(np.random, "permutation", alone.permutation)
        theirs = sb3.learn(state, games, 5, np.random.default_rng(epoch), ONE)
        weights = np.concatenate([flat(*actor), flat(*critic)])
        np.testing.assert_allclose(weights, mind.trained.weights[0], atol=1e-5)
        assert [(x.row, x.updates, x.steps) for x in ours] == [(x.row, x.updates, x.steps) for x in theirs]
        for figure in ("loss", "policy_loss", "value_loss", "entropy", "approx_kl"):
            assert getattr(theirs[0], figure) == pytest.approx(getattr(ours[0], figure), abs=1e-4), figure
    assert mind.trained.updates.tolist() == [4 * 3 * 3]  # 255 steps
    assert np.abs(mind.trained.weights - before).max() > 1e-3


class Chosen:
    """Gives these batches in place of random ones."""

    def __init__(self, batches):
        self.batches = batches

    def spawn(self, count):
        return [self] * count

    def integers(self, low, high, size):
        assert np.shape(self.batches) == size
        return np.array(self.batches)


def test_dqn_is_the_learner_dqn(random_games, load, flat, monkeypatch):
    settings = {"learning_rate": 1e-3, "buffer_size": 600, "batch_size": 8, "gamma": 0.9, "train_freq": 4}
    settings |= {"gradient_steps": 1, "learning_starts": 20, "target_update_interval": 50, "max_grad_norm": 10.0}
    own = Dqn(
        OBSERVATION,
        ACTIONS,
        (16, 12),
        "relu",
        n_steps=1,
        tau=1.0,
        exploration_initial=1.0,
        exploration_final=0.1,
        exploration_steps=200,
        **settings,
    )
    mind = own.init(1, np.random.default_rng(0))
    options = settings | {"exploration_final_eps": 0.1, "exploration_fraction": 0.5}
    sb3 = Sb3(OBSERVATION, ACTIONS, (16, 12), "DQN", None, 400, options)
    state = sb3.init(1, np.random.default_rng(0))
    for net in (state[0].q_net, state[0].q_net_target):
        load(mind.trained.weights[0], own.sizes, net)
    before = mind.trained.weights.copy()

    rng, seen = np.random.default_rng(3), 0
    for epoch in range(4):
        games = random_games([[5, 9]] * 2, [47, 38], [True, False], seed=epoch)
        now = seen + 85
        times = [t for t in range(seen + 1, now + 1) if t > 20 and t % 4 == 0]
        assert len(times) == schedule(seen, now, 4, 1, 20, 50)[0]
        batches = [rng.integers(0, t, 8) for t in times]  # steps that were there when the game had come so far
        ours = own.learn(mind, games, 5, Chosen(batches), ONE)
        left = iter(batches)
        monkeypatch.setattr(np.random, "randint", lambda *_, size, left=left, **__: zeros_or(next, left, size))
        theirs = sb3.learn(state, games, 5, np.random.default_rng(0), ONE)
        np.testing.assert_allclose(flat(state[0].q_net), mind.trained.weights[0], atol=1e-5)
        np.testing.assert_allclose(flat(state[0].q_net_target), mind.target[0], atol=1e-5)
        assert [(x.row, x.updates, x.steps) for x in ours] == [(x.row, x.updates, x.steps) for x in theirs]
        assert theirs[0].loss == pytest.approx(ours[0].loss, abs=1e-4)
        assert theirs[0].epsilon == pytest.approx(ours[0].epsilon)
        seen = now
    assert np.abs(mind.trained.weights - before).max() > 1e-3


def zeros_or(draw, left, size):
    """Numbers of environments, of which there is one, are asked for with a shape; steps with their number."""
    return np.zeros(size, dtype=np.int64) if isinstance(size, tuple) else draw(left)


@pytest.mark.parametrize("activation", [None, "tanh", "relu"])
@pytest.mark.parametrize("algorithm", EVERY)
def test_members_act_as_the_policy_of_stable_baselines(algorithm, activation):
    sb3 = learner(algorithm, activation)
    state = grown(sb3, 2)
    policies = sb3.policies(state, explore=False)
    work = np.empty(2 * policies.sizes.max(), dtype=np.float32)
    observations = np.random.default_rng(0).standard_normal((100, OBSERVATION), dtype=np.float32)
    assert policies.tanh.tolist() == [activation == "tanh" or (activation is None and algorithm in ACTORS)] * 2
    for k, model in enumerate(state):
        if algorithm in VALUERS:
            theirs = model.predict(observations, deterministic=True)[0].tolist()
            assert [act(policies, k, each, work, 0.0, 0.5) for each in observations] == theirs
            assert len(set(theirs)) > 1
            assert policies.kind[k] == GREEDY
            continue
        assert policies.kind[k] == SAMPLED
        seen = torch.tensor(observations[:5])
        chances = model.policy.get_distribution(seen).distribution.probs.detach().numpy()
        for each, chance in zip(observations, chances, strict=False):
            draws = [act(policies, k, each, work, 0.0, (i + 0.5) / 1000) for i in range(1000)]
            np.testing.assert_allclose(np.bincount(draws, minlength=ACTIONS) / 1000, chance, atol=1 / 1000)
    assert chances.max() > 0.3 if algorithm in ACTORS else True


def test_the_mean_over_quantiles_is_in_the_last_layer():
    (model,) = grown(learner("QRDQN"))
    observations = np.random.default_rng(0).standard_normal((50, OBSERVATION), dtype=np.float32)
    *hidden, (matrix, bias) = acting_layers(model)
    values = observations
    for weights, shift in hidden:
        values = np.maximum(values @ weights + shift, 0.0)
    means = model.quantile_net(torch.tensor(observations)).mean(dim=1).detach().numpy()
    np.testing.assert_allclose(values @ matrix + bias, means, atol=1e-5)


def test_exploration_is_that_of_their_loop(random_games):
    # The first 20 steps are random; then the chance falls from 1 to 0.05 over 100 steps, a quarter of 400.
    sb3 = learner("DQN", exploration_fraction=0.25)
    state = grown(sb3, 3)
    for length, chance in ((10, 1.0), (15, 1.0 - 0.95 * 25 / 100), (75, 0.05), (500, 0.05)):
        (figure,) = sb3.learn(state, random_games([[1]], [length], [True]), 0, np.random.default_rng(0), ONE)
        assert figure.epsilon == pytest.approx(chance)
        np.testing.assert_allclose(sb3.policies(state, explore=True).epsilon, [1.0, chance, 1.0])
    assert sb3.policies(state, explore=False).epsilon.tolist() == [0.0, 0.0, 0.0]


def test_values_are_of_the_weights_that_acted(random_games):
    sb3 = learner("A2C", n_steps=40)
    state = grown(sb3)
    games = random_games([[0]], [60], [False])
    with torch.no_grad():
        values = state[0].policy.predict_values(torch.tensor(games.observations[0, 0])).numpy()
    sb3.learn(state, games, 0, np.random.default_rng(0), ONE)
    buffer = state[0].rollout_buffer
    assert buffer.pos == 20
    np.testing.assert_allclose(buffer.values[:20], values[40:60], atol=1e-6)
    late = games.rewards[0, 0, 59] + 0.9 * values[60, 0]  # the clock ended the game
    assert buffer.rewards[19, 0] == pytest.approx(late, abs=1e-6)
    assert buffer.episode_starts[:20].sum() == 0
    sb3.learn(state, random_games([[0]], [10], [True]), 0, np.random.default_rng(0), ONE)
    assert buffer.episode_starts[:30, 0].nonzero()[0].tolist() == [20]


@pytest.mark.parametrize("algorithm", EVERY)
def test_what_a_member_learns_does_not_depend_on_the_others_or_the_workers(algorithm, random_games):
    sb3 = learner(algorithm)
    everybody = random_games([[3, 4, 5, 4]] * 2, [60, 41], [True, False])
    one = replace(everybody, members=np.where(everybody.members == 4, 4, 9))
    states = [grown(sb3, 3) for _ in range(3)]
    figures = []
    for state, games, count in zip(states, (everybody, everybody, one), (1, 2, 1), strict=True):
        figures.append(sb3.learn(state, games, 3, np.random.default_rng(5), Workers(count)))
    assert bytes_of(sb3, states[0]) == bytes_of(sb3, states[1])
    assert repr(figures[0]) == repr(figures[1])
    assert repr(figures[0][1]) == repr(figures[2][0])
    assert figures[0][1].updates > 0
    assert figures[0][1].steps == 202
    assert bytes_of(sb3, states[0][1:2]) == bytes_of(sb3, states[2][1:2])
    assert bytes_of(sb3, states[0][:1]) != bytes_of(sb3, states[2][:1])


@pytest.mark.parametrize("algorithm", EVERY)
def test_a_restored_state_goes_on_to_the_same_bytes(algorithm, random_games):
    sb3 = learner(algorithm)
    games = random_games([[0, 1, 2, 2]] * 2, [33, 41], [True, False])
    state = grown(sb3, 4)  # the last does not play
    for epoch in range(2):
        sb3.learn(state, games, 0, np.random.default_rng(epoch), ONE)
    again = sb3.restored({name: tensor.clone() for name, tensor in sb3.tensors(state).items()})
    assert bytes_of(sb3, state) == bytes_of(sb3, again)
    figures = [sb3.learn(each, games, 0, np.random.default_rng(2), ONE) for each in (state, again)]
    assert bytes_of(sb3, state) == bytes_of(sb3, again)
    assert repr(figures[0]) == repr(figures[1])
    for one, other in zip(*(sb3.policies(each, explore=True) for each in (state, again)), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("algorithm", EVERY)
def test_a_copy_knows_what_its_parent_does(algorithm, random_games):
    sb3 = learner(algorithm)
    games = random_games([[0, 1, 2, 1]] * 2, [60, 41], [True, False])
    state = grown(sb3, 3)
    sb3.learn(state, games, 0, np.random.default_rng(0), ONE)
    before = bytes_of(sb3, state)
    sb3.copy(state, 2, 1)
    after = bytes_of(sb3, state)
    for name, held in after.items():
        row, what = name.split(".", maxsplit=1)
        if row == "2" and algorithm in ACTORS and (what.startswith("buffer.") or what == "counter.position"):
            assert held[0][:1] == (0,) or not int.from_bytes(held[1], "little"), name
        else:
            assert held == before[f"1.{what}" if row == "2" else name], name
    # They share no memory: what the child learns is not the parent's.
    sb3.learn(state, replace(games, members=np.full_like(games.members, 2)), 0, np.random.default_rng(1), ONE)
    for name, held in bytes_of(sb3, state).items():
        if not name.startswith("2."):
            assert held == before[name], name
    assert bytes_of(sb3, state)["2.counter.num_timesteps"] != after["2.counter.num_timesteps"]


def test_too_few_steps_are_kept_for_later(random_games):
    sb3 = learner("A2C")
    state = grown(sb3)
    before = weights_of(state[0])
    (figure,) = sb3.learn(state, random_games([[0]], [39], [False]), 0, np.random.default_rng(0), ONE)
    assert (figure.updates, figure.steps) == (0, 39)
    assert np.isnan(figure.loss)
    np.testing.assert_array_equal(weights_of(state[0]), before)
    (figure,) = sb3.learn(state, random_games([[0]], [82], [False]), 0, np.random.default_rng(0), ONE)
    assert (figure.updates, figure.steps, state[0].rollout_buffer.pos) == (3, 82, 1)


@pytest.mark.parametrize("algorithm", EVERY)
def test_the_processes_own_generators_are_left_alone(algorithm, random_games):
    sb3 = learner(algorithm)
    games = random_games([[0, 1]], [90], [True])
    drawn = []
    for busy in (False, True):
        random.seed(1)
        np.random.seed(2)  # noqa: NPY002
        torch.manual_seed(3)
        if busy:
            state = learner(algorithm).init(2, np.random.default_rng(0))
            sb3.learn(state, games, 0, np.random.default_rng(0), ONE)
            sb3.restored(sb3.tensors(state))
        drawn.append((random.random(), np.random.random(), torch.rand(1).item()))  # noqa: NPY002
    assert drawn[0] == drawn[1]


def test_members_begin_apart_and_the_same_with_the_same_seed():
    sb3 = learner("A2C")
    first, again, other = (sb3.init(2, np.random.default_rng(seed)) for seed in (0, 0, 1))
    assert bytes_of(sb3, first) == bytes_of(sb3, again)
    assert not np.array_equal(weights_of(first[0]), weights_of(first[1]))
    assert not np.array_equal(weights_of(first[0]), weights_of(other[0]))


@pytest.mark.parametrize("algorithm", ["A2C", "DQN"])
def test_learns_which_action_is_rewarded(algorithm):
    sb3 = learner(algorithm, learning_rate=1e-2)
    state = sb3.init(2, np.random.default_rng(0))
    rng = np.random.default_rng(1)
    observations = np.ones((1, 2, 201, OBSERVATION), dtype=np.float32)
    for epoch in range(8):
        policies = sb3.policies(state, explore=True)
        work = np.empty(2 * policies.sizes.max(), dtype=np.float32)
        draws = rng.random((2, 200, 2))
        done = [[act(policies, k, observations[0, 0, 0], work, *both) for both in draws[k]] for k in range(2)]
        actions = np.array([done], dtype=np.int16)
        rewards = (actions == np.array([3, 1])[:, np.newaxis]).astype(np.float32)
        games = Experience(np.array([[0, 1]]), observations, actions, rewards, np.array([200]), np.array([True]))
        sb3.learn(state, games, 0, np.random.default_rng(epoch), ONE)
    assert (actions[0, 0] == 3).mean() > 0.6
    assert (actions[0, 1] == 1).mean() > 0.6
