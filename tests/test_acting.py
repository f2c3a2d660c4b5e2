from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.acting import FIXED, GREEDY, SAMPLED, act, drawn, fixed_policies, joined, networks


def layers(rng, members, *widths):
    pairs = pairwise(widths)
    return [
        (rng.normal(size=(members, a, b)).astype(np.float32), rng.normal(size=(members, b)).astype(np.float32))
        for a, b in pairs
    ]


def torch_outputs(parts, k, observation, activation):
    x = torch.from_numpy(observation)
    for weights, bias in parts[:-1]:
        x = activation(x @ torch.from_numpy(weights[k]) + torch.from_numpy(bias[k]))
    return x @ torch.from_numpy(parts[-1][0][k]) + torch.from_numpy(parts[-1][1][k])


def work(policies):
    return np.zeros(2 * policies.sizes.max(), dtype=np.float32)


@given(st.integers(0, 2**32), st.booleans(), st.sampled_from([(5,), (8, 8), (3, 9, 4)]))
def test_greedy_takes_the_output_that_torch_finds_highest(seed, tanh, hidden):
    rng = np.random.default_rng(seed)
    parts = layers(rng, 3, 6, *hidden, 7)
    policies = networks(GREEDY, parts, tanh=tanh)
    observation = rng.normal(size=6).astype(np.float32)
    for k in range(3):
        outputs = torch_outputs(parts, k, observation, torch.tanh if tanh else torch.relu)
        assert act(policies, k, observation, work(policies), 0.5, 0.5) == int(outputs.argmax())


def test_sampled_actions_come_as_often_as_torch_says():
    rng = np.random.default_rng(0)
    parts = layers(rng, 1, 4, 8, 3)
    policies = networks(SAMPLED, parts, tanh=True)
    observation = rng.normal(size=4).astype(np.float32)
    chances = torch.softmax(torch_outputs(parts, 0, observation, torch.tanh), 0).numpy()
    grid = (np.arange(10_000) + 0.5) / 10_000  # evenly spaced choices hit every action in proportion
    actions = [act(policies, 0, observation, work(policies), 0.0, choice) for choice in grid]
    np.testing.assert_allclose(np.bincount(actions, minlength=3) / 10_000, chances, atol=2e-4)


def test_epsilon_is_the_share_of_random_actions():
    parts = [(np.repeat(w, 2, axis=0), np.repeat(b, 2, axis=0)) for w, b in layers(np.random.default_rng(1), 1, 3, 4)]
    policies = networks(GREEDY, parts, tanh=False, epsilon=[0.25, 0.0])
    observation = np.ones(3, dtype=np.float32)
    best = act(policies, 1, observation, work(policies), 0.0, 0.9)
    random = [act(policies, 0, observation, work(policies), 0.2499, choice) for choice in (0.0, 0.3, 0.6, 0.99)]
    assert random == [0, 1, 2, 3]
    assert act(policies, 0, observation, work(policies), 0.2501, 0.0) == best


def test_joined_tables_act_as_each_alone():
    rng = np.random.default_rng(2)
    small, large = layers(rng, 2, 5, 4, 3), layers(rng, 1, 5, 9, 9, 3)
    one, two = networks(SAMPLED, small, tanh=True), networks(GREEDY, large, tanh=False)
    both = joined([fixed_policies([4, 2]), one, two])
    assert list(both.kind) == [FIXED, FIXED, SAMPLED, SAMPLED, GREEDY]
    assert list(both.fixed[:2]) == [4, 2]
    observation = rng.normal(size=5).astype(np.float32)
    for choice in (0.1, 0.5, 0.9):
        assert act(both, 3, observation, work(both), 0.9, choice) == act(one, 1, observation, work(one), 0.9, choice)
        assert act(both, 4, observation, work(both), 0.9, choice) == act(two, 0, observation, work(two), 0.9, choice)


@pytest.mark.parametrize(("choice", "action"), [(0.0, 0), (0.24, 0), (0.26, 1), (0.999999, 1)])
def test_drawn_by_hand(choice, action):
    assert drawn(np.log(np.array([1.0, 3.0], dtype=np.float32)), 0, 2, choice) == action


def test_drawn_survives_large_outputs():
    assert drawn(np.array([-1e30, 3e38, 0], dtype=np.float32), 0, 3, 0.999999999) == 1
