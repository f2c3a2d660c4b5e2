import numpy as np
import pytest

from berteam_cli.evaluation.equilibria import exploitability
from berteam_cli.selector.base import Field, unordered_teams
from berteam_cli.selector.listed import places_of
from berteam_cli.selector.psro import Psro, counted, least_met, least_tried
from tests.selector.matrix_games import by_strength, chance_game, hands, played, trained
from tests.strategies import outcomes

RNG = np.random.default_rng(0)


def psro(members=3, sides=2, valid=None, **changed):
    settings = {
        "explore": 0.1,
        "start": 2,
        "solver": "nash",
        "gamma": 0.02,
        "expand_every": 4,
        "candidates": 4,
        "capacity": 32,
        "half_life": 0.0,
    }
    return Psro(Field(np.zeros(members, dtype=int), 2, sides, valid), **(settings | changed))


def over_all(selector, state):
    """Returns all teams and the chance of each."""
    teams = unordered_teams(selector.field.members, 2)
    told = selector.distribution(state)
    chances = np.zeros(len(teams))
    chances[places_of(told.teams, teams)] = told.probability
    return teams, chances


@pytest.mark.parametrize("solver", ["nash", "replicator"])
def test_the_equilibrium_of_rock_paper_scissors(solver):
    selector = psro(solver=solver)
    teams, chances = over_all(selector, trained(selector, hands, 150))
    pairs = np.array([(a, b) for a in teams for b in teams])
    payoff = np.diff(hands(pairs)[:, ::-1], axis=1).reshape(6, 6)
    assert exploitability(chances, payoff) < 0.05
    assert chances[[0, 3, 5]].sum() < 0.05  # never two equal hands


@pytest.mark.parametrize("seed", range(3))
def test_a_game_of_chance_is_solved(seed):
    rng = np.random.default_rng(seed)
    teams = unordered_teams(5, 2)
    gains = rng.uniform(-1, 1, (15, 15))
    gains = (gains - gains.T) / 2
    selector = psro(members=5, candidates=6)
    state = trained(selector, chance_game((1 + gains) / 2, teams), 400, games=64, seed=seed)
    assert exploitability(over_all(selector, state)[1], gains) < 0.1


def test_uniform_plays_all_that_joined():
    selector = psro(solver="uniform")
    state = trained(selector, hands, 100)
    np.testing.assert_allclose(selector.distribution(state).probability, 1 / len(state.found))


def test_gains_by_hand():
    teams = np.array([[0, 1], [2, 2], [1, 1]])
    games = outcomes(
        [[[1, 0], [2, 2], [3, 3]], [[2, 2], [1, 1], [0, 1]], [[0, 1], [1, 0], [3, 3]]],
        [[1, 0, 0], [0.5, 0.5, 0], [0, 0, 1]],
    )
    gains, met = counted(np.zeros((3, 3)), np.zeros((3, 3)), teams, games)
    np.testing.assert_array_equal(gains, [[0, 0.5, -0.5], [-0.5, 0, 0], [0.5, 0, 0]])
    np.testing.assert_array_equal(met, [[0, 2, 1], [2, 0, 1], [1, 1, 0]])


def test_those_that_met_least_meet_first():
    met = np.zeros((4, 4))
    met[0, 1] = met[1, 0] = 5
    chosen = least_met(met, 6 * 5 - 5, 2, RNG)
    for a, b in chosen:
        met[a, b] += 1
        met[b, a] += 1
    np.testing.assert_array_equal(met, 5 * (1 - np.eye(4)))
    three = least_met(np.zeros((5, 5)), 7, 3, RNG)
    assert all(len(set(game)) == 3 for game in three.tolist())
    np.testing.assert_array_equal(least_met(np.zeros((1, 1)), 2, 2, RNG), 0)
    np.testing.assert_array_equal(np.bincount(least_tried(np.array([3.0, 0, 1]), 5, RNG), minlength=3), [0, 3, 2])


def test_half_of_the_games_try_candidates_against_the_mixture():
    selector = psro(members=5, explore=0.0, start=3)
    state = selector.init(RNG)
    which = places_of(played(selector, state, by_strength(lambda x: x.sum(axis=1)), 40, RNG).lineups.teams, state.teams)
    tried = which.max(axis=1) >= 3
    assert tried.sum() == 20
    assert (which.min(axis=1) < 3).all()
    np.testing.assert_array_equal(np.bincount(which.max(axis=1)[tried], minlength=7)[3:], 5)


def test_who_joins_and_who_is_forgotten():
    selector = psro(members=6, capacity=2, explore=0.0)
    rng = np.random.default_rng(1)
    state, best = selector.init(rng), 0
    for k in range(80):
        games = played(selector, state, by_strength(lambda x: x.sum(axis=1)), 16, rng)
        state, said = selector.learn(state, games, None, np.zeros(6), rng)
        assert len(state.found) == said.buffer <= 2
        assert said.updates == 0 or k % 4 == 3
        strongest = state.found.sum(axis=1).max()
        assert strongest >= best  # the one that is played most stays
        best = strongest
    np.testing.assert_array_equal(selector.distribution(state).teams, [[5, 5]])
    assert said.loss == pytest.approx(0, abs=1e-9)


def test_nobody_joins_who_does_not_win():
    selector = psro(members=4)
    state = trained(selector, lambda teams, rng: np.full(teams.shape[:2], 0.5), 40)
    assert len(state.found) == 2


def test_old_games_count_less():
    selector = psro(half_life=2.0, expand_every=1000)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    games = outcomes([[state.found[0], state.found[1]]], [[1, 0]])
    for _ in range(3):
        state, _ = selector.learn(state, games, None, np.zeros(3), rng)
    assert state.games[0, 1] == pytest.approx(1 + 2**-0.5 + 0.5)
    assert state.payoff[0, 1] == pytest.approx(state.gains[0, 1] / (state.games[0, 1] + 1))
    np.testing.assert_allclose(state.strategy, [1, 0], atol=1e-9)


def test_teams_keep_to_the_rules():
    valid = np.array([[1, 1, 0, 0, 0], [0, 0, 1, 1, 1]], dtype=bool)
    selector = psro(members=5, valid=valid, sides=3)
    state = trained(selector, by_strength(lambda x: x.sum(axis=1)), 60)
    assert valid[np.arange(2), state.teams].all()
    np.testing.assert_array_equal(selector.distribution(state).teams, [[1, 4]])


def test_tensors_and_back():
    selector = psro(members=5)
    state = trained(selector, by_strength(lambda x: x.sum(axis=1)), 9)
    again = selector.restored(selector.tensors(state))
    for name in ("found", "strategy", "candidates", "gains", "games"):
        np.testing.assert_array_equal(getattr(again, name), getattr(state, name))
    assert again.epochs == 9


def test_what_excludes_each_other_is_refused():
    with pytest.raises(ValueError, match="start must be at most"):
        psro(start=3, capacity=2)
