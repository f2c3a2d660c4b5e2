from dataclasses import replace

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO

from berteam_cli.acting import SAMPLED, act
from berteam_cli.learner.mlp import layers, weight_count
from berteam_cli.learner.ppo import Ppo
from berteam_cli.learner.rollout import advantages
from berteam_cli.outcomes import Experience
from berteam_cli.workers import Workers

pytestmark = pytest.mark.filterwarnings("ignore:You have specified a mini-batch size")  # it is meant to be odd

SMALL = Ppo(
    observation_size=9,
    actions=5,
    network=(16, 12),
    activation="tanh",
    learning_rate=1e-3,
    n_steps=50,
    minibatch_size=16,
    n_epochs=2,
    gamma=0.9,
    gae_lambda=0.8,
    clip_range=0.2,
    clip_range_vf=None,
    target_kl=None,
    entropy_coef=0.01,
    value_coef=0.5,
    max_grad_norm=0.5,
    normalize_advantage=True,
)
ACTIVATIONS = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}
LENGTHS, TERMINATED = [100, 90, 120], [True, False, True]  # 256 steps cut the third game


def grown(ppo, members, seed=1):
    """A state whose policies are far from uniform."""
    rng = np.random.default_rng(seed)
    state = ppo.init(members, rng)
    state.trained.weights[:] += 0.2 * rng.standard_normal(state.trained.weights.shape, dtype=np.float32)
    return state


def parts(ppo, model):
    policy = (model.policy.mlp_extractor.policy_net, model.policy.action_net)
    value = (model.policy.mlp_extractor.value_net, model.policy.value_net)
    return (ppo.policy_sizes, policy), (ppo.value_sizes, value)


@pytest.fixture
def twin(sb3_model, load):
    """A function that returns Stable-Baselines3's PPO with the settings and the weights of one of our members."""

    def built(ppo, weights):
        model = sb3_model(
            PPO,
            learning_rate=ppo.learning_rate,
            n_steps=ppo.n_steps,
            batch_size=ppo.minibatch_size,
            n_epochs=ppo.n_epochs,
            gamma=ppo.gamma,
            gae_lambda=ppo.gae_lambda,
            clip_range=ppo.clip_range,
            clip_range_vf=ppo.clip_range_vf,
            target_kl=ppo.target_kl,
            ent_coef=ppo.entropy_coef,
            vf_coef=ppo.value_coef,
            max_grad_norm=ppo.max_grad_norm,
            normalize_advantage=ppo.normalize_advantage,
            policy_kwargs={"net_arch": list(ppo.network), "activation_fn": ACTIVATIONS[ppo.activation]},
        )
        cut = weight_count(np.array(ppo.policy_sizes))
        for own, (sizes, modules) in zip((weights[:cut], weights[cut:]), parts(ppo, model), strict=True):
            load(own, sizes, *modules)
        return model

    return built


def collect(model, experience, trajectories):
    """Fills the model's rollout buffer as OnPolicyAlgorithm.collect_rollouts does with one environment."""
    buffer, policy = model.rollout_buffer, model.policy
    buffer.reset()
    started = True
    for game, player in trajectories:
        length = experience.lengths[game]
        for t in range(length):
            seen = torch.tensor(experience.observations[game, player, t : t + 2])
            action = int(experience.actions[game, player, t])
            done = t == length - 1
            with torch.no_grad():
                value, log_prob, _ = policy.evaluate_actions(seen[:1], torch.tensor([action]))
                after = policy.predict_values(seen[1:])
            reward = experience.rewards[game, player, t]
            if done and not experience.terminated[game]:
                reward = reward + model.gamma * after.item()
            buffer.add(seen[:1].numpy(), np.array([action]), np.array([reward]), np.array([started]), value, log_prob)
            started = done
            if buffer.full:
                buffer.compute_returns_and_advantage(after, np.array([done]))
                return


def test_advantages_are_those_of_stable_baselines(twin, random_games):
    ppo = replace(SMALL, n_steps=256)
    state = grown(ppo, 1)
    games = random_games([[0], [0], [0]], LENGTHS, TERMINATED)
    trajectories = [(0, 0), (1, 0), (2, 0)]
    model = twin(ppo, state.trained.weights[0])
    collect(model, games, trajectories)
    buffer = model.rollout_buffer

    steps = ppo.judged(state, 0, games, trajectories)
    columns = [column[:256] for column in (steps.rewards, steps.values, steps.next_values, steps.ends)]
    ours = advantages(*columns, ppo.gamma, ppo.gae_lambda)
    assert steps.ends.nonzero()[0].tolist() == [99, 189, 309]
    np.testing.assert_allclose(ours, buffer.advantages[:, 0], atol=2e-6)
    np.testing.assert_allclose(ours + columns[1], buffer.returns[:, 0], atol=2e-6)
    np.testing.assert_allclose(steps.log_probs[:256], buffer.log_probs[:, 0], atol=2e-6)


def test_advantages_by_hand():
    # Two steps of a game, its end, then one step that the rollout's end cuts off before a value of 4.
    ends = np.array([False, True, False])
    rewards, values, after = (np.array(each, dtype=np.float32) for each in ([1, 2, 3], [5, 6, 7], [6, 0, 4]))
    ours = advantages(rewards, values, after, ends, 0.5, 0.5)
    np.testing.assert_allclose(ours, [1 + 3 - 5 + 0.25 * -4, -4, 3 + 2 - 7])


@pytest.mark.parametrize(
    ("network", "changes"),
    [
        ((64, 64), {}),
        ((96, 96), {"entropy_coef": 0.0, "learning_rate": 3e-4}),
        ((16,), {"minibatch_size": 60, "normalize_advantage": False, "clip_range": 0.05}),
        ((16, 12), {"minibatch_size": 255, "max_grad_norm": 1e-3}),
        ((16, 12), {"activation": "relu", "clip_range_vf": 0.1}),
        *(((16, 12), {"target_kl": limit}) for limit in (0.0005, 0.001, 0.0015, 0.002, 0.003, 0.004)),
    ],
)
def test_an_update_is_that_of_stable_baselines(twin, flat, random_games, monkeypatch, network, changes):
    ppo = replace(SMALL, network=network, n_steps=256, minibatch_size=64, n_epochs=10)
    ppo = replace(ppo, **changes)
    state = grown(ppo, 3)
    games = random_games([[7, 5, 6, 9]] * 3, LENGTHS, TERMINATED)
    models = [twin(ppo, weights) for weights in state.trained.weights]
    before = state.trained.weights.copy()
    figures = ppo.learn(state, games, 5, np.random.default_rng(3), Workers(2))

    for row, (model, rng) in enumerate(zip(models, np.random.default_rng(3).spawn(3), strict=True)):
        collect(model, games, [(game, {0: 1, 1: 2, 2: 0}[row]) for game in range(3)])
        monkeypatch.setattr(np.random, "permutation", rng.permutation)
        model.train()
        theirs = np.concatenate([flat(*modules) for _, modules in parts(ppo, model)])
        np.testing.assert_allclose(state.trained.weights[row], theirs, atol=1e-5)
        assert np.abs(theirs - before[row]).max() > 10 * 1e-5

        log, ours = model.logger.name_to_value, figures[row]
        whole = 10 * -(-256 // ppo.minibatch_size)
        assert (ours.row, ours.steps, ours.failures) == (row, 310, 0)
        assert 0 < ours.updates < whole if ppo.target_kl else ours.updates == whole
        assert ours.policy_loss == pytest.approx(log["train/policy_gradient_loss"], abs=1e-5)
        assert ours.value_loss == pytest.approx(log["train/value_loss"], abs=1e-4)
        assert ours.entropy == pytest.approx(-log["train/entropy_loss"], abs=1e-5)
        assert ours.approx_kl == pytest.approx(log["train/approx_kl"], abs=1e-5)
        assert ours.clip_fraction == pytest.approx(log["train/clip_fraction"], abs=2e-3)
        total = ours.policy_loss - ppo.entropy_coef * ours.entropy + ppo.value_coef * ours.value_loss
        assert ours.loss == pytest.approx(total, abs=1e-5)


def test_what_is_left_over_keeps_the_values_of_the_weights_that_acted(random_games):
    ppo = replace(SMALL, n_steps=256)
    state = grown(ppo, 1)
    games = random_games([[0], [0], [0]], LENGTHS, TERMINATED)
    steps = ppo.judged(state, 0, games, [(0, 0), (1, 0), (2, 0)])
    ppo.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    assert state.filled.tolist() == [54]
    for kept, column in zip(state.rollouts, steps, strict=True):
        np.testing.assert_array_equal(kept[0, :54], column[256:])


def test_a_member_with_many_steps_learns_several_times(random_games):
    state = grown(SMALL, 2)
    games = random_games([[0, 0, 1, 3]], [60], [True])
    figures = SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    assert [(each.row, each.steps, each.updates) for each in figures] == [(0, 120, 2 * 2 * 4), (1, 60, 2 * 4)]
    assert state.filled.tolist() == [20, 10]
    assert state.trained.updates.tolist() == [16, 8]


def test_too_few_steps_are_kept_for_later(random_games):
    state = grown(SMALL, 1)
    games = random_games([[0]], [49], [False])
    before = state.trained.weights.copy()
    (figure,) = SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    assert (figure.updates, figure.steps) == (0, 49)
    assert np.isnan(figure.loss)
    np.testing.assert_array_equal(state.trained.weights, before)
    (figure,) = SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    assert (figure.updates, state.filled[0]) == (8, 48)


def test_what_a_member_learns_does_not_depend_on_the_others(random_games):
    games = random_games([[0, 1, 2, 1]] * 3, LENGTHS, TERMINATED)
    island, alone = grown(SMALL, 3), grown(SMALL, 3)
    alone = type(alone)(
        *(type(each)(*(c[:1] for c in each)) for each in alone[:2]), alone.filled[:1], alone.collected[:1]
    )
    SMALL.learn(island, games, 0, np.random.default_rng(5), Workers(2))
    SMALL.learn(alone, games, 0, np.random.default_rng(5), Workers(1))
    for name, tensor in SMALL.tensors(alone).items():
        assert torch.equal(tensor, SMALL.tensors(island)[name][:1]), name


def test_begins_as_stable_baselines_does():
    ppo = replace(SMALL, network=(64, 64))
    policy, value = both_networks(ppo, ppo.init(4, np.random.default_rng(0)))
    for gains, net in (((2.0, 2.0, 0.01**2), policy), ((2.0, 2.0, 1.0), value)):
        for gain, (matrix, bias) in zip(gains, net, strict=True):
            assert not bias.any()
            wide = matrix.shape[1] >= matrix.shape[2]
            gram = matrix.swapaxes(1, 2) @ matrix if wide else matrix @ matrix.swapaxes(1, 2)
            eye = np.broadcast_to(gain * np.eye(gram.shape[1]), gram.shape)
            np.testing.assert_allclose(gram, eye, atol=1e-5 * gain)
    assert not np.array_equal(policy[0][0][0], policy[0][0][1])


def both_networks(ppo, state):
    cut = weight_count(np.array(ppo.policy_sizes))
    weights = state.trained.weights
    return layers(weights[:, :cut], ppo.policy_sizes), layers(weights[:, cut:], ppo.value_sizes)


def test_members_act_as_the_policy_of_stable_baselines(twin):
    ppo = replace(SMALL, network=(64, 64))
    state = grown(ppo, 2)
    policies = ppo.policies(state, explore=False)
    assert policies.kind.tolist() == [SAMPLED, SAMPLED]
    work = np.empty(2 * policies.sizes.max(), dtype=np.float32)
    observation = np.random.default_rng(0).standard_normal(9, dtype=np.float32)
    for k in range(2):
        model = twin(ppo, state.trained.weights[k])
        chances = model.policy.get_distribution(torch.tensor(observation[None])).distribution.probs[0].detach().numpy()
        assert chances.max() > 0.3
        draws = [act(policies, k, observation, work, 0.0, (i + 0.5) / 4000) for i in range(4000)]
        np.testing.assert_allclose(np.bincount(draws, minlength=5) / 4000, chances, atol=1 / 4000)


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


def test_a_restored_state_goes_on_to_the_same_bytes(random_games):
    games = random_games([[0, 1, 2, 2]] * 2, [30, 41], [True, False])
    state = grown(SMALL, 3)
    SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    assert state.filled.any()
    again = SMALL.restored({name: tensor.clone() for name, tensor in SMALL.tensors(state).items()})
    for each in (state, again):
        SMALL.learn(each, games, 0, np.random.default_rng(1), Workers(1))
    for name, tensor in SMALL.tensors(state).items():
        assert torch.equal(tensor, SMALL.tensors(again)[name]), name


def test_a_copy_has_all_but_the_rollout(random_games):
    games = random_games([[0, 1, 2, 1]] * 2, [60, 41], [True, False])
    state = grown(SMALL, 3)
    SMALL.learn(state, games, 0, np.random.default_rng(0), Workers(1))
    before = {name: tensor.clone() for name, tensor in SMALL.tensors(state).items()}
    SMALL.copy(state, 2, 1)
    after = SMALL.tensors(state)
    for name in ("weights", "mean", "square", "updates"):
        assert torch.equal(after[name][2], before[name][1])
        assert not torch.equal(after[name][2], before[name][2])
    for name in ("filled", "observations", "actions", "rewards", "values", "log_probs", "next_values", "ends"):
        assert not after[name][2].any()
    for name, tensor in after.items():
        assert torch.equal(tensor[:2], before[name][:2])


def test_learns_which_action_is_rewarded():
    ppo = replace(SMALL, n_steps=128, n_epochs=4, minibatch_size=32, learning_rate=3e-3)
    state = ppo.init(2, np.random.default_rng(0))
    rng = np.random.default_rng(1)
    for epoch in range(8):
        observations = np.ones((1, 2, 129, 9), dtype=np.float32)
        logits = ppo.policies(state, explore=True)
        work = np.empty(2 * logits.sizes.max(), dtype=np.float32)
        choices = rng.random((2, 128))
        draw = [[act(logits, k, observations[0, 0, 0], work, 0.0, c) for c in choices[k]] for k in range(2)]
        actions = np.array([draw], dtype=np.int16)
        rewards = (actions == np.array([3, 1])[:, np.newaxis]).astype(np.float32)
        games = Experience(np.array([[0, 1]]), observations, actions, rewards, np.array([128]), np.array([True]))
        ppo.learn(state, games, 0, np.random.default_rng(epoch), Workers(1))
    assert (actions[0, 0] == 3).mean() > 0.6
    assert (actions[0, 1] == 1).mean() > 0.6
