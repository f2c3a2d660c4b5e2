"""Every line of every reward, in states written by hand; the vehicle is blue 0 unless it is said otherwise."""

import numpy as np
import pytest

from mctf.batch import Batch
from mctf.parallel import parallel_env
from mctf.rewards import GRABBED, TERMS, make_reward, rewards
from mctf.rules import make_rules

CUSTOM_REW2, CUSTOM_REW, SPARSE = map(make_reward, ("custom_rew2", "custom_rew", "sparse"))


def earned(game, reward):
    out, seen = np.zeros(4), np.zeros((2, 4, 45))
    rewards(reward, game.state, 0, game.rules, *seen, np.zeros(len(TERMS)), out)
    return out.round(12).tolist()


@pytest.fixture
def game(scene):
    game = scene()
    game.state.steps[0] = 2
    game.state.was_pos[:] = game.state.pos
    return game


def put(game, **fields):
    for name, places in fields.items():
        for place in np.atleast_1d(places):
            getattr(game, name)[place] = True
    return game


def test_nothing_happens(game):
    assert earned(game, CUSTOM_REW2) == earned(game, SPARSE) == [0.0] * 4


def test_grab(game):
    put(game, has_flag=0, pickup=0)
    assert earned(game, CUSTOM_REW2) == [1.0, 0.0, -1.0, -1.0]
    assert earned(game, SPARSE) == [50.0, 50.0, -50.0, -50.0]
    put(game, was_carrying=0, was_pickup=0)
    assert earned(game, CUSTOM_REW2) == earned(game, SPARSE) == [0.0] * 4


def test_drop(game):
    put(game, was_carrying=0, was_pickup=0)
    assert earned(game, CUSTOM_REW2) == [-1.0, 0.0, 0.0, 0.0]
    assert earned(game, SPARSE) == [0.0] * 4


def test_capture(game):
    put(game, was_carrying=0, was_pickup=0, capture=0)
    assert earned(game, CUSTOM_REW2) == [1.0, 1.0, -1.0, -1.0]
    assert earned(game, SPARSE) == [100.0, 100.0, -100.0, -100.0]
    assert earned(game, CUSTOM_REW)[:2] == [10.0, 10.0]
    put(game, was_capture=0)
    assert earned(game, SPARSE) == [0.0] * 4


def test_tag(game):
    put(game, is_tagged=2).tagged_opponent[0] = 2
    assert earned(game, CUSTOM_REW2) == [0.05, 0.0, -0.05, 0.0]
    assert earned(game, SPARSE) == [100.0, 0.0, -50.0, 0.0]
    game.tagged_opponent[0] = -1
    put(game, was_tagged=2)
    assert earned(game, CUSTOM_REW2) == [0.0] * 4
    assert earned(game, SPARSE) == [0.0, 0.0, -50.0, 0.0]  # for as long as it lasts


def test_tag_of_a_carrier(game):
    put(game, is_tagged=2, was_carrying=2, was_pickup=1).tagged_opponent[0] = 2
    assert earned(game, CUSTOM_REW2) == [1.05, 0.0, -1.05, 0.0]
    assert earned(game, SPARSE) == [50.0, 0.0, -100.0, 0.0]


def test_wall(game):
    put(game, oob=0)
    assert earned(game, CUSTOM_REW2) == [-1.0, 0.0, 0.0, 0.0]
    assert earned(game, SPARSE) == [-100.0, 0.0, 0.0, 0.0]


def test_what_is_new_in_the_first_step_is_paid_as_in_any_other(game):
    put(game, has_flag=0, pickup=0, is_tagged=3, capture=1, oob=1).tagged_opponent[0] = 3
    for steps in (1, 2):
        game.state.steps[0] = steps
        assert earned(game, CUSTOM_REW2) == [0.05, -2.0, 0.0, -0.05]
        assert earned(game, SPARSE) == [50.0, -150.0, 50.0, 0.0]


def test_nobody_comes_nearer_in_the_first_step(game):
    game.put(0, 100.0, 50.0)
    game.was_pos[0] = 105.0, 50.0
    assert earned(game, CUSTOM_REW)[0] == pytest.approx(0.1)
    game.state.steps[0] = 1
    assert earned(game, CUSTOM_REW)[0] == 0.0


@pytest.mark.parametrize(
    ("carries", "nearer", "reward"),
    [
        (False, 1.0, 0.02),
        (False, 9.0, 0.1),
        (False, -10.0, -0.2),
        (True, 1.0, 0.28),
        (True, 9.0, 1.0),
        (True, -5.0, -0.8),
    ],
)
def test_progress(game, carries, nearer, reward):
    home = 175.0 if carries else 25.0
    game.put(0, 100.0, 50.0, has_flag=carries)
    game.was_pos[0] = 100.0 + (-nearer if home > 100.0 else nearer), 50.0
    assert earned(game, CUSTOM_REW)[0] == pytest.approx(reward)
    game.put(0, 100.0, 50.0, is_tagged=True)
    assert earned(game, CUSTOM_REW)[0] == 0.0


def test_weights_replace_those_of_a_reward(game):
    put(game, has_flag=0, pickup=0)
    assert earned(game, make_reward("custom_rew2", {"grabbed": 7.0})) == [7.0, 0.0, -1.0, -1.0]
    assert earned(game, make_reward("custom_rew2", {"grabbed": 0, "carries": 0.5, "tags": None})) == [
        0.5,
        0.0,
        -1.0,
        -1.0,
    ]


def test_a_function_of_ones_own_sees_terms_and_observations(game):
    def own(terms, before, after):
        return terms[GRABBED] + 10.0 * before[0] + 100.0 * after[1]

    put(game, has_flag=0, pickup=0)
    reward = make_reward(own, {"carries": 0.25})
    before, after, out = np.full((4, 45), 2.0), np.full((4, 45), 3.0), np.zeros(4)
    rewards(reward, game.state, 0, game.rules, before, after, np.zeros(len(TERMS)), out)
    assert out.tolist() == [1.0 + 20.0 + 300.0 + 0.25, 320.0, 320.0, 320.0]


def fails(terms, before, after):
    return before[10**9]


def divides(terms, before, after):
    return 1.0 / (terms[0] - terms[0])


@pytest.mark.parametrize("own", [fails, divides, lambda terms, before, after: np.nan])
def test_a_function_that_fails_is_noticed(own):
    env = parallel_env(reward=own)
    env.reset()
    with pytest.raises(RuntimeError, match="reward must be finite"):
        env.step(dict.fromkeys(env.agents, 4))
    batch = Batch(2, make_rules(), reward=own)
    batch.start([1, 2])
    with pytest.raises(RuntimeError, match=r"reward must be finite.*in game 0"):
        batch.step(np.zeros((2, 4), int))


@pytest.mark.parametrize(
    ("reward", "weights", "said"),
    [
        ("sparce", None, "Did you mean sparse"),
        ("nowhere:pay", None, "importable.*No module named 'nowhere'"),
        ("math:nothing", None, "importable.*no attribute"),
        ("math:pi", None, "must be a function, but"),
        (lambda terms, before, after: open("x"), None, "Numba compiles, but .*lambda.* is not: .*open"),  # noqa: SIM115
        (lambda terms: 1.0, None, r"function\(terms, before, after\)"),
        (None, None, "must be one of"),
        ("sparse", {"tag": 1.0}, "Did you mean tags"),
        ("sparse", {"tags": np.nan}, "finite number"),
        ("sparse", {"tags": [1]}, "finite number"),
    ],
)
def test_what_is_no_reward_is_refused(reward, weights, said):
    with pytest.raises(ValueError, match=said):
        make_reward(reward, weights)
