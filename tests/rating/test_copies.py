"""Which games are copies, told from who plays, and seen in what the games come to."""

import numpy as np
import pytest

from berteam_cli.acting import GREEDY, fixed_policies, joined
from berteam_cli.env.rps import Rps
from berteam_cli.games import pairings
from berteam_cli.rating.copies import chancy_teams, clusters, draws_actions
from tests.makers import mctf, random_networks


def test_the_same_players_on_the_same_places_play_the_same_game():
    games, acting = mctf(), fixed_policies(range(7))
    blue, red = np.array([[2, 5], [5, 2], [2, 5], [3, 4], [2, 5]]), np.array([[3, 4], [3, 4], [3, 4], [2, 5], [3, 4]])
    lineups = pairings(blue, red)
    found = clusters(games.env, acting, lineups.teams)
    np.testing.assert_array_equal(found, [0, 1, 0, 3, 0])  # another order and the other side are other games
    outcomes, _ = games.play(acting, lineups, 1)
    for name in ("scores", "steps", "events"):
        values = getattr(outcomes, name)
        np.testing.assert_array_equal(values, values[found])


def test_who_draws_actions_never_plays_the_same_game_twice():
    games, acting = mctf(), fixed_policies(range(7))
    named = games.env.fixed_policies
    random = [k for k, name in enumerate(named) if name in ("random", "combined_medium")]
    sure = [k for k in range(7) if k not in random]
    assert random
    lineups = pairings(np.array([[random[0], sure[0]]] * 3), np.array([[sure[1], sure[2]]] * 3))
    np.testing.assert_array_equal(clusters(games.env, acting, lineups.teams), [0, 1, 2])
    teams = np.array([[random[0], sure[0]], sure[:2], [random[0]] * 2])
    np.testing.assert_array_equal(chancy_teams(games.env, acting, teams), [True, False, True])
    outcomes, _ = games.play(acting, pairings(np.full((40, 2), random[0]), np.full((40, 2), sure[0])), 1)
    assert len(np.unique(outcomes.events.reshape(40, -1), axis=0)) > 1


@pytest.mark.parametrize("profile", ["pyquaticus-2024-06", "pyquaticus-2025-11"])
def test_the_fixed_policies_that_draw_are_those_whose_games_differ(profile):
    games = mctf(profile=profile)
    names = games.env.fixed_policies
    acting = fixed_policies(range(len(names)))
    members = np.repeat(np.arange(len(names)), 12)
    differ = np.zeros(len(names), dtype=bool)
    for opponent in ("attack_easy", "attack_hard"):
        others = np.full((len(members), 2), names.index(opponent))
        outcomes, _ = games.play(acting, pairings(np.stack([members, members], axis=1), others), 1)
        kinds = [len(np.unique(x.reshape(12, -1), axis=0)) for x in outcomes.events.reshape(len(names), 12, -1)]
        differ |= np.array(kinds) > 1
    np.testing.assert_array_equal(differ, draws_actions(games.env, acting))


@pytest.mark.parametrize("starts", ["quarter", "random"])
def test_random_starts_leave_no_copies(starts):
    games, acting = mctf(starts=starts), fixed_policies(range(7))
    lineups = pairings(np.array([[2, 5]] * 4), np.array([[3, 4]] * 4))
    assert len(np.unique(clusters(games.env, acting, lineups.teams))) == (4 if starts == "random" else 1)
    outcomes, _ = games.play(acting, lineups, 1)
    assert (len(np.unique(outcomes.steps)) > 1) == (starts == "random")


def test_noisy_networks_draw_and_greedy_ones_do_not():
    games = mctf()
    greedy = random_networks(2, games.env)._replace(kind=np.full(2, GREEDY, dtype=np.int8))
    noisy = greedy._replace(epsilon=np.full(2, 0.1, dtype=np.float32))
    acting = joined([greedy, noisy])
    lineups = pairings(np.array([[0, 1]] * 2 + [[2, 1]] * 2), np.array([[1, 0]] * 4))
    np.testing.assert_array_equal(clusters(games.env, acting, lineups.teams), [0, 0, 2, 3])


def test_hands_know_no_chance():
    lineups = pairings(np.array([[0], [0], [1]]), np.array([[1], [1], [0]]))
    np.testing.assert_array_equal(clusters(Rps(1), fixed_policies(range(3)), lineups.teams), [0, 0, 2])
