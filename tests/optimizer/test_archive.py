"""Cells of behaviours, and who is safe in them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.optimizer.archive import NOWHERE, grid, occupied, quality, voronoi
from berteam_cli.outcomes import NOBODY
from tests.optimizer.makers import islands
from tests.optimizer.test_mapelites import mapelites, measured
from tests.strategies import floats

LOW, HIGH = np.array([0.0, 0.0]), np.array([4.0, 1.0])
PLAIN = grid(LOW, HIGH, np.array([4, 2]))


def test_the_cells_of_a_grid_by_hand():
    points = [[0, 0], [0.99, 0.49], [1, 0.5], [3.99, 1], [4, 1], [9, -3], [-1, 2], [np.nan, 0.5]]
    np.testing.assert_array_equal(PLAIN.cells(np.array(points)), [0, 0, 3, 7, 7, 6, 1, NOWHERE])
    np.testing.assert_allclose(PLAIN.centres[[0, 1, 2, 7]], [[0.5, 0.25], [0.5, 0.75], [1.5, 0.25], [3.5, 0.75]])


@pytest.mark.parametrize(
    ("low", "high", "bins", "value", "cell"), [(0, 1, 100, 0.29, 29), (0, 4, 100, 1.16, 29), (1, 4, 10, 3.4, 8)]
)
def test_a_border_belongs_to_the_upper_cell_however_it_is_rounded(low, high, bins, value, cell):
    strip = grid(np.array([low]), np.array([high]), np.array([bins]))
    assert list(strip.cells(np.array([[value], [value - 1e-6]]))) == [cell, cell - 1]


@given(st.lists(st.tuples(st.floats(0, 4), st.floats(0, 1)), min_size=1, max_size=20))
def test_a_cell_of_a_grid_is_that_of_the_nearest_centre(points):
    points = np.array(points)
    shares = (points / HIGH)[:, np.newaxis] - PLAIN.centres / HIGH
    apart = (shares * [4, 2]).__abs__().max(axis=2)
    assert (apart[np.arange(len(points)), PLAIN.cells(points)] <= 0.5 + 1e-9).all()


def test_a_voronoi_cell_is_that_of_the_nearest_centre_in_shares_of_the_ranges():
    made = voronoi(LOW, HIGH, 12, np.random.default_rng(1))
    points = np.random.default_rng(2).random((200, 2)) * [6, 1.5] - [1, 0.25]
    apart = np.linalg.norm((points[:, np.newaxis] - made.centres) / (HIGH - LOW), axis=2)
    np.testing.assert_array_equal(made.cells(points), apart.argmin(axis=1))
    assert made.cells(np.array([[1.0, np.nan]])) == [NOWHERE]


def test_voronoi_centres_are_seeded_and_spread():
    first, same, other = (voronoi(LOW, HIGH, 16, np.random.default_rng(seed)).centres for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, same)
    assert (first != other).any()
    assert ((first > LOW) & (first < HIGH)).all()
    uniform = np.random.default_rng(0).random((20_000, 2)) * HIGH
    shares = np.bincount(voronoi(LOW, HIGH, 16, np.random.default_rng(1)).cells(uniform), minlength=16) / 20_000
    assert shares.min() > 0.4 / 16  # no cell is much smaller
    assert shares.max() < 2 / 16


def test_coverage_and_quality_by_hand():
    cells, fitness = np.array([2, 2, 5, NOWHERE, 2]), np.array([900.0, 1100, -50, 9999, 1100])
    elites = PLAIN.elites(cells, fitness)
    np.testing.assert_array_equal(elites, [NOBODY, NOBODY, 1, NOBODY, NOBODY, 2, NOBODY, NOBODY])  # the first of equals
    assert occupied(elites).mean() == 2 / 8
    assert quality(elites, fitness) == 1100  # below 0 counts as 0
    assert quality(np.full(8, NOBODY), fitness) == 0


@given(floats(8), floats(16, 0, 1), st.integers(0, 2**32), st.integers(1, 6))
def test_the_fittest_of_a_cell_is_never_replaced(fitness, behaviour, seed, most):
    places, archive = islands(8), grid(np.zeros(2), np.ones(2), np.array([2, 2]))
    optimizer = mapelites(
        places, elites=0, replacements=most, behaviours=("advance", "spread"), scales=np.ones(2), archive=archive
    )
    people = measured(places, fitness, 0.0)
    people.behaviour[:, 1:] = behaviour.reshape(8, 2)
    cells = archive.cells(people.behaviour[:, 1:])
    _, replaced = optimizer.renew(people, np.random.default_rng(seed))
    for x in replaced:
        rivals = fitness[cells == cells[x.removed]]
        assert len(rivals) > 1
        assert fitness[x.removed] < rivals.max() or (rivals == rivals.max()).sum() > 1
    crowded = 8 - len(set(cells))
    assert len(optimizer.removable(people, places[0])[0]) == crowded
    assert len(replaced) <= min(most, crowded)  # fewer where somebody is drawn as its own parent


def test_who_is_far_behind_the_best_of_its_cell_goes_first():
    places, archive = islands(5), grid(np.zeros(1), np.full(1, 2.0), np.array([2]))
    optimizer = mapelites(places, elites=0, archive=archive)
    people = measured(places, [2.0, 0.0, -1.0, -5.0, np.log(3) - 5], [0.1, 0.2, np.nan, 1.5, 1.7])
    members, chances = optimizer.removable(people, places[0])
    np.testing.assert_array_equal(members, [1, 3])  # 2 was never measured, 0 and 4 are the best of their cells
    odds = np.array([np.exp(2), 3])
    np.testing.assert_allclose(chances, odds / odds.sum())


def test_two_behaviours_are_near_by_euclid_after_scaling():
    places = islands(3)
    people = measured(places, 0.0, [0.0, 3.0, 0.0])
    people.behaviour[:, 1] = [0.0, 0.4, 1.0]
    settings = {"elites": 0, "behaviours": ("aggression", "advance"), "scales": np.array([1.0, 0.1])}
    for radius, crowded in ((4.9, []), (5.1, [0, 1])):  # 3 and 4 are 5 apart; the third is 10 and 6.7 away
        members, _ = mapelites(places, radius=radius, **settings).removable(people, places[0])
        np.testing.assert_array_equal(members, crowded)


@pytest.mark.parametrize("bins", [[1], [10]])
def test_one_behaviour_is_a_strip(bins):
    archive = grid(np.zeros(1), np.ones(1), np.array(bins))
    np.testing.assert_array_equal(archive.cells(np.array([[0.0], [0.95], [1.0]])), [0, bins[0] - 1, bins[0] - 1])
