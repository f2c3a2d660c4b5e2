import numpy as np

from berteam_cli.selector.tally import no_games
from tests.strategies import outcomes

GAMES = outcomes([[[1, 0], [2, 2]], [[0, 1], [0, 1]], [[3, 0], [2, 2]]], [[1, 0], [0.5, 0.5], [0, 1]])


def test_only_listed_teams_count():
    tally = no_games(np.array([[0, 1], [4, 4]])).after(GAMES)
    np.testing.assert_array_equal(tally.points, [2, 0])
    np.testing.assert_array_equal(tally.games, [3, 0])
    np.testing.assert_allclose(tally.mean, [2 / 3, 0])


def test_all_teams_count():
    tally = no_games(np.zeros((0, 2), dtype=int)).after_all(GAMES).after_all(GAMES)
    np.testing.assert_array_equal(tally.teams, [[0, 1], [0, 3], [2, 2]])
    np.testing.assert_array_equal(tally.points, [4, 0, 2])
    np.testing.assert_array_equal(tally.games, [6, 2, 4])
