import numpy as np

from berteam_cli.rating.counts import counts, independent


def test_copies_are_counted_with_the_first_of_them():
    # Two teams, one opponent, four games each. Of the first team the last two games are copies of its first two.
    kinds = np.array([0, 2, 0, 2, 1, 1, 0, 1])
    clusters = np.array([0, 1, 0, 1, 4, 5, 6, 4])
    found = counts(kinds, clusters, (2, 1, 4), np.array([[True], [False]]))
    np.testing.assert_array_equal(found.copies, [1, 2])
    np.testing.assert_array_equal(found.different[:, 0, 0], [[0, 1], [0, 0], [0, 1]])  # a win and a loss, twice each
    np.testing.assert_array_equal(found.different[:, 1, 0], [[1, 0], [1, 1], [0, 0]])
    np.testing.assert_array_equal(found.results[:, :, 0], [[2, 1], [0, 3], [2, 0]])
    # Of n games of the first team only n / 2 are different: the variance doubles. The other has games of 2, 1, 1.
    np.testing.assert_allclose(found.repetition, [2, 6 / 4])


def test_independent_games_are_no_copies():
    found = independent(*np.arange(6).reshape(3, 2, 1))
    np.testing.assert_array_equal(found.results, np.arange(6).reshape(3, 2, 1))
    np.testing.assert_array_equal(found.repetition, 1)
    assert not found.settled.any()
