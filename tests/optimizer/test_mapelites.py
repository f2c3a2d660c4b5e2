import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.optimizer.aggression import opponents
from berteam_cli.optimizer.mapelites import MapElites
from tests.optimizer.makers import coevolution, islands, population
from tests.strategies import floats, outcomes

OTHERS = opponents((0, 1), 2)
USUAL = {
    **{"radius": 1.0, "opponents": OTHERS, "probe_games": 1, "project_every": 1, "lambda_growth": 1.0},
    **{"behaviours": ("aggression",), "scales": np.ones(1), "archive": None},
}


def mapelites(places, **settings):
    return coevolution(
        places,
        MapElites,
        **(USUAL | settings),
    )


def measured(places, fitness, behaviour, age=9):
    people = population(places, fitness, age)
    people.behaviour[:, 0] = behaviour
    people.stale[:] = False
    return people


@given(floats(6), floats(6, 0, 4), st.integers(0, 2**32))
def test_who_is_alone_is_never_removed(fitness, behaviour, seed):
    """O9: an isolated member is safe, whatever its fitness."""
    places = islands(6)
    _, replaced = mapelites(places, elites=0, replacements=6).renew(
        measured(places, fitness, behaviour), np.random.default_rng(seed)
    )
    for x in replaced:
        others = np.delete(behaviour, x.removed)
        assert (np.abs(others - behaviour[x.removed]) < 1).any()


@given(floats(6), floats(6, 0, 4), st.integers(0, 2**32))
def test_with_an_infinite_radius_it_is_coevolution(fitness, behaviour, seed):
    """O9: the same draws remove the same members."""
    places = islands(6)
    people = measured(places, fitness, behaviour)
    _, ours = mapelites(places, radius=np.inf).renew(people, np.random.default_rng(seed))
    _, plain = coevolution(places).renew(measured(places, fitness, behaviour), np.random.default_rng(seed))
    assert [(x.removed, x.parent) for x in ours] == [(x.removed, x.parent) for x in plain]


def test_an_island_of_loners_is_skipped():
    places = islands(3)
    _, replaced = mapelites(places).renew(measured(places, 0.0, [0.0, 2, 4]), np.random.default_rng(0))
    assert replaced == []


def test_exactly_at_the_radius_is_unique():
    places = islands(2)
    people = measured(places, 0.0, [1.0, 2.0])
    assert mapelites(places, elites=0).renew(people, np.random.default_rng(0))[1] == []
    assert mapelites(places, elites=0, radius=1.001).renew(people, np.random.default_rng(0))[1] != []


def test_only_the_crowd_competes():
    # 0 and 1 are alike; 2 is far away and the least fit of all, and stays. 3 leads.
    places = islands(4)
    for seed in range(20):
        _, replaced = mapelites(places).renew(
            measured(places, [50.0, -50, -90, 99], [1.0, 1.1, 5, 9]), np.random.default_rng(seed)
        )
        assert [x.removed for x in replaced] == [1]


def test_where_all_are_unique_lambda_grows_until_the_nearest_are_not():
    # Gaps of 2 and 3: with 1, 1.5, 2.25 the first two meet; member 2 stays alone, and 0 is the elite.
    places = islands(3)
    people = measured(places, [50.0, 0, -50], [0.0, 2, 5])
    for seed in range(10):
        _, replaced = mapelites(places, lambda_growth=1.5).renew(people, np.random.default_rng(seed))
        assert [x.removed for x in replaced] == [1]


def test_lambda_does_not_grow_over_who_was_never_measured():
    places = islands(2)
    people = measured(places, 0.0, [np.nan, 1.0])
    assert mapelites(places, lambda_growth=2.0).renew(people, np.random.default_rng(0))[1] == []


def test_projection_comes_every_so_many_epochs():
    places = islands(2)
    people = population(places, 0.0, 9)
    counted = []

    def probe(population, teams, others, each):
        counted.append(len(teams))
        return outcomes(np.stack([teams, others], axis=1), np.full((len(teams), 2), 0.5))

    for number in range(1, 7):
        mapelites(places, project_every=3).project(people, number, probe)
    assert counted == [6, 6]  # epochs 3 and 6; two members against three teams


def test_projection_measures_whose_policy_changed_where_somebody_is_old_enough():
    places = islands(2, 2)
    people = population(places, 0.0, [9, 0, 5, 5])  # nobody of the second island is older than 5
    people.stale[:] = [True, False, True, True]
    asked = []

    def probe(population, teams, others, each):
        assert each == 6
        asked.append((teams, others))
        events = np.zeros((len(teams), 2, 4))
        events[:, 0, 0] = others[:, 0]  # one capture if the opponents' first is policy 1
        return outcomes(np.stack([teams, others], axis=1), np.full((len(teams), 2), 0.5), events=events)

    after = mapelites(places, probe_games=2).project(people, 1, probe)
    teams, others = asked[0]
    np.testing.assert_array_equal(teams, np.zeros((6, 2)))  # member 0 twice, each of three teams twice
    np.testing.assert_array_equal(others, np.repeat(OTHERS, 2, axis=0))
    assert after.behaviour[0, 0] == (1 + 1 + 3) / 3
    assert np.isnan(after.behaviour[1:]).all()
    np.testing.assert_array_equal(after.stale, [False, False, True, True])
    assert mapelites(places).project(after, 2, probe) is after  # nothing is due now
