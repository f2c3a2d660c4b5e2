"""Every line of every reward, in states written by hand; the vehicle is blue 0 unless it is said otherwise."""

import numpy as np
import pytest

from mctf.rewards import TERMS, make_reward, rewards

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


def test_nothing_is_new_in_the_first_step(game):
    game.state.steps[0] = 1
    put(game, has_flag=0, pickup=0, is_tagged=3, capture=1, oob=1).tagged_opponent[0] = 3
    assert earned(game, CUSTOM_REW2) == [0.05, -1.0, 0.0, 0.0]
    assert earned(game, SPARSE) == [100.0, -100.0, 0.0, -50.0]


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
