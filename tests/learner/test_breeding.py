"""Children take whole layers of their parents, with all that goes with them, and noise of the told size."""

from dataclasses import asdict

import numpy as np
import pytest
import torch

from berteam_cli.learner.breeding import copied, cross, mutate, spans
from berteam_cli.learner.mlp import layers
from berteam_cli.learner.stacked_dqn import StackedDqn
from berteam_cli.learner.stacked_ppo import StackedPpo
from tests.learner import test_dqn, test_ppo

LEARNERS = [
    *(test_ppo.SMALL, test_dqn.SMALL),
    StackedPpo(**asdict(test_ppo.SMALL), device="cpu"),
    StackedDqn(**asdict(test_dqn.SMALL), device="cpu"),
]


def told_apart(learner):
    """Three members each of whose numbers are its own, and other ones in the weights than in the moments."""
    state = learner.init(3, np.random.default_rng(0))
    for k, column in enumerate(learner.genes(state)):
        column[:] = 10 * k + torch.arange(3.0)[:, None]
    return state


def test_layers_lie_where_networks_have_them():
    assert spans((9, 16, 5), (9, 3, 1)) == [slice(0, 160), slice(160, 245), slice(245, 275), slice(275, 279)]
    weights = np.arange(245.0, dtype=np.float32)[np.newaxis]
    for span, (matrix, bias) in zip(spans((9, 16, 5)), layers(weights, (9, 16, 5)), strict=True):
        np.testing.assert_array_equal(weights[0, span], np.append(matrix.ravel(), bias))


@pytest.mark.parametrize("learner", LEARNERS, ids=[type(x).__name__ for x in LEARNERS])
def test_each_layer_comes_whole_from_one_parent_with_its_moments(learner):
    from_second = np.zeros(len(learner.spans))
    for seed in range(40):
        state = told_apart(learner)
        other = copied(learner.genes(state), 2)
        learner.copy(state, 0, 1)
        cross(learner.genes(state), learner.spans, 0, other, np.random.default_rng(seed))
        for number, span in enumerate(learner.spans):
            parents = {
                round(float(x)) - 10 * k for k, column in enumerate(learner.genes(state)) for x in column[0, span]
            }
            assert len(parents) == 1
            from_second[number] += parents == {2}
        for k, column in enumerate(learner.genes(state)):
            assert (column[1:] == 10 * k + torch.tensor([[1.0], [2.0]])).all()  # the parents are as they were
    assert ((from_second > 8) & (from_second < 32)).all()  # each of 40 with a chance of a half
    names = ["weights", "mean", "square"] + ["target"] * hasattr(state, "target")
    held = learner.tensors(state)
    assert [torch.equal(held[name], gene) for name, gene in zip(names, learner.genes(state), strict=True)] == [
        True
    ] * len(names)


@pytest.mark.parametrize("learner", LEARNERS[:3], ids=["ppo", "dqn", "stacked"])
def test_noise_is_a_share_of_each_layer(learner):
    state = learner.init(2, np.random.default_rng(0))
    weights = learner.genes(state)[0]
    for k, span in enumerate(learner.spans):
        weights[:, span] *= 10.0**k  # layers of very different size
    before = weights.clone()
    mutate(weights, learner.spans, 1, 0.1, np.random.default_rng(4))
    assert torch.equal(weights[0], before[0])
    for span in learner.spans:
        noise = (weights - before)[1, span].double()
        told = 0.1 * before[1, span].double().square().mean().sqrt()
        assert noise.std().item() == pytest.approx(told.item(), rel=4 / np.sqrt(2 * len(noise)))
        assert abs(noise.mean()) < 4 * told / np.sqrt(len(noise))
