import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.selector.ascent import climbed


def test_a_sum_is_climbed_to_its_top():
    worth = np.array([0.0, 3, 1, 2])
    allowed = np.array([[1, 1, 1, 1], [1, 0, 1, 1], [1, 0, 1, 0]], dtype=bool)
    ends = climbed(np.array([[0, 0, 0], [3, 2, 2]]), lambda teams: worth[teams].sum(axis=1), allowed)
    np.testing.assert_array_equal(ends, [[1, 3, 2]])  # from wherever it starts, and each team once


@given(st.integers(0, 2**32))
def test_no_single_change_is_better_where_a_climb_ends(seed):
    rng = np.random.default_rng(seed)
    table = rng.normal(size=(4, 4))
    table = table + table.T
    starts = rng.integers(4, size=(3, 2))

    def value(teams):
        return table[teams[:, 0], teams[:, 1]]

    for end in climbed(starts, value, np.ones((2, 4), dtype=bool)):
        assert table[end[0], end[1]] >= max(table[end[0]].max(), table[:, end[1]].max()) - 1e-12
