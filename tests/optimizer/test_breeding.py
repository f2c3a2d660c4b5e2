"""What a child gets from its parents when it takes a place."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.learner.traits import TRAITS
from berteam_cli.optimizer.breeding import Breeding
from berteam_cli.optimizer.perturbing import Perturbation, reward_factors
from berteam_cli.outcomes import NOBODY
from berteam_cli.population import Island, founded
from tests.optimizer.makers import COPIES, coevolution
from tests.optimizer.test_health import DQN, PPO, games

NONE = COPIES.perturbation
ALL = Perturbation((2.0, 4.0, 5.0), 1.5, ("a", "b", "c"), (0, 2))


def people_of(learner, terms=0, size=4):
    """An island on which the first is by far the fittest, and the last by far the least fit."""
    places = (Island("main", 0, size, learner),)
    people = founded(places, 0.0, np.random.default_rng(0), terms)
    people.fitness[:] = np.linspace(90, -90, size)
    people.age[:] = 9
    people.stale[:] = False
    return places, people


def bred(learner, breeding, seed=0, terms=0):
    places, people = people_of(learner, terms)
    before = [x.clone() for x in learner.genes(people.minds[0])]
    after, replaced = coevolution(places, breeding=breeding).renew(people, np.random.default_rng(seed))
    assert [(x.removed, x.parent) for x in replaced] == [(3, 0)]
    return before, after, replaced[0]


@given(st.integers(0, 2**32))
def test_each_setting_is_the_parents_times_its_factor_or_over_it(seed):
    traits, pay = np.array([0.01, 0.1, 0.9]), np.array([1.0, 3.0, 2.0])
    own, paid = ALL.child(traits, pay, np.random.default_rng(seed))
    assert own[0] in (0.01 * 2, 0.01 / 2)
    assert own[1] in (0.1 * 4, 0.1 / 4)
    assert own[2] in (1 - (1 - 0.9) * 5, 1 - (1 - 0.9) / 5)
    assert paid[0] in (1.5, 1 / 1.5)
    assert paid[1] == 3  # it has no weight
    assert paid[2] in (3.0, 2 / 1.5)
    np.testing.assert_array_equal(traits, [0.01, 0.1, 0.9])


def test_up_and_down_are_as_likely_and_do_not_depend_on_each_other():
    rng = np.random.default_rng(0)
    ups = np.array([ALL.child(np.array([1.0, 1, 0.5]), np.ones(3), rng)[0][:2] > 1 for _ in range(2000)])
    np.testing.assert_allclose(ups.mean(axis=0), 0.5, atol=0.04)
    assert abs(np.corrcoef(ups.T)[0, 1]) < 0.08


def test_settings_stay_in_the_range_of_the_schema():
    rng, wild = np.random.default_rng(0), Perturbation((100.0, 100.0, 100.0), 100.0, ("a",), (0,))
    traits, pay = np.array([[1e-3, 0.0, 0.5], [1e9, 1e9, 0.0]]), np.ones((2, 1))
    for _ in range(400):
        for k in range(2):
            traits[k], pay[k] = wild.child(traits[k], pay[k], rng)
        assert (traits[:, 0] > 0).all()
        assert (traits[:, :2] <= 1e9).all()
        assert ((traits[:, 2] >= 0) & (traits[:, 2] <= 1)).all()
    assert traits[0, 1] == 0


def test_what_a_learner_has_not_stays_nothing():
    own, _ = ALL.child(np.array([0.1, np.nan, 0.9]), np.ones(3), np.random.default_rng(0))
    np.testing.assert_array_equal(np.isnan(own), [False, True, False])


def test_a_child_gets_its_parents_settings_and_nobody_else_changes():
    places, people = people_of(PPO, terms=3)
    people.traits[:, 0] = [0.1, 0.2, 0.3, 0.4]
    people.pay[0] = [2.0, 1, 1]
    before = people.traits.copy()
    kept, _ = coevolution(places).renew(people, np.random.default_rng(0))
    np.testing.assert_array_equal(kept.traits, before[[0, 1, 2, 0]])
    np.testing.assert_array_equal(kept.pay[3], [2, 1, 1])
    breeding = replace(COPIES, perturbation=ALL)
    moved, _ = coevolution(places, breeding=breeding).renew(people, np.random.default_rng(0))
    np.testing.assert_array_equal(moved.traits[:3], before[:3])
    assert moved.traits[3, 0] in (0.2, 0.05)
    assert moved.pay[3, 0] in (3.0, 2 / 1.5)
    np.testing.assert_array_equal(people.traits, before)
    assert not moved.stale.any()  # its policy is its parent's


def test_own_settings_are_those_a_member_learns_by():
    places, people = people_of(PPO)
    moving = replace(COPIES, perturbation=replace(NONE, factors=(1.2, 1.0, 1.0)))
    people.traits[1, TRAITS.index("learning_rate")] = 0.05
    weights = []
    for breeding, learner in ((moving, PPO), (COPIES, PPO), (COPIES, replace(PPO, learning_rate=0.05))):
        island = (replace(places[0], learner=learner),)
        people = replace(people, minds=(learner.init(4, np.random.default_rng(0)),))
        after, _, _ = coevolution(island, breeding=breeding).train(people, games(1), np.random.default_rng(1))
        weights.append(after.minds[0].trained.weights)
    np.testing.assert_array_equal(weights[0][[0, 2, 3]], weights[1][[0, 2, 3]])
    np.testing.assert_array_equal(weights[0][1], weights[2][1])
    assert (weights[1][1] != weights[2][1]).any()


@pytest.mark.parametrize("learner", [PPO, DQN], ids=["ppo", "dqn"])
def test_a_child_of_one_parent_is_a_copy_and_a_mutant_is_not(learner):
    before, after, record = bred(learner, COPIES)
    assert torch_equal(learner, after, 3, before, 0)
    assert record.second_parent == NOBODY
    before, after, record = bred(learner, Breeding(NONE, 0.5, 0.0))
    genes = learner.genes(after.minds[0])
    assert (genes[0][3] != before[0][0]).any()
    assert (genes[0][:3] == before[0][:3]).all()
    np.testing.assert_array_equal(after.stale, [False, False, False, True])


@pytest.mark.parametrize("learner", [PPO, DQN], ids=["ppo", "dqn"])
def test_a_child_of_two_has_layers_of_both_even_of_whom_it_replaces(learner):
    seconds, mixed = set(), 0
    for seed in range(60):
        places, people = people_of(learner)
        people.fitness[:] = [0.1, 0, 0, 0]
        before = [x.clone() for x in learner.genes(people.minds[0])]
        after, replaced = coevolution(places, breeding=Breeding(NONE, 0.0, 1.0)).renew(
            people, np.random.default_rng(seed)
        )
        if not replaced:  # somebody was drawn as its own parent
            continue
        (record,) = replaced
        genes = learner.genes(after.minds[0])
        for layer in learner.spans:
            whose = [
                parent
                for parent in (record.parent, record.second_parent)
                if all((x[record.removed, layer] == y[parent, layer]).all() for x, y in zip(genes, before, strict=True))
            ]
            assert whose
            mixed += whose == [record.second_parent]
        seconds.add(record.second_parent == record.removed)
        assert after.stale[record.removed]
    assert seconds == {True, False}
    assert mixed > 20


def test_crossover_comes_as_often_as_told():
    breeding, rng = Breeding(NONE, 0.0, 0.3), np.random.default_rng(0)
    members, chances = np.array([5, 6]), np.array([0.9, 0.1])
    drawn = np.array([breeding.second(members, chances, rng) for _ in range(4000)])
    assert (drawn != NOBODY).mean() == pytest.approx(0.3, abs=0.03)
    assert (drawn[drawn != NOBODY] == 5).mean() == pytest.approx(0.9, abs=0.03)


def test_what_is_off_draws_nothing():
    rng = np.random.default_rng(0)
    assert COPIES.second(np.arange(3), np.full(3, 1 / 3), rng) == NOBODY
    NONE.child(np.ones(3), np.ones(0), rng)
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


def test_factors_in_words():
    assert reward_factors(("a", "b", "c"), np.array([1.2, 1.0, 1 / 1.2])) == "a=1.2 c=0.833333"
    assert reward_factors(("a",), np.array([1.2 / 1.2])) == ""
    assert reward_factors((), np.ones(0)) == ""


def torch_equal(learner, population, child, before, parent):
    genes = learner.genes(population.minds[0])
    return all((x[child] == y[parent]).all() for x, y in zip(genes, before, strict=True))
