import numpy as np
import pytest

from berteam_cli.selector.assessor import Assessor, AssessorState, latest_rivals, played_teams
from berteam_cli.selector.base import Field, unordered_teams
from tests.selector.matrix_games import by_strength, hands, played, trained

RNG = np.random.default_rng(0)


def assessor(members=6, sides=2, valid=None, exact_limit=5000, **changed):
    settings = {
        "explore": 0.3,
        "capacity": 1000,
        "window": 32,
        "train_every": 2,
        "batch_size": 256,
        "minibatch_size": 64,
        "width": 32,
        "learning_rate": 0.01,
        "temperature": 0.02,
    }
    return Assessor(Field(np.zeros(members, dtype=int), 2, sides, valid, exact_limit), **(settings | changed))


def fitting(teams):
    """Members 2 and 3 fit together, alone they are the worst."""
    ordered = np.sort(teams, axis=1)
    return teams.sum(axis=1) - 4.0 * np.isin(teams, (2, 3)).sum(axis=1) + 20 * (ordered == [2, 3]).all(axis=1)


@pytest.mark.parametrize("sides", [2, 3])
@pytest.mark.parametrize("exact_limit", [5000, 3])
def test_it_learns_who_fit_together(sides, exact_limit):
    selector = assessor(sides=sides, exact_limit=exact_limit, temperature=0.0, explore=0.5)
    state = trained(selector, by_strength(fitting), 60)
    told = selector.distribution(state)
    np.testing.assert_array_equal(told.teams, [[2, 3]])
    # Also about games that it does not play itself: who wins is foretold for 9 of 10.
    teams = unordered_teams(6, 2)
    rng = np.random.default_rng(1)
    games = rng.choice(len(teams), size=(300, 2))
    values = fitting(teams[games].reshape(-1, 2)).reshape(-1, 2)
    decided = games[values[:, 0] != values[:, 1]]
    rivals = sides - 1
    first = [
        selector.foretold(state, teams[[a]], np.repeat(teams[[b]], rivals, axis=0)[np.newaxis])[0] > 1 / sides
        for a, b in decided
    ]
    won = fitting(teams[decided[:, 0]]) > fitting(teams[decided[:, 1]])
    assert (first == won).mean() > 0.9


def test_draws_are_foretold_as_halves():
    selector = assessor(members=3, explore=1.0)
    state = trained(selector, hands, 80)
    rock, paper = np.array([[0, 0]]), np.array([[[1, 1]]])
    assert selector.foretold(state, rock, paper)[0] < 0.1
    assert selector.foretold(state, rock, rock[np.newaxis])[0] == pytest.approx(0.5)
    assert selector.foretold(state, np.array([[0, 1]]), np.array([[[1, 2]]]))[0] < 0.3  # paper twice beaten, rock once


def test_the_colder_the_fewer():
    told = [
        assessor(members=4, temperature=t).distribution(
            trained(assessor(members=4, temperature=t), by_strength(fitting), 8)
        )
        for t in (0.0, 0.02, 100.0)
    ]
    assert len(told[0].teams) == 1
    assert told[0].entropy <= told[1].entropy < told[2].entropy
    np.testing.assert_allclose(told[2].probability, 0.1, atol=0.01)
    np.testing.assert_array_equal(told[1].teams[told[1].probability.argmax()], told[0].teams[0])


def test_it_learns_every_so_many_epochs_and_the_state_before_stays():
    selector = assessor(train_every=2, capacity=20)
    state = selector.init(np.random.default_rng(0))
    assert len(selector.distribution(state).teams) == 21  # all alike before the first update
    games = played(selector, state, by_strength(fitting), 16, RNG)
    once, said = selector.learn(state, games, None, np.zeros(6), np.random.default_rng(5))
    assert (said.updates, said.buffer) == (0, 16)
    twice, said = selector.learn(once, games, None, np.zeros(6), np.random.default_rng(5))
    assert (said.updates, said.buffer) == (4, 20)
    assert said.loss == pytest.approx(np.log(2), abs=0.2)
    np.testing.assert_array_equal(twice.ring.teams[:12], games.lineups.teams[4:])  # the newest over the oldest
    np.testing.assert_array_equal(twice.ring.teams[16:], games.lineups.teams[:4])
    assert state.pushed == 0
    assert (state.ring.teams == -1).all()
    assert all(weight is once.learnt.weights[name] for name, weight in state.learnt.weights.items())


def test_rivals_are_those_of_the_latest_games():
    selector = assessor(sides=3, capacity=4)
    state = selector.init(RNG)
    games = played(selector, state, by_strength(fitting), 6, RNG)
    state, _ = selector.learn(state, games, None, np.zeros(6), RNG)
    rivals, often = latest_rivals(state, 2)
    teams = np.sort(games.lineups.teams, axis=2)
    expected = [teams[b][[s for s in range(3) if s != side]] for side in range(3) for b in (5, 4)]
    assert often.sum() == 6
    assert sorted(rivals.repeat(often, axis=0).tolist()) == sorted(x.tolist() for x in expected)


def test_a_search_keeps_to_the_rules():
    valid = np.array([[1, 1, 0, 0, 0, 0], [0, 0, 1, 1, 1, 1]], dtype=bool)
    selector = assessor(valid=valid, exact_limit=2)
    state = trained(selector, by_strength(fitting), 20)
    assert valid[np.arange(2), state.will.teams].all()
    known = played_teams(state)
    assert valid[np.arange(2), known].all()
    assert len(np.unique(known, axis=0)) == len(known) == 8  # all that can stand


def test_a_selector_saved_and_loaded_goes_on_the_same():
    selector = assessor()
    state = trained(selector, by_strength(fitting), 5)
    again = assessor().restored({name: tensor.clone() for name, tensor in selector.tensors(state).items()})
    assert isinstance(again, AssessorState)
    games = played(selector, state, by_strength(fitting), 16, RNG)
    after = [
        x.tensors(x.learn(y, games, None, np.zeros(6), np.random.default_rng(3))[0])
        for x, y in ((selector, state), (assessor(), again))
    ]
    assert after[0].keys() == after[1].keys()
    for name, tensor in after[0].items():
        assert tensor.equal(after[1][name]), name


def test_what_excludes_each_other_is_refused():
    with pytest.raises(ValueError, match="minibatch_size must divide"):
        assessor(minibatch_size=100)
