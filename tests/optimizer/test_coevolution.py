import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.optimizer.fixed import Fixed
from tests.optimizer.makers import RULE, coevolution, islands, policies_of, population
from tests.strategies import floats, played


@given(floats(9), st.integers(0, 2**32), st.integers(0, 4), st.integers(0, 4), st.booleans())
def test_generation(fitness, seed, most, elites, draw_protected):
    """O6: at most n_rem replaced, elites and young untouched, a child is its parent, on its own island."""
    places = islands(4, 5)
    ages = np.random.default_rng(seed).integers(0, 12, size=9)
    before = population(places, fitness, ages)
    optimizer = coevolution(places, replacements=most, elites=elites, draw_protected=draw_protected)
    after, replaced = optimizer.renew(before, np.random.default_rng(seed))
    assert len(replaced) <= most
    policies, expected = policies_of(places, after), list(range(9))
    gone = {x.removed for x in replaced}
    assert len(gone) == len(replaced)
    for x in replaced:
        island = places[x.island]
        members = range(island.first, island.first + island.size)
        assert x.removed in members
        assert x.parent in members
        assert ages[x.removed] > 5
        assert x.removed_age == ages[x.removed]
        as_fit = (fitness[island.members] >= fitness[x.removed]).sum() - 1
        assert as_fit >= elites  # no elite was removed
        assert after.age[x.removed] == 1  # born in this epoch, then one epoch older
        assert after.parent[x.removed] == x.parent
        expected[x.removed] = expected[x.parent]
        assert x.removed_fitness == pytest.approx(RULE.shown(fitness[x.removed]))
    np.testing.assert_array_equal(policies, expected)
    np.testing.assert_allclose(after.fitness, fitness[expected] - fitness[expected].mean(), atol=1e-12)
    stayed = [n for n in range(9) if n not in gone]
    np.testing.assert_array_equal(after.age[stayed], ages[stayed] + 1)
    np.testing.assert_array_equal(policies[stayed], stayed)
    assert after.fitness.mean() == pytest.approx(0, abs=1e-9)
    np.testing.assert_array_equal(before.age, ages)  # the population before is as it was


def test_the_least_fit_goes_and_the_fittest_is_cloned():
    places = islands(3)
    after, replaced = coevolution(places).renew(population(places, [50.0, 0, -50], 9), np.random.default_rng(0))
    assert [(x.removed, x.parent) for x in replaced] == [(2, 0)]
    np.testing.assert_array_equal(policies_of(places, after), [0, 1, 0])


def test_removal_chances_are_those_of_the_rule():
    places = islands(4)
    fitness = np.array([1.0, 0.5, 0, -0.5])
    counts = np.zeros(4)
    optimizer = coevolution(places)
    for seed in range(2000):
        _, replaced = optimizer.renew(population(places, fitness, 9), np.random.default_rng(seed))
        counts += np.bincount([x.removed for x in replaced], minlength=4)
    odds = np.append(0, np.exp(-fitness[1:]))  # the fittest is the elite
    others = 1 - np.exp(fitness) / np.exp(fitness).sum()  # the chance that the parent is somebody else
    np.testing.assert_allclose(counts / 2000, odds / odds.sum() * others, atol=0.035)


def test_who_is_drawn_as_its_own_parent_stays_as_it_is():
    places = islands(1)
    before = population(places, 0.0, 9)
    after, replaced = coevolution(places, elites=0).renew(before, np.random.default_rng(0))
    assert replaced == []
    np.testing.assert_array_equal(after.age, before.age + 1)


def test_a_protected_member_drawn_in_vain_costs_the_epoch_its_replacement():
    places = islands(3)
    young_and_unfit = population(places, [0.0, 50, -50], [9, 9, 3])
    assert coevolution(places, elites=0).renew(young_and_unfit, np.random.default_rng(0))[1] == []
    _, replaced = coevolution(places, elites=0, draw_protected=False).renew(young_and_unfit, np.random.default_rng(0))
    assert [x.removed for x in replaced] == [0]


def test_exactly_as_old_as_the_protection_is_protected():
    places = islands(2)
    assert coevolution(places).renew(population(places, [50.0, -50], 5), np.random.default_rng(0))[1] == []
    assert len(coevolution(places).renew(population(places, [50.0, -50], 6), np.random.default_rng(0))[1]) == 1


def test_replacements_are_shared_by_all_islands():
    places = islands(3, 3, 3)
    _, replaced = coevolution(places, replacements=5).renew(population(places, 0.0, 9), np.random.default_rng(1))
    assert len(replaced) == 5
    assert len({x.island for x in replaced}) == 3


@given(played())
def test_counters(games):
    places = islands(6)
    before = population(places, 0.0)
    after = Fixed(places, RULE).rate(before, games)
    for n in range(6):
        sides = (games.lineups.teams == n).any(axis=2)
        assert after.games[n] == sides.sum()
        assert after.captain_games[n] == (games.lineups.captains == n).sum()


def test_fixed_only_ages():
    places = islands(2, 2)
    optimizer = Fixed(places, RULE)
    before = population(places, [3.0, 1, 0, 0], 40)
    after, replaced = optimizer.renew(before, np.random.default_rng(0))
    assert replaced == []
    np.testing.assert_array_equal(after.age, 41)
    np.testing.assert_allclose(after.fitness, [2, 0, -1, -1])
