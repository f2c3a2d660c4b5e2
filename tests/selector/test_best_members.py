from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.selector.base import Field
from berteam_cli.selector.best_members import BestMembers, fittest
from tests.selector.matrix_games import hands, played

EVERYBODY = np.ones((2, 4), dtype=bool)


def test_the_best_by_hand():
    np.testing.assert_array_equal(fittest(np.array([0.1, 3, -1, 2]), EVERYBODY), [1, 3])
    np.testing.assert_array_equal(fittest(np.array([1.0, 0, 1, 1]), EVERYBODY), [0, 2])


def test_everybody_where_they_may_stand():
    allowed = np.array([[1, 1, 0, 0], [0, 1, 0, 1]], dtype=bool)
    np.testing.assert_array_equal(fittest(np.array([0, 9, 0, 1]), allowed), [1, 3])
    np.testing.assert_array_equal(fittest(np.array([0, 9, 0, -1]), allowed), [0, 1])


@given(st.integers(0, 2**32), st.integers(1, 4), st.integers(1, 5))
def test_nobody_does_better_with_as_few_doubles(seed, size, members):
    rng = np.random.default_rng(seed)
    allowed = rng.random((size, members)) < 0.5
    allowed[np.arange(size), rng.integers(members, size=size)] = True
    fitness = rng.integers(-3, 4, size=members) / 2  # many ties
    team = fittest(fitness, allowed)
    assert allowed[np.arange(size), team].all()
    others = [
        (len(set(x)), fitness[list(x)].sum(), [-m for m in sorted(x)])
        for x in product(*(np.flatnonzero(row) for row in allowed))
    ]
    different, best, _ = max(others)
    assert len(set(team)) == different
    if different == size:
        assert fitness[team].sum() == best
        # Of equally fit ones the first: no other best team gives a fitness to a lower index.
        swaps = [(m, n) for m in team for n in range(m) if n not in team and fitness[n] == fitness[m]]
        for m, n in swaps:
            rest = sorted([x for x in team if x != m] + [n])
            assert not any(sorted(x) == rest for x in product(*(np.flatnonzero(row) for row in allowed)))


def test_a_selector_follows_the_fitness():
    selector = BestMembers(Field(np.zeros(3, dtype=int), 2), 0.2)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    assert len(selector.distribution(state).teams) == 6  # before anything is known
    games = played(selector, state, hands, 8, rng)
    after, _ = selector.learn(state, games, None, np.array([0.5, -1, 2]), rng)
    np.testing.assert_array_equal(selector.distribution(after).teams, [[0, 2]])
    chosen = np.sort(played(selector, after, hands, 4000, rng).lineups.teams.reshape(-1, 2), axis=1)
    assert (chosen == [0, 2]).all(axis=1).mean() == pytest.approx(0.8 + 0.2 * 2 / 9, abs=0.02)
    np.testing.assert_array_equal(selector.restored(selector.tensors(after)), after)
    np.testing.assert_array_equal(state, 0)  # the state before is as it was
