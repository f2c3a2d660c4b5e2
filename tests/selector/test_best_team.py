import numpy as np
import pytest
from safetensors.torch import load, save

from berteam_cli.selector.base import Field
from berteam_cli.selector.best_team import BestTeam, better_half
from berteam_cli.selector.listed import places_of
from berteam_cli.selector.tally import Tally
from tests.selector.matrix_games import by_strength, chance_game, played, trained

VALUES = np.array([0.0, 1.0, 2.5, 4.0, 5.5])


def bandit(candidates=128, per_rung=4, restart=False, explore=0.0, sides=2, members=5, valid=None):
    among = Field(np.zeros(members, dtype=int), 2, sides, valid)
    return BestTeam(among, explore, candidates, per_rung, restart)


def strength(teams):
    """Members 1 and 3 fit together; alone, later ones are better."""
    pair = (np.sort(teams, axis=1) == [1, 3]).all(axis=1)
    return VALUES[teams].sum(axis=1) + 100.0 * pair


@pytest.mark.parametrize("sides", [2, 3])
@pytest.mark.parametrize("explore", [0.0, 0.1])
def test_the_best_team_is_found(sides, explore):
    selector = bandit(sides=sides, explore=explore)
    state = trained(selector, by_strength(strength), epochs=60)
    told = selector.distribution(state)
    np.testing.assert_array_equal(told.teams, [[1, 3]])
    np.testing.assert_array_equal(told.probability, 1)


def test_it_is_found_where_games_are_chancy():
    teams = np.array([[i, j] for i in range(5) for j in range(i, 5)])
    value = strength(teams).clip(max=13)
    wins = 1 / (1 + np.exp(-(value[:, np.newaxis] - value) / 3))
    selector = bandit(per_rung=100)
    found = [trained(selector, chance_game(wins, teams), 200, seed=k).choice[0] for k in range(5)]
    assert [sorted(team.tolist()) for team in found] == [[1, 3]] * 5


def test_rungs_by_hand():
    selector = bandit(members=3, per_rung=2)
    rng = np.random.default_rng(0)
    state, sizes = selector.init(rng), []
    while len(state.rung) > 1:
        sizes.append(len(state.rung))
        games = played(selector, state, by_strength(lambda teams: teams.sum(axis=1)), 3, rng)
        counts = np.bincount(places_of(games.lineups.teams, state.rung.teams).ravel(), minlength=sizes[-1])
        assert counts.max() - counts.min() <= 1
        before = state
        state, said = selector.learn(state, games, None, np.zeros(3), rng)
        assert said.buffer == len(state.rung)
        np.testing.assert_array_equal(before.rung.games.sum() + 6, before.rung.after(games).games.sum())
    assert list(dict.fromkeys(sizes)) == [6, 3, 2]
    np.testing.assert_array_equal(state.choice, [[2, 2]])
    again, said = selector.learn(state, played(selector, state, by_strength(strength), 3, rng), None, np.zeros(3), rng)
    assert said.updates == 0
    np.testing.assert_array_equal(again.choice, [[2, 2]])


def test_a_new_search_leaves_the_choice_until_it_ends():
    selector = bandit(restart=True, candidates=6)
    rng = np.random.default_rng(3)
    state, choices = selector.init(rng), []
    for _ in range(200):
        games = played(selector, state, by_strength(strength), 16, rng)
        state, _ = selector.learn(state, games, None, np.zeros(5), rng)
        assert len(state.rung) <= 6
        if len(state.choice):
            told = selector.distribution(state)
            np.testing.assert_array_equal(told.teams, np.sort(state.choice, axis=1))
            choices.append(tuple(told.teams[0]))
    assert len(set(choices)) > 1  # other candidates, another choice
    assert (1, 3) in choices


def test_ties_are_broken_by_chance_and_the_better_half_stays():
    tally = Tally(np.array([[0, 0], [0, 1], [1, 1], [2, 2]]), np.array([3.0, 1, 1, 0]), np.array([4, 2, 2, 2]))
    kept = [better_half(tally, np.random.default_rng(k)).tolist() for k in range(30)]
    assert all(x[0] == [0, 0] for x in kept)
    assert {tuple(x[1]) for x in kept} == {(0, 1), (1, 1)}


def test_candidates_keep_to_the_rules():
    valid = np.array([[1, 1, 0, 0, 0], [0, 0, 1, 1, 1]], dtype=bool)
    for candidates in (6, 5):
        selector = bandit(candidates=candidates, valid=valid)
        state = selector.init(np.random.default_rng(0))
        assert len(state.rung) == candidates
        assert valid[np.arange(2), state.rung.teams].all()
    state = trained(bandit(valid=valid), by_strength(strength), epochs=30)
    np.testing.assert_array_equal(state.choice, [[1, 3]])


def test_tensors_and_back():
    selector = bandit(restart=True, candidates=3, per_rung=1)
    state = trained(selector, by_strength(strength), epochs=4)
    again = selector.restored(selector.tensors(state))
    for name in ("teams", "points", "games"):
        np.testing.assert_array_equal(getattr(again.rung, name), getattr(state.rung, name))
    np.testing.assert_array_equal(again.choice, state.choice)
    assert state.choice.shape == (1, 2)


def test_the_state_after_the_last_halving_can_be_saved():
    selector = bandit(restart=False)
    state = trained(selector, by_strength(strength), epochs=60)
    assert len(state.rung) == 1
    tensors = {name: tensor.contiguous() for name, tensor in selector.tensors(state).items()}
    assert load(save(tensors))["choice"].tolist() == [[1, 3]]  # no two share memory, which cannot be saved
