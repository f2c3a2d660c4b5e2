import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.optimizer.fitness import CaptainElo
from berteam_cli.optimizer.removal import above_neighbours, crowded
from tests.strategies import floats


def test_by_hand():
    # Radius 1: means 2, 3, 5, 6 of neighbours, so -1, 0, 0, 1 above them; the last is alone.
    fitness, behaviour = np.array([1.0, 3, 5, 7]), np.array([0.0, 0.5, 1.5, 2])
    np.testing.assert_allclose(above_neighbours(fitness, behaviour, 1.0), [-1, 0, 0, 1])
    np.testing.assert_array_equal(crowded(np.append(behaviour, 9), 1.0), [True, True, True, True, False])


def test_exactly_at_the_radius_is_unique_but_a_neighbour():
    behaviour = np.array([0.0, 1.0])
    assert not crowded(behaviour, 1.0).any()
    np.testing.assert_allclose(above_neighbours(np.array([0.0, 1]), behaviour, 1.0), [-0.5, 0.5])


def test_who_was_never_measured_is_unique():
    np.testing.assert_array_equal(crowded(np.array([np.nan, 0.0, 0.1]), 1.0), [False, True, True])


@given(floats(5), floats(5))
def test_when_all_are_near_it_is_coevolution(fitness, behaviour):
    """O9: with an infinite radius the chances are those of plain fitness."""
    rule = CaptainElo(32, 0)
    better = above_neighbours(fitness, behaviour, np.inf)
    np.testing.assert_allclose(better, fitness - fitness.mean(), atol=1e-12)
    np.testing.assert_allclose(rule.removal_chances(better), rule.removal_chances(fitness))


@given(floats(6, 0, 3), st.floats(0.1, 2))
def test_crowded_means_somebody_is_near(behaviour, radius):
    for k, is_crowded in enumerate(crowded(behaviour, radius)):
        others = np.delete(behaviour, k)
        assert is_crowded == (np.abs(others - behaviour[k]) < radius).any()


def test_removal_needs_a_rule_of_its_own_fitness():
    assert CaptainElo(32, 0).removal_chances(np.array([-1.0, 0, 0, 1]))[0] == pytest.approx(
        np.e / (np.e + 2 + 1 / np.e)
    )
