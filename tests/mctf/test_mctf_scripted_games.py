"""All fixed policies in whole games, on both sides, and with what they may read and change."""

import numpy as np
import pytest

from mctf.kernel import RUNNING, finished, step
from mctf.observe import observation_size, observe
from mctf.play import play_scripted
from mctf.rules import make_rules
from mctf.scripted import NAMES, act
from mctf.start import reset
from mctf.state import empty
from tests.mctf.sight import PROFILE, VERSIONS

POLICIES = range(len(NAMES))
MEMORY = ("goal", "reach", "stream")
every_version = pytest.mark.parametrize("version", VERSIONS)


def scattered(rules, rng):
    """Returns a state in the middle of a game: flags carried, vehicles tagged, policies under way."""
    state, vehicles = empty(1, rules), rules.blue_size + rules.red_size
    reset(state, 0, rules)
    spread = rng.choice([8.0, 30.0, 80.0])
    middle = rng.uniform((20.0, 20.0), (140.0, 60.0))
    places = np.clip(middle + spread * rng.uniform(-1.0, 1.0, (vehicles, 2)), 1.0, (158.0, 78.0))
    places += rng.random((vehicles, 2))  # no two in the same corner
    state.pos[0] = np.round(64.0 * places) / 64.0
    state.heading[0] = rng.uniform(-180.0, 180.0, vehicles)
    state.is_tagged[0] = rng.random(vehicles) < 0.3
    state.on_own_side[0] = rng.random(vehicles) < 0.5
    state.goal[0] = rng.integers(0, 3, vehicles)
    state.stream[0] = rng.integers(0, 1000)
    for first, last in ((0, rules.blue_size), (rules.blue_size, vehicles)):
        if rng.random() < 0.5:
            state.has_flag[0, rng.integers(first, last)] = True
    return state


def swapped(state, rules):
    """Returns the state with the field turned by half a circle: blue is red."""
    order = [*range(rules.blue_size, rules.blue_size + rules.red_size), *range(rules.blue_size)]
    other = type(state)(*(array.copy() for array in state))
    for name in ("pos", "heading", "is_tagged", "on_own_side", "goal", "has_flag"):
        getattr(other, name)[0] = getattr(state, name)[0, order]
    other.pos[0] = (rules.width_m, rules.height_m) - other.pos[0]
    other.heading[0] = np.where(other.heading[0] > 0.0, other.heading[0] - 180.0, other.heading[0] + 180.0)
    return other


def observed(state, rules):
    raw = np.zeros((rules.blue_size + rules.red_size, observation_size(rules)))
    observe(state, 0, rules, raw)
    return raw


@every_version
@pytest.mark.parametrize("sizes", [(1, 1), (2, 2), (3, 2), (1, 4)])
def test_both_sides_act_the_same(version, sizes):
    rules, other_rules = (make_rules(PROFILE[version], s, world_size_m=(160, 80)) for s in (sizes, sizes[::-1]))
    rng = np.random.default_rng(sum(sizes))
    chosen = set()
    for _ in range(30):
        state = scattered(rules, rng)
        other = swapped(state, rules)
        raw, other_raw = observed(state, rules), observed(other, other_rules)
        for policy in POLICIES:
            for v in range(sum(sizes)):
                action = act(policy, state, 0, v, raw[v], rules)
                w = (v + sizes[1]) % sum(sizes)
                assert act(policy, other, 0, w, other_raw[w], other_rules) == action, (NAMES[policy], v)
                assert other.goal[0, w] == state.goal[0, v]
                chosen.add(action)
        assert other.stream[0] == state.stream[0]
    assert {-1, 2, 4, 6, 10, 12, 14} <= chosen
    assert max(chosen) > 16


@every_version
@pytest.mark.parametrize("sizes", [(1, 1), (3, 2)])
def test_nothing_else_is_read_or_changed(version, sizes):
    rules = make_rules(PROFILE[version], sizes)
    rng = np.random.default_rng(3)
    size = observation_size(rules)
    for _ in range(10):
        state = scattered(rules, rng)
        raw = observed(state, rules)
        for policy in POLICIES:
            for v in range(sum(sizes)):
                actions, before = [], type(state)(*(array.copy() for array in state))
                for poison in (np.nan, 1.0, -7.0):
                    around = np.full(size + 200, poison)
                    around[100:-100] = raw[v]
                    mine = type(state)(*(array.copy() for array in before))
                    actions.append(act(policy, mine, 0, v, around[100:-100], rules))
                    np.testing.assert_array_equal(around[100:-100], raw[v])
                    for name, array in before._asdict().items():
                        if name not in MEMORY:
                            assert getattr(mine, name).tobytes() == array.tobytes(), name
                    for name in ("goal", "reach"):
                        others = np.arange(sum(sizes)) != v
                        np.testing.assert_array_equal(getattr(mine, name)[0, others], getattr(before, name)[0, others])
                assert len(set(actions)) == 1, NAMES[policy]


@every_version
@pytest.mark.parametrize("sizes", [(1, 1), (2, 2), (3, 3), (5, 5), (10, 10), (2, 3), (5, 1)])
def test_whole_games(version, sizes):
    """The compiled loop plays as this one does; all actions are allowed, and everybody is somewhere."""
    rules = make_rules(PROFILE[version], sizes, substeps=10, max_time_s=100.0, max_score=2)
    vehicles = sum(sizes)
    games = -(-len(NAMES) // sizes[0])
    policies = np.random.default_rng(vehicles).integers(0, len(NAMES), (games, vehicles))
    policies[:, : sizes[0]] = np.arange(games * sizes[0]).reshape(games, -1) % len(NAMES)
    played = play_scripted(policies, np.arange(games, dtype=np.uint64), rules)
    state, actions = empty(1, rules), np.zeros(vehicles, np.int64)
    for b in range(games):
        state.stream[0] = b
        reset(state, 0, rules)
        while finished(state, 0, rules) == RUNNING:
            raw = observed(state, rules)
            actions[:] = [act(policies[b, v], state, 0, v, raw[v], rules) for v in range(vehicles)]
            assert actions.min() >= -1
            assert actions.max() <= 61
            step(state, 0, actions, rules)
        for name in (*MEMORY, "pos", "heading", "score", "steps", "events"):
            assert getattr(state, name).tobytes() == getattr(played, name)[b : b + 1].tobytes(), (b, name)
    assert np.isfinite(played.pos).all()
    assert np.ptp(played.pos[..., 0]) < 1.1 * rules.width_m
