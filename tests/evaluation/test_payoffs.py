from itertools import product

import numpy as np
import pytest

from berteam_cli.acting import fixed_policies, joined, noisy
from berteam_cli.env.rps import Rps
from berteam_cli.evaluation import playing
from berteam_cli.evaluation.payoffs import halved_payoffs, pair_scores, payoff_steps, payoffs
from berteam_cli.evaluation.tournament import tournament
from berteam_cli.games import Games, pairings
from berteam_cli.selector.base import unordered_teams
from berteam_cli.workers import Workers
from tests.makers import mctf, random_networks

CYCLE = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # rock, paper, scissors: paper beats rock ...


def rps(team_size, workers=1):
    return Games(Rps(team_size), Workers(workers))


def test_rock_paper_scissors():
    played = payoffs(rps(1), fixed_policies(range(3)), unordered_teams(3, 1), 2, np.random.default_rng(0))
    np.testing.assert_array_equal(played.wins, CYCLE)
    np.testing.assert_array_equal(played.draws, np.eye(3))
    np.testing.assert_array_equal(played.zero_sum, CYCLE - CYCLE.T)
    np.testing.assert_array_equal(played.scores, CYCLE + np.eye(3) / 2)


def test_pairs_of_hands():
    teams = unordered_teams(3, 2)
    played = payoffs(rps(2), fixed_policies(range(3)), teams, 8, np.random.default_rng(0))
    beaten = np.array(
        [[sum(any((a - b) % 3 == 1 for a in ours) for b in theirs) for theirs in teams] for ours in teams]
    )
    np.testing.assert_array_equal(played.wins, beaten > beaten.T)
    np.testing.assert_array_equal(played.draws, beaten == beaten.T)


def test_both_sides_and_all_orders_are_in_it():
    games, acting = mctf(), fixed_policies([0, 2, 3])
    teams = np.array([[0, 1], [1, 2]])
    whole = payoffs(games, acting, teams, 8, np.random.default_rng(0))
    ours, theirs = [(0, 1), (1, 0)], [(1, 2), (2, 1)]
    blue, red = (np.array(x) for x in zip(*product(ours, theirs), strict=True))
    as_blue = games.play(acting, pairings(blue, red), 0)[0].scores[:, 0]
    as_red = games.play(acting, pairings(red, blue), 0)[0].scores[:, 1]
    assert whole.scores[0, 1] == pytest.approx(np.mean([as_blue, as_red]))
    assert whole.wins[0, 1] == pytest.approx(np.mean([as_blue == 1, as_red == 1]))


@pytest.mark.parametrize("games_per_pair", [1, 3, 8])
def test_what_holds_of_any_teams(games_per_pair):
    games = mctf()
    acting = joined([random_networks(3, games.env, scale=3.0), fixed_policies([2, 5, 6])])
    played = payoffs(games, acting, unordered_teams(6, 2)[::4], games_per_pair, np.random.default_rng(1))
    np.testing.assert_allclose(played.wins + played.wins.T + played.draws, 1, atol=1e-12)
    np.testing.assert_array_equal(played.draws, played.draws.T)
    np.testing.assert_array_equal(played.zero_sum, -played.zero_sum.T)
    np.testing.assert_allclose(played.scores + played.scores.T, 1, atol=1e-12)
    assert (played.wins > 0).any()


def test_it_agrees_with_a_tournament():
    games, teams, acting = mctf(), unordered_teams(3, 2), fixed_policies([0, 2, 5])
    played = payoffs(games, acting, teams, 8, np.random.default_rng(0))
    won, drawn, _ = tournament(games, acting, teams, 8, 0).results.sum(axis=0) / 8
    other = ~np.eye(len(teams), dtype=bool)
    np.testing.assert_array_equal(played.wins[other], won[other])
    np.testing.assert_array_equal(played.draws[other], drawn[other])
    assert (won > 0).any()


def test_each_half_of_the_games_has_both_sides_and_either_order_of_either_team():
    games, acting, teams = mctf(), noisy(fixed_policies([0, 2, 5]), 0.4), np.array([[0, 1], [1, 2], [0, 2]])
    halves = halved_payoffs(games, acting, teams, 8, np.random.default_rng(3))
    whole = payoffs(games, acting, teams, 8, np.random.default_rng(3))
    np.testing.assert_allclose((halves[0].wins + halves[1].wins) / 2, whole.wins, atol=1e-12)
    np.testing.assert_allclose((halves[0].draws + halves[1].draws) / 2, whole.draws, atol=1e-12)
    assert (halves[0].wins != halves[1].wins).any()
    # Games of a pair: members 0-1 against 1-2, 0-1 against 2-1, 1-0 against 1-2, 1-0 against 2-1, each as blue and red.
    scores = pair_scores(games, acting, teams, 8, np.random.default_rng(3))[1]
    for half, mine in zip(halves, ([0, 1, 6, 7], [2, 3, 4, 5]), strict=True):
        assert half.wins[0, 1] == (scores[mine] == 1).mean()
        assert half.draws[0, 1] == (scores[mine] == 0.5).mean()


def test_halves_of_pairs_without_chance_are_the_whole():
    games, teams = mctf(), unordered_teams(3, 2)
    sure, chancy = fixed_policies([0, 2, 5]), joined([fixed_policies([0, 2]), noisy(fixed_policies([5]), 0.4)])
    whole = payoffs(games, sure, teams, 8, np.random.default_rng(0))
    for half in halved_payoffs(games, sure, teams, 8, np.random.default_rng(0)):
        np.testing.assert_array_equal(half.wins, whole.wins)
        np.testing.assert_array_equal(half.draws, whole.draws)
    known = np.ix_(*[~(teams == 2).any(axis=1)] * 2)
    one, other = halved_payoffs(games, chancy, teams, 8, np.random.default_rng(0))
    np.testing.assert_array_equal(one.wins[known], whole.wins[known])
    np.testing.assert_array_equal(other.wins[known], whole.wins[known])
    assert (one.wins != other.wins).any()
    # Of teams of three not all orders are played, so that neither half knows.
    three = halved_payoffs(rps(3), fixed_policies(range(3)), unordered_teams(3, 3), 8, np.random.default_rng(0))
    assert three[0].wins.shape == (10, 10)


def test_neither_the_workers_nor_the_batches_change_the_chances_of_fixed_policies(monkeypatch):
    def measured(workers):
        acting = fixed_policies(range(3))
        return payoffs(rps(2, workers), acting, unordered_teams(3, 2), 8, np.random.default_rng(0)).wins

    whole = measured(1)
    np.testing.assert_array_equal(whole, measured(2))
    monkeypatch.setattr(playing, "BATCH", 16)
    np.testing.assert_array_equal(whole, measured(1))


def test_what_is_kept_is_not_played_again(tmp_path, monkeypatch):
    monkeypatch.setattr(playing, "BATCH", 50)
    acting, teams, play, left = noisy(fixed_policies(range(3)), 0.3), unordered_teams(3, 2), Games.play, [2]

    def measured(sheet=None):
        return payoffs(rps(2), acting, teams, 8, np.random.default_rng(0), sheet).wins

    def until(*call, **named):
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return play(*call, **named)

    whole = measured()
    monkeypatch.setattr(Games, "play", until)
    with pytest.raises(KeyboardInterrupt):
        measured(tmp_path / "payoffs")
    left[0] = 2  # 21 pairs of 8 games are four batches, two of which are kept
    np.testing.assert_array_equal(measured(tmp_path / "payoffs"), whole)
    assert left[0] == 0


def test_steps():
    assert payoff_steps(28, 8, 420) == 406 * 8 * 420
