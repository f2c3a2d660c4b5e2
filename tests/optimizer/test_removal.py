import numpy as np
import pytest
from hypothesis import given

from berteam_cli.optimizer.fitness import CaptainElo
from berteam_cli.optimizer.removal import above_neighbours, nearest
from tests.strategies import floats


def test_by_hand():
    # Radius 1: means 2, 3, 5, 6 of neighbours, so -1, 0, 0, 1 above them; the last is alone.
    fitness, behaviour = np.array([1.0, 3, 5, 7]), np.array([0.0, 0.5, 1.5, 2])
    np.testing.assert_allclose(above_neighbours(fitness, behaviour[:, np.newaxis], 1.0), [-1, 0, 0, 1])
    np.testing.assert_array_equal(nearest(np.append(behaviour, 9)[:, np.newaxis]), [0.5, 0.5, 0.5, 0.5, 7])


def test_exactly_at_the_radius_is_a_neighbour():
    np.testing.assert_allclose(above_neighbours(np.array([0.0, 1]), np.array([[0.0], [1.0]]), 1.0), [-0.5, 0.5])


def test_who_was_never_measured_is_unique():
    np.testing.assert_allclose(nearest(np.array([[np.nan], [0.0], [0.1]])), [np.inf, 0.1, 0.1])
    np.testing.assert_array_equal(nearest(np.array([[2.0]])), [np.inf])


@given(floats(5), floats(5))
def test_when_all_are_near_it_is_coevolution(fitness, behaviour):
    """O9: with an infinite radius the chances are those of plain fitness."""
    rule = CaptainElo(32, 0)
    better = above_neighbours(fitness, behaviour[:, np.newaxis], np.inf)
    np.testing.assert_allclose(better, fitness - fitness.mean(), atol=1e-12)
    np.testing.assert_allclose(rule.removal_chances(better), rule.removal_chances(fitness))


@given(floats(6, 0, 3))
def test_nearest_is_the_nearest_other(behaviour):
    for k, distance in enumerate(nearest(behaviour[:, np.newaxis])):
        assert distance == np.abs(np.delete(behaviour, k) - behaviour[k]).min()


def test_removal_needs_a_rule_of_its_own_fitness():
    assert CaptainElo(32, 0).removal_chances(np.array([-1.0, 0, 0, 1]))[0] == pytest.approx(
        np.e / (np.e + 2 + 1 / np.e)
    )
