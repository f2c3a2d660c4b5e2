"""Where many rounds of choosing, playing and learning lead; the paper's Appendix D says where they should."""

import numpy as np
import pytest

from tests.selector.test_berteam import far, learn, made, ordered, played

SETTINGS = {
    "captain": "berteam",
    "noise_half_life": 0.0,
    "width": 32,
    "dropout": 0.0,
    "minibatch_size": 256,
    "learning_rate": 2e-3,
    "averaging": 0.98,
}


def win_matrix(seed):
    """Returns (16, 16) chances that one ordered team of 4 members beats another; order matters a little."""
    rng = np.random.default_rng(seed)
    strength = rng.normal(0, 1, size=(4, 4))
    strength = (strength + strength.T + 0.2 * rng.normal(size=(4, 4))).ravel() / 2
    return 1 / (1 + np.exp(strength - strength[:, np.newaxis]))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_weighted_learning_settles_where_chances_are_win_rates(seed):
    selector = made(weighting=True, weight_cap=13.0, batch_size=1024, capacity=12_000, **SETTINGS)
    wins, rng = win_matrix(seed), np.random.default_rng(seed)
    fixed = np.full(16, 1 / 16)
    for _ in range(100):
        fixed = wins @ fixed / (wins @ fixed).sum()
    state = selector.init(rng)
    start = far(ordered(selector, state), fixed)
    for epoch in range(80):
        lineups = selector.select(state, 300, np.zeros(4), rng)
        state, _ = learn(selector, state, played(lineups, wins, seed=epoch), rng)
    assert start > 0.15
    assert far(ordered(selector, state), fixed) < 0.05


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_unweighted_learning_walks_the_path_of_the_replicator(seed):
    games = 20_000
    selector = made(weighting=False, batch_size=250 * 256, capacity=games, **SETTINGS)
    wins, rng = win_matrix(seed), np.random.default_rng(seed)
    state = selector.init(rng)
    path = ordered(selector, state)
    start = path
    for generation in range(2):
        path = path * (wins @ path) / (path @ wins @ path)
        lineups = selector.select(state, games, np.zeros(4), rng)
        outcomes = played(lineups, wins, seed=generation)  # as many winners as are remembered: none is from before
        state, _ = learn(selector, state, outcomes, rng)
        assert far(ordered(selector, state), path) < 0.05
    assert far(start, path) > 0.1
