import numpy as np

from berteam_cli.optimizer.aggression import aggression, opponents
from tests.strategies import outcomes


def test_by_hand():
    # captures, grabs, tags, wall hits of side 0 and side 1
    events = [[[1, 2, 1, 5], [0, 0, 3, 9]], [[0, 0, 4, 0], [1, 1, 0, 0]], [[0, 0, 0, 0], [0, 0, 0, 0]]]
    games = outcomes(np.zeros((3, 2, 2)), np.full((3, 2), 0.5), events=events)
    np.testing.assert_allclose(aggression(games), [(1 + 3 + 2 + 3) / 2, 1 / 5, 1])


def test_all_opponents_of_three_sides_count():
    events = [[[1, 2, 1, 0], [0, 0, 3, 0], [2, 2, 1, 0]]]
    games = outcomes(np.zeros((1, 3, 2)), np.full((1, 3), 1 / 3), events=events)
    np.testing.assert_allclose(aggression(games), [(1 + 3 + 2 + 4) / 2])


def test_opponents_are_all_unordered_teams():
    teams = opponents((0, 2, 3, 5), 2)
    assert len(teams) == 10
    assert {tuple(t) for t in teams} == {(a, b) for a in (0, 2, 3, 5) for b in (0, 2, 3, 5) if a <= b}
