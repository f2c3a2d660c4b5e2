"""The rules of November 2025 beside a second statement of them, ``restated_2025.py``, which shares no code."""

import numpy as np
import pytest

from mctf.commands import FIELD_POINTS
from mctf.kernel import BLUE_WON, RED_WON, RUNNING, TIME_OUT, drive, finished, step
from mctf.observe import normalise, observation_size, observe, ranges
from mctf.rules import ACTIONS, make_rules
from mctf.start import reset
from mctf.state import COLLIDED, empty
from tests.mctf.restated_2025 import Game, Settings

WHOLE = ("has_flag", "on_own_side", "is_tagged", "oob")


def pair(team_size=2, dynamics="heron", substeps=4, max_score=3, max_time=240.0, **more):
    """Returns the same game twice: restated, and as state and rules."""
    game = Game(
        Settings(team_size, dynamics=dynamics, substeps=substeps, max_score=max_score, max_time=max_time, **more)
    )
    rules = make_rules(
        "pyquaticus-2025-11", team_size, dynamics=dynamics, substeps=substeps, max_score=max_score, max_time_s=max_time
    )
    state = empty(1, rules)
    reset(state, 0, rules)
    return game, state, rules


def put(game, state):
    """Sets the restated game to the state."""
    for v, boat in enumerate(game.vehicles):
        boat.pos, boat.prev_pos = tuple(state.pos[0, v].tolist()), tuple(state.prev_pos[0, v].tolist())
        for name in (*WHOLE, "speed", "heading", "thrust", "cooldown"):
            setattr(boat, name, getattr(state, name)[0, v].item())
        known = state.heading_error_known[0, v]
        boat.heading_error_prev = state.heading_error_prev[0, v].item() if known else None
        boat.collisions = int(state.events[0, v, COLLIDED])
    for team, flag in enumerate(game.flags):
        flag.pos, flag.taken = tuple(state.flag_pos[0, team].tolist()), bool(state.flag_taken[0, team])
        game.score[team] = state.score[0, team].tolist()
    game.contacts = {(int(v), int(w)) for v, w in np.argwhere(state.touching[0])}
    game.time = float(state.time[0])


def same(game, state, rules):
    """Asserts that both are in the same state. A heading at rest after a keep-out contact is noise."""
    for v, boat in enumerate(game.vehicles):
        np.testing.assert_allclose(state.pos[0, v], boat.pos, rtol=0, atol=1e-9)
        np.testing.assert_allclose(state.thrust[0, v], boat.thrust, rtol=0, atol=1e-9)
        np.testing.assert_allclose(state.speed[0, v], boat.speed, rtol=0, atol=1e-9)
        off = abs(state.heading[0, v] - boat.heading)
        assert min(off, 360.0 - off) < 1e-7 or boat.speed < 1e-6
        assert bool(state.heading_error_known[0, v]) == (boat.heading_error_prev is not None)
        assert [bool(getattr(state, name)[0, v]) for name in WHOLE] == [getattr(boat, name) for name in WHOLE]
        assert state.cooldown[0, v] == pytest.approx(boat.cooldown, abs=1e-12)
        assert state.tagged_opponent[0, v] == (-1 if boat.made_tag is None else boat.made_tag)
        assert state.events[0, v, COLLIDED] == boat.collisions
    for team, flag in enumerate(game.flags):
        assert state.flag_taken[0, team] == flag.taken
        assert state.score[0, team].tolist() == game.score[team]
    over = finished(state, 0, rules)
    assert (over == BLUE_WON, over == RED_WON) == (game.done["blue"], game.done["red"])
    assert (over != RUNNING) == any(game.done.values())
    raw = np.zeros((len(game.vehicles), observation_size(rules)))
    observe(state, 0, rules, raw)
    scaled = np.zeros(raw.shape, np.float32)
    normalise(raw, ranges(rules), rules, scaled)
    for v, boat in enumerate(game.vehicles):
        if boat.speed > 1e-6:
            apart = np.abs(raw[v] - game.observe(v))
            bearings = [*range(0, 14, 2), *range(21, raw.shape[1], 8), *range(23, raw.shape[1], 8)]
            apart[bearings] = np.minimum(apart[bearings], 360.0 - apart[bearings])
            assert np.delete(apart, np.flatnonzero(near_rest(game))).max() < 1e-6
            if not near_rest(game).any() and (abs(abs(raw[v][bearings]) - 180.0) > 1e-6).all():
                np.testing.assert_allclose(scaled[v], game.observe_scaled(v), rtol=0, atol=1e-6)


def near_rest(game):
    """Returns (O,) whether a number shows the heading of a vehicle at rest, seen by any other."""
    size = 21 + 8 * (len(game.vehicles) - 1)
    marked = np.zeros(size, bool)
    if any(boat.speed < 1e-6 for boat in game.vehicles):
        marked[23::8] = True
    return marked


def raid(game, rng):
    """Returns actions that make things happen: to the opponents' flag, home with it, or after the opponents."""
    actions = []
    for v, boat in enumerate(game.vehicles):
        seen = game.observe(v)
        goal = seen[2] if boat.has_flag else seen[0] if v % 2 == 0 else seen[21 + 8 * (len(game.vehicles) // 2 - 1)]
        turn = int(np.clip(round(4 - goal / 45.0), 0, 7))
        actions.append(int(rng.integers(17)) if rng.random() < 0.05 else turn + 8 * int(rng.random() < 0.1))
    return actions


@pytest.mark.parametrize("dynamics", ["heron", "surveyor"])
@pytest.mark.parametrize(("team_size", "substeps"), [(1, 1), (2, 4), (3, 10), (6, 10)])
def test_every_step_of_a_game(team_size, substeps, dynamics):
    game, state, rules = pair(team_size, dynamics, substeps)
    same(game, state, rules)
    rng = np.random.default_rng(team_size)
    for moment in range(1500 // (team_size * substeps) + 150):
        put(game, state)
        actions = raid(game, rng) if moment % 100 < 80 else rng.integers(17, size=2 * team_size).tolist()
        game.step(actions)
        step(state, 0, np.array(actions), rules)
        same(game, state, rules)
    assert state.score[0].sum() > 0


def test_a_game_that_is_never_put_right():
    game, state, rules = pair(2, "heron", 4)
    rng = np.random.default_rng(5)
    for moment in range(150):
        if moment % 10 == 0:
            actions = rng.integers(17, size=4).tolist()
        game.step(actions)
        step(state, 0, np.array(actions), rules)
        same(game, state, rules)


@pytest.mark.parametrize("dynamics", ["heron", "surveyor"])
def test_walls(dynamics):
    """Straight out of the field on all sides and corners, and what brings them back."""
    game, state, rules = pair(2, dynamics, 4)
    rng = np.random.default_rng(0)
    for _ in range(8):
        reset(state, 0, rules)
        state.pos[0] = rng.choice([[3.0, 40.0], [157.0, 40.0], [80.0, 3.0], [80.0, 77.0], [3.0, 3.0], [157.0, 77.0]], 4)
        state.heading[0] = rng.uniform(-180, 180, 4)
        outside = 0
        for _ in range(40):
            put(game, state)
            actions = rng.choice([3, 4, 5, 4, 4], 4).tolist()
            game.step(actions)
            step(state, 0, np.array(actions), rules)
            same(game, state, rules)
            outside += state.oob[0].sum()
    assert outside > 0


def test_field_points_and_continuous_actions():
    game, state, rules = pair(2, "surveyor", 4)
    rng = np.random.default_rng(1)
    for moment in range(120):
        put(game, state)
        if moment % 2:
            points = rng.integers(len(FIELD_POINTS), size=4)
            game.step([FIELD_POINTS[i] for i in points])
            step(state, 0, ACTIONS + points, rules)
        else:
            commands = rng.uniform([0.0, -180.0], [3.0, 180.0], (4, 2))
            game.step(commands.tolist())
            drive(state, 0, commands, rules)
        same(game, state, rules)


def test_the_clock():
    for substeps, max_time in ((1, 12.0), (4, 24.0), (10, 60.0)):
        game, state, rules = pair(1, "heron", substeps, max_time=max_time)
        while finished(state, 0, rules) == RUNNING:
            game.step([16, 16])
            step(state, 0, np.array([16, 16]), rules)
        assert finished(state, 0, rules) == TIME_OUT
        assert game.done["all"]
        assert state.steps[0] == round(max_time / substeps * 10)
