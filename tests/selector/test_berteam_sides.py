"""BERTeam in games whose sides are not alike."""

import numpy as np
import pytest

from berteam_cli.outcomes import Lineups
from tests.selector.test_berteam import begun, learn, made, scored

TOLD_APART = [("token", "shared"), ("token", "per_side"), ("separate", "per_side")]


def each_its_own(games=24):
    """Returns outcomes of three-sided games in which side s shows the pair (s, s), and each side wins a third."""
    teams = np.tile(np.arange(3)[:, np.newaxis], (games, 1, 2))
    scores = np.eye(3)[np.arange(games) % 3]
    return scored(Lineups(teams, teams[:, :, 0], np.zeros((games, 3))), scores)


@pytest.mark.parametrize(("side", "dataset"), TOLD_APART)
def test_each_side_learns_from_its_own_winners(side, dataset):
    selector = made(4, 2, sides=3, side=side, dataset=dataset, learning_rate=5e-3)
    state = selector.init(np.random.default_rng(0))
    for epoch in range(40):
        state, did = learn(selector, state, each_its_own(), np.random.default_rng(epoch))
    assert did.updates == (12 if side == "separate" else 4)
    mean = np.zeros(10)
    for k in range(3):
        total = selector.distribution(state, side=k)
        assert tuple(total.teams[total.probability.argmax()]) == (k, k)
        assert total.probability.max() > 0.8
        mean += total.probability / 3
        assert (selector.sample(state, 50, np.random.default_rng(k), side=k) == k).mean() > 0.8
    np.testing.assert_allclose(selector.distribution(state).probability, mean, atol=1e-6)  # float32 logits
    lineups = selector.select(state, 40, np.full(4, 10**6), np.random.default_rng(0))
    others = lineups.teams.copy()
    for k in range(3):
        own = (lineups.captains[:, k] == k)[:, np.newaxis]
        assert (others[:, k] == k)[np.broadcast_to(own, (40, 2))].mean() > 0.8


def test_alike_sides_share_one_distribution():
    selector = made(4, 2, sides=3)
    state = begun(selector)
    assert not selector.by_side
    assert len(state.learnt) == len(state.winners) == 1


def test_a_side_that_wins_rarely_is_learnt_from_as_often_where_it_has_a_memory_of_its_own():
    selector = made(2, 1, side="token", dataset="per_side", capacity=1000, learning_rate=5e-3)
    teams = np.tile(np.array([[0], [1]]), (100, 1, 1))
    scores = np.tile([1.0, 0.0], (100, 1))
    scores[:2] = [0.0, 1.0]
    state = selector.init(np.random.default_rng(0))
    for epoch in range(30):
        outcomes = scored(Lineups(teams, teams[:, :, 0], np.zeros((100, 2))), scores)
        state, _ = learn(selector, state, outcomes, np.random.default_rng(epoch))
    assert [len(ring) for ring in state.winners] == [1000, 60]
    assert selector.distribution(state, side=1).probability[1] > 0.9
