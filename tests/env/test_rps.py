import numpy as np

from berteam_cli.acting import fixed_policies
from berteam_cli.env.rps import Rps
from berteam_cli.games import Games, pairings
from berteam_cli.workers import Workers
from rps import HANDS, duels_won
from tests.makers import random_networks


def test_who_beats_whom():
    rock, paper, scissors = (np.array([HANDS.index(x)]) for x in ("rock", "paper", "scissors"))
    assert duels_won(paper, rock) == duels_won(rock, scissors) == duels_won(scissors, paper) == 1
    assert duels_won(rock, paper) == duels_won(scissors, rock) == duels_won(paper, scissors) == 0
    assert duels_won(rock, rock) == 0


def test_teams_by_hand():
    # Rock and paper against two scissors: rock wins twice, paper loses twice.
    assert duels_won(np.array([0, 1]), np.array([2, 2])) == 2
    assert duels_won(np.array([2, 2]), np.array([0, 1])) == 2


def test_games_and_what_they_pay():
    games = Games(Rps(2), Workers(1))
    lineups = pairings(np.array([[0, 0], [0, 1]]), np.array([[2, 1], [2, 2]]))
    outcomes, seen = games.play(fixed_policies(range(3)), lineups, 0, record=True)
    np.testing.assert_array_equal(outcomes.scores, [[0.5, 0.5], [0.5, 0.5]])
    np.testing.assert_array_equal(seen.rewards[:, :, 0], 0)
    won = pairings(np.array([[1, 1]]), np.array([[0, 1]]))
    outcomes, seen = games.play(fixed_policies(range(3)), won, 0, record=True)
    np.testing.assert_array_equal(outcomes.scores, [[1, 0]])
    np.testing.assert_array_equal(seen.rewards[0, :, 0], [0.5, 0.5, -0.5, -0.5])
    np.testing.assert_array_equal(seen.actions[0, :, 0], [1, 1, 0, 1])
    assert seen.terminated[0]


def test_networks_play_too():
    games = Games(Rps(3), Workers(2))
    rng = np.random.default_rng(0)
    lineups = pairings(rng.integers(5, size=(50, 3)), rng.integers(5, size=(50, 3)))
    outcomes, _ = games.play(random_networks(5, games.env), lineups, 1)
    np.testing.assert_array_equal(outcomes.scores.sum(axis=1), 1)
