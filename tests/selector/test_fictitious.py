import numpy as np
import pytest
from scipy.optimize import linprog

from berteam_cli.acting import fixed_policies
from berteam_cli.env.rps import Rps
from berteam_cli.games import Games, pairings
from berteam_cli.selector.base import unordered_teams
from berteam_cli.selector.fictitious import Fictitious, share
from berteam_cli.workers import Workers
from tests.selector.test_berteam import learn, made, scored

RESPONDER = {
    "weighting": True,
    "weight_cap": 13.0,
    "loss": "l1",
    "captain": "berteam",
    "noise_half_life": 0.0,
    "draw_weight": 0.5,
    "dropout": 0.0,
}
FAST = {
    "batch_size": 2048,
    "minibatch_size": 256,
    "capacity": 1024,
    "learning_rate": 5e-3,
    "entropy_coef": 0.4,
    "entropy_clip": 1.0,
    "width": 32,
    "position": "none",
}
HANDS = fixed_policies(range(3))


def fictitious(members, team_size, reservoir=10_000, sharpening=2.0, **settings):
    return Fictitious(made(members, team_size, **RESPONDER | settings), reservoir, sharpening)


def coin(lineups, gains, teams, rng):
    """Returns outcomes in which side 0 wins with chance (1 + gain) / 2 of its team against the other."""
    number = {tuple(team): k for k, team in enumerate(teams)}
    k, j = np.array([[number[tuple(np.sort(team))] for team in game] for game in lineups.teams]).T
    won = rng.random(len(k)) < (1 + gains[k, j]) / 2
    return scored(lineups, np.stack([won, ~won], axis=1).astype(float))


def rps_gains(team_size):
    teams = unordered_teams(3, team_size)
    k, j = map(np.ravel, np.indices((len(teams), len(teams))))
    outcomes, _ = Games(Rps(team_size), Workers(1)).play(HANDS, pairings(teams[k], teams[j]), 0)
    return (outcomes.scores[:, 0] - outcomes.scores[:, 1]).reshape(len(teams), -1)


def exploitability(gains, teams, distribution):
    """Returns what the best response wins more often than it loses against ``distribution``."""
    chances = np.zeros(len(teams))
    for team, chance in zip(distribution.teams, distribution.probability, strict=True):
        chances[np.all(teams == team, axis=1)] = chance
    return (gains @ chances).max()


def played_out(selector, play, epochs, seed, games=512):
    rng = np.random.default_rng(seed)
    state = selector.init(rng)
    ages = np.zeros(selector.field.members)
    for epoch in range(epochs):
        lineups = selector.select(state, games, ages, rng)
        state, _ = learn(selector, state, play(lineups, epoch, rng), rng)
    return selector.distribution(state)


# --- the average approaches an equilibrium


@pytest.mark.parametrize(("team_size", "epochs", "sharpening", "bound"), [(1, 60, 1.0, 0.05), (2, 140, 2.0, 0.18)])
def test_hands_are_hard_to_exploit(team_size, epochs, sharpening, bound):
    """In the game of two, the only equilibrium never shows two equal hands; 900 epochs get below 0.05 there."""
    games, teams = Games(Rps(team_size), Workers(1)), unordered_teams(3, team_size)
    selector = fictitious(3, team_size, sharpening=sharpening, **FAST)
    average = played_out(selector, lambda lineups, epoch, _: games.play(HANDS, lineups, epoch)[0], epochs, seed=7)
    assert exploitability(rps_gains(team_size), teams, average) < bound
    if team_size == 2:
        equal = average.teams[:, 0] == average.teams[:, 1]
        assert average.probability[equal].sum() < 0.15


def test_a_random_matrix_game_is_hard_to_exploit():
    gains = np.random.default_rng(3).uniform(-1, 1, size=(5, 5))
    gains = (gains - gains.T) / 2
    best = linprog(
        [0] * 5 + [-1], np.c_[-gains.T, [1] * 5], [0] * 5, [[1] * 5 + [0]], [1], [(0, 1)] * 5 + [(None, None)]
    )
    assert (best.x[:5] > 0.01).sum() == 5  # all teams have a part in the equilibrium
    teams = unordered_teams(5, 1)
    selector = fictitious(5, 1, **FAST)
    average = played_out(selector, lambda lineups, _, rng: coin(lineups, gains, teams, rng), 120, seed=1)
    assert exploitability(gains, teams, average) < 0.05


# --- who plays whom, and what is learnt


def test_one_side_responds_and_the_others_are_of_the_average():
    selector = fictitious(4, 2, reservoir=50, sides=3)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    lineups = selector.select(state, 30, np.zeros(4), rng)
    mine = np.arange(30)[:, np.newaxis] % 3 == np.arange(3)
    np.testing.assert_array_equal(np.isfinite(lineups.log_chances), mine)
    assert np.all((lineups.teams == lineups.captains[:, :, np.newaxis]).any(axis=2))
    held = {tuple(team) for team in state.average.teams[0]}
    assert {tuple(team) for team in lineups.teams[~mine]} <= held


def test_only_the_response_is_learnt_from_and_losers_teach_too():
    selector = fictitious(4, 2, reservoir=50)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    lineups = selector.select(state, 6, np.zeros(4), rng)
    after, did = learn(selector, state, scored(lineups, np.tile([1.0, 0.0], (6, 1))), rng)
    assert did.buffer == 6
    ring = after.response.winners[0].held
    np.testing.assert_array_equal(ring.teams[:6], lineups.teams[np.arange(6), np.arange(6) % 2])
    np.testing.assert_array_equal(ring.weights[:6] > 0, [True, False] * 3)
    assert np.all(ring.inverses[:6] > 0)


@pytest.mark.parametrize("side", ["token", "separate"])
def test_sides_have_averages_of_their_own(side):
    selector = fictitious(3, 1, reservoir=2000, sharpening=1.0, side=side, dataset="per_side")
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    total = np.zeros(3)
    for k in range(2):
        average = selector.distribution(state, k)
        response = selector.responder.distribution(state.response, k)
        np.testing.assert_allclose(average.probability, response.probability, atol=5 * 0.5 / np.sqrt(2000))
        total += average.probability / 2
    np.testing.assert_allclose(selector.distribution(state).probability, total)
    np.testing.assert_allclose(selector.captains(state), total)
    state, did = learn(selector, state, scored(selector.select(state, 8, np.zeros(3), rng), np.full((8, 2), 0.5)), rng)
    assert did.updates > 0


def test_the_average_weighs_response_n_with_n():
    """After n responses, the share of the first m is m (m + 1) / (n (n + 1))."""
    weight = np.zeros(0)
    for n in range(1, 11):
        weight = np.append(weight * (1 - share(n)), share(n))
    np.testing.assert_allclose(weight, np.arange(1, 11) / 55)


def test_responses_take_their_share_of_the_average():
    selector = fictitious(3, 2, reservoir=9000, sharpening=1.0)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    mean = selector.responder.distribution(state.response).probability
    for n in range(2, 6):
        lineups = selector.select(state, 20, np.zeros(3), rng)
        wins = (lineups.teams == 2).any(axis=2)
        state, _ = learn(selector, state, scored(lineups, np.where(wins.all(axis=1)[:, np.newaxis], 0.5, wins)), rng)
        mean += share(n) * (selector.responder.distribution(state.response).probability - mean)
    assert state.average.responses == 5
    average = selector.distribution(state)
    np.testing.assert_allclose(average.probability, mean, atol=5 * 0.5 / np.sqrt(9000))
    drawn = np.sort(selector.sample(state, 9000, rng), axis=1)
    shares = np.array([np.all(drawn == team, axis=1).mean() for team in average.teams])
    np.testing.assert_allclose(shares, average.probability, atol=5 * 0.5 / np.sqrt(9000))
    top = selector.likeliest(state, 2, rng)
    assert top.probability.sum() == pytest.approx(np.sort(average.probability)[-2:].sum())


def test_a_restored_state_goes_on_as_if_nothing_had_happened():
    selector = fictitious(3, 2, reservoir=40)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    states = [state, selector.restored({k: v.clone() for k, v in selector.tensors(state).items()})]
    for k in range(2):
        lineups = selector.select(states[k], 8, np.zeros(3), np.random.default_rng(1))
        states[k], _ = learn(
            selector, states[k], scored(lineups, np.tile([0.0, 1.0], (8, 1))), np.random.default_rng(2)
        )
    one, other = ({n: x.numpy().tobytes() for n, x in selector.tensors(s).items()} for s in states)
    assert one == other
    assert one["average.teams"] != selector.tensors(state)["average.teams"].numpy().tobytes()


@pytest.mark.parametrize(
    ("settings", "name"),
    [({"loss": "mlm"}, "selector.loss=l1")],
)
def test_what_is_no_best_response_is_refused(settings, name):
    with pytest.raises(ValueError, match=name):
        fictitious(3, 1, **settings)
