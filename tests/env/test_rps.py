import numpy as np
import pytest
from scipy.optimize import linprog

from berteam_cli.acting import fixed_policies
from berteam_cli.env.rps import Rps
from berteam_cli.games import Games, pairings
from berteam_cli.outcomes import NOBODY, Lineups
from berteam_cli.selector.base import Field, unordered_teams
from berteam_cli.selector.mcaa import Mcaa, McaaState
from berteam_cli.workers import Workers
from rps import HANDS, hands_beaten
from tests.makers import random_networks
from tests.selector.test_berteam import LEARNER, begun, far, made
from tests.strategies import UNSEEN

FIXED = fixed_policies(range(3))
EQUILIBRIA = {1: [1 / 3] * 3, 2: [0.0 if a == b else 1 / 3 for a, b in unordered_teams(3, 2)]}


def test_who_beats_whom():
    rock, paper, scissors = (np.array([HANDS.index(x)]) for x in ("rock", "paper", "scissors"))
    assert hands_beaten(rock, paper) == hands_beaten(scissors, rock) == hands_beaten(paper, scissors) == 1
    assert hands_beaten(paper, rock) == hands_beaten(rock, scissors) == hands_beaten(scissors, paper) == 0
    assert hands_beaten(rock, rock) == 0


@pytest.mark.parametrize(
    ("ours", "theirs", "beaten"),
    [
        ("rp", "ss", (1, 2)),  # paper is cut, and both scissors are blunted
        ("rp", "rs", (1, 2)),
        ("rp", "ps", (2, 1)),
        ("rr", "rp", (2, 0)),
        ("rr", "ps", (2, 1)),
        ("rr", "rs", (0, 1)),
        ("rps", "rrr", (1, 3)),
        ("rps", "rps", (3, 3)),
    ],
)
def test_teams_by_hand(ours, theirs, beaten):
    ours, theirs = (np.array(["rps".index(x) for x in team]) for team in (ours, theirs))
    assert (hands_beaten(ours, theirs), hands_beaten(theirs, ours)) == beaten


def test_games_and_what_they_pay():
    games = Games(Rps(2), Workers(1))
    lineups = pairings(np.array([[0, 1], [1, 1], [0, 1]]), np.array([[2, 2], [0, 1], [1, 0]]))
    outcomes, seen = games.play(FIXED, lineups, 0, record=True)
    np.testing.assert_array_equal(outcomes.scores, [[1, 0], [1, 0], [0.5, 0.5]])
    np.testing.assert_array_equal(seen.rewards[:, :, 0], [[0.5, 0.5, -0.5, -0.5], [0.5, 0.5, -0.5, -0.5], [0, 0, 0, 0]])
    np.testing.assert_array_equal(seen.actions[0, :, 0], [0, 1, 2, 2])
    assert seen.terminated.all()


def of_sides(*games):
    """Line-ups from words such as "rr ps ss": a team for each side, a hand for each member."""
    teams = np.array([[["rps".index(x) for x in team] for team in game.split()] for game in games])
    nothing = np.zeros(teams.shape[:2])
    return Lineups(teams, nothing.astype(int) + NOBODY, nothing)


@pytest.mark.parametrize(
    ("game", "scores", "paid"),
    [
        ("r p s", [1 / 3, 1 / 3, 1 / 3], [0, 0, 0]),  # each hand is beaten by one
        ("r r r", [1 / 3, 1 / 3, 1 / 3], [0, 0, 0]),
        ("r r p", [0, 0, 1], [-0.5, -0.5, 1]),
        ("p r p", [0.5, 0, 0.5], [0.5, -1, 0.5]),
        ("rp ss rr", [1, 0, 0], [0.5, -0.25, -0.25]),  # one of rp is cut; its paper wraps both of rr, not its own rock
        ("rp pr ps", [0, 0, 1], [-0.25, -0.25, 0.5]),  # its own scissors do not cut the paper of ps
        ("r r s s", [0.5, 0.5, 0, 0], [2 / 3, 2 / 3, -2 / 3, -2 / 3]),
    ],
)
def test_more_sides_by_hand(game, scores, paid):
    lineups = of_sides(game)
    sides, size = lineups.teams.shape[1:]
    outcomes, seen = Games(Rps(size, sides), Workers(1)).play(FIXED, lineups, 0, record=True)
    np.testing.assert_array_equal(outcomes.scores, [scores])
    np.testing.assert_allclose(seen.rewards[0, :, 0], np.repeat(paid, size), atol=1e-6)


def test_two_sides_score_as_the_rule_says():
    teams = unordered_teams(3, 3)
    k, j = map(np.ravel, np.indices((len(teams), len(teams))))
    outcomes, seen = Games(Rps(3), Workers(1)).play(FIXED, pairings(teams[k], teams[j]), 0, record=True)
    gaps = np.array([hands_beaten(b, a) - hands_beaten(a, b) for a, b in zip(teams[k], teams[j], strict=True)])
    np.testing.assert_array_equal(outcomes.scores[:, 0], (np.sign(gaps) + 1) / 2)
    np.testing.assert_array_equal(outcomes.scores[:, 1], (np.sign(-gaps) + 1) / 2)
    np.testing.assert_array_equal(seen.rewards[:, 0, 0], (gaps / 3).astype(np.float32))


def test_players_see_the_others_hands_when_they_are_shown():
    _, seen = Games(Rps(2, 3), Workers(1)).play(FIXED, of_sides("rp ss rs"), 0, record=True)
    assert seen.observations.shape == (1, 6, 2, 7)
    np.testing.assert_array_equal(seen.observations[0, :, 0], [[1, 0, 0, 0, 0, 0, 0]] * 6)
    assert seen.lengths.tolist() == [1]
    rp, ss, rs = [0.5, 0.5, 0], [0, 0, 1], [0.5, 0, 0.5]
    after = [[1, *ss, *rs], [1, *rs, *rp], [1, *rp, *ss]]  # the next side first
    np.testing.assert_array_equal(seen.observations[0, :, 1], np.repeat(after, 2, axis=0))


@pytest.mark.parametrize("sides", [2, 3, 8])
def test_networks_play_too(sides):
    games = Games(Rps(3, sides), Workers(2))
    rng = np.random.default_rng(0)
    teams = rng.integers(5, size=(50, sides, 3))
    nothing = np.zeros((50, sides))
    lineups = Lineups(teams, nothing.astype(int) + NOBODY, nothing)
    outcomes, seen = games.play(random_networks(5, games.env), lineups, 1, record=True)
    np.testing.assert_allclose(outcomes.scores.sum(axis=1), 1)
    np.testing.assert_allclose(seen.rewards.sum(axis=1), 0, atol=1e-5)
    best = outcomes.scores.max(axis=1)
    assert (outcomes.scores == np.where(outcomes.scores > 0, best[:, np.newaxis], 0)).all()
    assert len(np.unique(best)) > 1


@pytest.mark.parametrize("team_size", [1, 2])
def test_the_equilibrium_is_the_only_one(team_size):
    """Each team's chance is the same in every mixture that no team beats on average."""
    teams = unordered_teams(3, team_size)
    k, j = map(np.ravel, np.indices((len(teams), len(teams))))
    outcomes, _ = Games(Rps(team_size), Workers(1)).play(FIXED, pairings(teams[k], teams[j]), 0)
    gains = (outcomes.scores[:, 0] - outcomes.scores[:, 1]).reshape(len(teams), len(teams))
    np.testing.assert_array_equal(gains, -gains.T)
    for team, chance in enumerate(EQUILIBRIA[team_size]):
        for sense in (1, -1):
            aim = sense * np.eye(len(teams))[team]
            best = linprog(aim, A_ub=-gains.T, b_ub=np.zeros(len(teams)), A_eq=[[1] * len(teams)], b_eq=[1])
            assert best.x[team] == pytest.approx(chance, abs=1e-9)


def learnt(selector, state, epochs, games=1000):
    """Returns the distribution over teams, the mean of the later half of the epochs: chance stirs each of them."""
    played = Games(Rps(selector.field.team_size), Workers(1))
    rng = np.random.default_rng(0)
    seen = []
    for epoch in range(epochs):
        lineups = selector.select(state, games, np.zeros(3), rng)
        outcomes, _ = played.play(FIXED, lineups, epoch)
        state, _ = selector.learn(state, outcomes, UNSEEN, np.zeros(3), rng)
        seen.append(selector.distribution(state).probability)
    return np.mean(seen[epochs // 2 :], axis=0)


def test_mcaa_reaches_the_equilibrium_of_the_game_of_one():
    """One island for each hand; it begins far off."""
    selector = Mcaa(Field(np.arange(3), 1), 0.5, 1)
    start = McaaState(np.array([1.5, 0.0, -0.5]), np.zeros(3, dtype=np.int64), 0)
    assert selector.distribution(start).probability.max() > 0.7
    np.testing.assert_allclose(learnt(selector, start, 300), EQUILIBRIA[1], atol=0.03)


@pytest.mark.parametrize("team_size", [1, 2])
def test_berteam_settles_where_shares_are_win_rates(team_size):
    """The equilibrium of the game of one, and its soft counterpart in the game of two.

    With chances p of each ordered pair of equal hands and q of different ones, equal hands win with p + 2 q, different
    ones with 2 p + 2 q. Shares like these have p / q = (sqrt(17) - 1) / 4, where equal chances would have 1.
    """
    selector = made(3, team_size, weighting=True, **LEARNER | {"batch_size": 1024, "capacity": 4000, "width": 16})
    start = begun(selector, seed=1)
    ratio = (np.sqrt(17) - 1) / 4
    equal, different = ratio / (3 * ratio + 6), 2 / (3 * ratio + 6)
    shares = [equal if a == b else different for a, b in unordered_teams(3, 2)] if team_size == 2 else EQUILIBRIA[1]
    assert far(selector.distribution(start).probability, shares) > 0.2
    assert far(learnt(selector, start, 100), shares) < 0.03
