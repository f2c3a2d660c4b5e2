import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.selector.metastrategies import exploitability, nash, nearest, projected_replicator
from tests.strategies import floats

# Rock wins 1 from scissors, 2 are at stake between paper and rock, 3 between scissors and paper.
UNEVEN = np.array([[0, -2, 1], [2, 0, -3], [-1, 3, 0.0]])


def zero_sum(size, seed):
    wins = np.random.default_rng(seed).uniform(-1, 1, (size, size))
    return (wins - wins.T) / 2


def test_the_equilibrium_of_a_known_game():
    np.testing.assert_allclose(nash(UNEVEN), [3 / 6, 1 / 6, 2 / 6], atol=1e-9)
    assert exploitability(np.full(3, 1 / 3), UNEVEN) == pytest.approx(2 / 3)
    np.testing.assert_allclose(nash(np.zeros((1, 1))), [1])


@given(st.integers(1, 12), st.integers(0, 2**32))
def test_nobody_wins_from_an_equilibrium(size, seed):
    payoff = zero_sum(size, seed)
    found = nash(payoff)
    assert found.sum() == pytest.approx(1)
    assert (found >= 0).all()
    assert exploitability(found, payoff) < 1e-7


@pytest.mark.parametrize("seed", range(3))
def test_replicator_dynamics_come_close(seed):
    payoff = zero_sum(8, seed)
    found = projected_replicator(payoff, 0.01)
    assert found.sum() == pytest.approx(1)
    assert exploitability(found, payoff) < 0.05


def test_replicator_dynamics_explore():
    dominated = np.array([[0, 1], [-1, 0.0]])
    found = projected_replicator(dominated, 0.2, steps=5000)
    assert found[1] == pytest.approx(0.1, abs=0.01)
    np.testing.assert_allclose(projected_replicator(UNEVEN, 1.0), 1 / 3)


@given(floats(5), floats(5))
def test_nothing_lies_nearer(point, other):
    found = nearest(point, 0.7)
    assert found.sum() == pytest.approx(0.7)
    assert (found >= 0).all()
    rival = np.exp(other) / np.exp(other).sum() * 0.7
    assert np.linalg.norm(point - found) <= np.linalg.norm(point - rival) + 1e-9
