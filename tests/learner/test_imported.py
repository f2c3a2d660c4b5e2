"""Members from files: they act as Stable-Baselines3 lets them, learn nothing, and are copied whole."""

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, DQN, PPO

from berteam_cli.acting import GREEDY, SAMPLED, act, joined
from berteam_cli.learner.imported import Imported, read
from berteam_cli.learner.trusted import trusted_network
from berteam_cli.learner.zipped import Unfit
from berteam_cli.workers import Workers
from tests.learner.conftest import ACTIONS, OBSERVATION

SIZES = (OBSERVATION, ACTIONS)
RELU, TANH = torch.nn.ReLU, torch.nn.Tanh


@pytest.fixture
def saved(sb3_model, tmp_path):
    """A function that saves a model whose weights are far from where they begin, and returns it and its path."""

    def save(kind, name="member.zip", **policy_kwargs):
        model = sb3_model(kind, policy_kwargs=policy_kwargs)
        torch.manual_seed(0)
        with torch.no_grad():
            for parameter in model.policy.parameters():
                parameter.add_(0.5 * torch.randn(parameter.shape))
        model.save(tmp_path / name)
        return model, tmp_path / name

    return save


def chances(policies, k, observation, count=2000):
    """The shares of actions of policy ``k``, over evenly spaced choices."""
    work = np.zeros(2 * policies.sizes.max(), dtype=np.float32)
    actions = [act(policies, k, observation, work, 0.99, (x + 0.5) / count) for x in range(count)]
    return np.bincount(actions, minlength=ACTIONS) / count


@pytest.mark.parametrize(
    ("kind", "kwargs", "tanh"),
    [
        (PPO, {}, True),
        (A2C, {"net_arch": [8, 7, 6]}, True),
        (PPO, {"activation_fn": RELU, "net_arch": {"pi": [12], "vf": [5, 5]}}, False),
        (PPO, {"activation_fn": TANH, "net_arch": [], "ortho_init": False}, True),
        (DQN, {}, False),
        (DQN, {"activation_fn": TANH, "net_arch": [10]}, True),
        (DQN, {"activation_fn": RELU, "net_arch": []}, False),
    ],
)
@pytest.mark.parametrize("how", ["plain", "trusted"])
def test_they_act_as_stable_baselines_does(saved, kind, kwargs, tanh, how):
    model, path = saved(kind, **kwargs)
    policies = read(path, *SIZES, trust=False) if how == "plain" else trusted_network(path, *SIZES)
    assert policies.kind.tolist() == [GREEDY if kind is DQN else SAMPLED]
    assert policies.epsilon.tolist() == [0.0]
    assert policies.tanh[0] == tanh or kwargs.get("net_arch") == []  # who has no hidden layers needs neither
    for observation in np.random.default_rng(1).standard_normal((5, OBSERVATION)).astype(np.float32):
        if kind is DQN:
            action, _ = model.predict(observation, deterministic=True)
            assert chances(policies, 0, observation, 3)[action] == 1
            continue
        with torch.no_grad():
            theirs = model.policy.get_distribution(torch.from_numpy(observation[None])).distribution.probs[0]
        np.testing.assert_allclose(chances(policies, 0, observation), theirs, atol=1e-3)


@pytest.fixture
def island(saved):
    """An island of three members of three kinds and sizes, and its first state."""
    paths = [saved(PPO, "a.zip", net_arch=[4])[1], saved(DQN, "b.zip", net_arch=[9, 8])[1], saved(A2C, "c.zip")[1]]
    networks = joined([read(path, *SIZES, trust=False) for path in paths])
    learner = Imported(("a", "b", "c"), *SIZES, networks)
    return learner, learner.init(3, np.random.default_rng(0))


def assert_same(ours, row, others, other):
    for column, theirs in zip(ours, others, strict=True):
        np.testing.assert_array_equal(column[row], theirs[other])


def test_they_learn_nothing_and_count_their_steps(island, random_games):
    learner, state = island
    games = random_games([[5, 6, 9, 5], [6, 8, 8, 9]], [7, 11], [True, False])
    figures = learner.learn(state, games, 5, np.random.default_rng(0), Workers(1))
    assert [(each.row, each.steps, each.updates) for each in figures] == [(0, 14, 0), (1, 18, 0)]
    for explore in (True, False):
        for row in range(3):
            assert_same(learner.policies(state, explore=explore), row, learner.networks, row)


def test_a_copy_has_the_network_and_the_name_of_its_parent(island):
    learner, state = island
    before = learner.policies(state, explore=False)
    learner.copy(state, 2, 0)
    learner.copy(state, 0, 1)
    assert learner.names(state, "members") == ["b", "b", "a"]
    after = learner.policies(state, explore=False)
    for row, parent in enumerate((1, 1, 0)):
        assert_same(after, row, before, parent)
    again = learner.init(3, np.random.default_rng(0))
    assert_same(learner.policies(again, explore=False), 2, before, 2)  # what the files hold stays as it was


def test_a_checkpoint_holds_all_of_them(island):
    learner, state = island
    learner.copy(state, 2, 1)
    tensors = {name: tensor.clone() for name, tensor in learner.tensors(state).items()}
    unread = Imported(learner.called, *SIZES, None)
    restored = unread.restored(tensors)
    assert unread.names(restored, "members") == ["a", "b", "b"]
    for row in range(3):
        assert_same(unread.policies(restored, explore=False), row, learner.policies(state, explore=False), row)
    unread.copy(restored, 0, 1)
    assert tensors["files"].tolist() == [0, 1, 1]  # the state has memory of its own
    with pytest.raises(RuntimeError, match="not read"):
        unread.init(3, np.random.default_rng(0))


def test_a_checkpoint_of_another_game_or_of_others_is_refused(island):
    learner, state = island
    tensors = learner.tensors(state)
    for other in (
        Imported(("a", "b"), *SIZES, None),
        Imported(learner.called, OBSERVATION + 1, ACTIONS, None),
        Imported(learner.called, OBSERVATION, ACTIONS + 1, None),
    ):
        with pytest.raises(ValueError, match="not as many, or of another game"):
            other.restored(tensors)


def test_needs_one_file_for_each_member(island):
    with pytest.raises(ValueError, match="members must be 3"):
        island[0].init(2, np.random.default_rng(0))


class Halved(PPO.policy_aliases["MlpPolicy"]):
    """A policy that does not act as its network does alone."""

    def get_distribution(self, obs):
        return super().get_distribution(obs / 2)


class Opposite(DQN.policy_aliases["MlpPolicy"]):
    """A policy that takes the worst action."""

    def _predict(self, obs, deterministic=True):
        return self.q_net(obs).argmin(dim=1)


class Renamed(DQN.policy_aliases["MlpPolicy"]):
    """A policy of one's own that acts as its network does."""


def an_activation():
    return TANH()


def save_with(path, kind, policy, kwargs, space=None):
    class Game(gymnasium.Env):
        observation_space = space or gymnasium.spaces.Box(-1, 1, (OBSERVATION,), np.float32)
        action_space = gymnasium.spaces.Discrete(ACTIONS)

    kind(policy, Game(), device="cpu", policy_kwargs=kwargs).save(path)


@pytest.mark.parametrize(
    ("kind", "policy", "kwargs"),
    [(PPO, "MlpPolicy", {"activation_fn": an_activation}), (DQN, Renamed, {}), (A2C, "MlpPolicy", {"full_std": True})],
)
def test_what_trust_adds(tmp_path, kind, policy, kwargs):
    path = tmp_path / "own.zip"
    save_with(path, kind, policy, kwargs)
    with pytest.raises(Unfit, match="if you trust it, say trust: true"):
        read(path, *SIZES, trust=False)
    policies = read(path, *SIZES, trust=True)
    seen = np.ones(OBSERVATION, dtype=np.float32)
    if kind is DQN:
        action, _ = DQN.load(path).predict(seen, deterministic=True)
        assert chances(policies, 0, seen, 3)[action] == 1
    else:
        theirs = kind.load(path).policy.get_distribution(torch.from_numpy(seen[None])).distribution.probs[0]
        np.testing.assert_allclose(chances(policies, 0, seen), theirs.detach(), atol=1e-3)


IMAGE = gymnasium.spaces.Box(0, 255, (1, 3, 3), np.uint8)
BYTES = gymnasium.spaces.Box(0, 255, (OBSERVATION,), np.uint8)
ONE_OF = gymnasium.spaces.Discrete(OBSERVATION)


def test_what_trust_cannot_add(tmp_path):
    path = tmp_path / "own.zip"
    for kind, policy, space in ((PPO, Halved, None), (DQN, Opposite, None), (PPO, "MlpPolicy", IMAGE)):
        save_with(path, kind, policy, {"net_arch": [4]}, space)
        with pytest.raises(Unfit, match="does not act as the layers of its network"):
            read(path, *SIZES, trust=True)
    save_with(path, PPO, Halved, {"activation_fn": torch.nn.ELU})
    with pytest.raises(Unfit, match="has ELU for its activation"):
        read(path, *SIZES, trust=True)
    save_with(path, DQN, Renamed, {})
    with pytest.raises(Unfit, match="sees 9 numbers and has 5 actions, but in this game observations have 8"):
        read(path, OBSERVATION - 1, ACTIONS, trust=True)


@pytest.mark.parametrize("space", [BYTES, ONE_OF])
def test_observations_of_other_kinds_that_come_as_they_are(tmp_path, space):
    """Bytes are not scaled unless they are images, and one of n comes as n numbers, here as there."""
    path = tmp_path / "own.zip"
    save_with(path, DQN, "MlpPolicy", {}, space)
    plain, trusted = read(path, *SIZES, trust=False), trusted_network(path, *SIZES)
    assert_same(plain, 0, trusted, 0)
    model = DQN.load(path)
    for k in range(OBSERVATION):
        given = k if space is ONE_OF else np.full(OBSERVATION, 20 * k, np.uint8)
        seen = np.eye(OBSERVATION, dtype=np.float32)[k] if space is ONE_OF else given.astype(np.float32)
        action, _ = model.predict(given, deterministic=True)
        assert chances(plain, 0, seen, 3)[action] == 1
