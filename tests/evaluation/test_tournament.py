import numpy as np
import pytest

from berteam_cli.acting import fixed_policies
from berteam_cli.env.rps import Rps
from berteam_cli.evaluation.tournament import plays_every_order, schedule, tournament
from berteam_cli.games import Games
from berteam_cli.selector.base import unordered_teams
from berteam_cli.workers import Workers


def rps(team_size, sides=2):
    return Games(Rps(team_size, sides), Workers(1))


def test_rock_paper_scissors_is_a_cycle_of_equals():
    standings = tournament(rps(1), fixed_policies(range(3)), unordered_teams(3, 1), 4, 0)
    won, drawn, lost = standings.results.sum(axis=0)
    np.testing.assert_array_equal(won, 4 * np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]))  # paper beats rock ...
    np.testing.assert_array_equal(lost, won.T)
    assert not drawn.any()
    np.testing.assert_allclose(standings.elos, 1000, atol=1e-6)


def test_sides_are_kept_apart():
    standings = tournament(rps(1), fixed_policies(range(3)), unordered_teams(3, 1), 3, 0)
    played = standings.results.sum(axis=1)
    np.testing.assert_array_equal(played[0] + played[1], 3 * (1 - np.eye(3)))
    assert played[0, 0, 1] == played[1, 1, 0] == 2  # of three games two with the first team as side 0


@pytest.mark.parametrize(("games_per_pair", "distinct"), [(8, 4), (40, 4), (3, 2)])
def test_orders_of_the_members(games_per_pair, distinct):
    teams = np.array([[0, 1], [2, 3]])
    rng = np.random.default_rng(0)
    ours, theirs = schedule(teams, np.array([0]), np.array([1]), games_per_pair, 2, rng)
    assert ours.shape == (games_per_pair, 2)
    assert (np.sort(ours) == [0, 1]).all()
    assert (np.sort(theirs) == [2, 3]).all()
    lineups = {(*a, *b) for a, b in zip(ours, theirs, strict=True)}
    if games_per_pair >= 8:
        assert len(lineups) == distinct
    for k in range(0, games_per_pair - 1, 2):  # the same order once from either side
        np.testing.assert_array_equal(ours[k], ours[k + 1])


def test_what_is_left_of_a_round_of_all_orders_goes_to_other_orders_for_each_pair():
    teams = np.arange(400).reshape(200, 2)
    first, second = np.arange(0, 200, 2), np.arange(1, 200, 2)
    ours, theirs = schedule(teams, first, second, 12, 2, np.random.default_rng(0))
    crossed = np.stack([np.diff(x, axis=1)[:, 0] < 0 for x in (ours, theirs)], axis=1).reshape(100, 12, 2)
    assert (crossed[:, :8:2] == [[0, 0], [0, 1], [1, 0], [1, 1]]).all()
    left = crossed[:, 8::2] @ [2, 1]  # (100, 2)
    assert (left[:, 0] != left[:, 1]).all()
    counts = np.bincount(left.ravel(), minlength=4)
    assert np.abs(counts - 50).max() < 4 * np.sqrt(200 / 4 * 3 / 4)


@pytest.mark.parametrize(("games_per_pair", "alike"), [(8, True), (10, False), (4, False), (24, True)])
def test_every_order_is_played_alike_in_whole_rounds_only(games_per_pair, alike):
    assert plays_every_order(2, np.array([[0, 1], [2, 3]]), games_per_pair) is alike
    assert not plays_every_order(2, np.arange(26).reshape(2, 13), games_per_pair)


def test_large_teams_stand_in_drawn_orders():
    teams = np.arange(10).reshape(2, 5)
    ours, _ = schedule(teams, np.array([0]), np.array([1]), 20, 2, np.random.default_rng(0))
    assert (np.sort(ours) == np.arange(5)).all()
    assert len({tuple(team) for team in ours}) > 5


def test_among_three_sides_either_team_stands_alone_on_each():
    standings = tournament(rps(1, 3), fixed_policies(range(3)), unordered_teams(3, 1), 6, 0)
    np.testing.assert_array_equal(
        standings.outcomes.lineups.teams[:6, :, 0], [[0, 1, 1], [1, 0, 0], [1, 0, 1], [0, 1, 0], [1, 1, 0], [0, 0, 1]]
    )
    # Paper beats two rocks alone, and two papers share the win over one: three games of each kind.
    np.testing.assert_array_equal(standings.results.sum(axis=1), [1 - np.eye(3)] * 3)
    won, drawn, lost = standings.results.sum(axis=0)
    np.testing.assert_array_equal(won, 3 * np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]))
    np.testing.assert_array_equal(lost, won.T)
    assert not drawn.any()
    np.testing.assert_array_equal(standings.record, 2 * standings.results.sum(axis=0))
    np.testing.assert_allclose(standings.elos, 1000, atol=1e-6)


def test_an_order_of_the_members_is_kept_for_all_ways_to_hold_three_sides():
    ours, theirs = schedule(np.array([[0, 1], [2, 3]]), np.array([0]), np.array([1]), 24, 6, np.random.default_rng(0))
    lineups = [(*a, *b) for a, b in zip(ours, theirs, strict=True)]
    assert len(set(lineups)) == 4
    assert all(len(set(lineups[k : k + 6])) == 1 for k in range(0, 24, 6))


def test_the_better_team_of_three_sides_has_the_higher_elo():
    """Two different hands beat two of the three pairs of equal hands, among three sides too."""
    teams = unordered_teams(3, 2)
    standings = tournament(rps(2, 3), fixed_policies(range(3)), teams, 12, 0)
    different = teams[:, 0] != teams[:, 1]
    np.testing.assert_allclose(standings.elos[different], standings.elos[different][0], atol=1e-3)
    assert standings.elos[different].min() > standings.elos[~different].max() + 50
    won, drawn, lost = standings.record
    np.testing.assert_array_equal(won + drawn + lost, 12 * (1 - np.eye(6)))
    np.testing.assert_array_equal(won, lost.T)
