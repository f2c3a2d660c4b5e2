"""Many games in step: a game is the same in any lane, company and thread, and the same as the environment's."""

import copy
import math
from collections import defaultdict

import numpy as np
import pytest

import mctf
from mctf.batch import Batch, chunks
from mctf.kernel import RUNNING, TIME_OUT
from mctf.play import play_scripted
from mctf.rules import make_rules
from mctf.scripted import NAMES
from mctf.state import CAPTURES, EVENTS

GAMES = 11


def action_of(game, moment, batch_of="discrete", vehicles=4):
    """What is done depends on the game and the moment only; the game's number decides how long it lasts, too."""
    rng = np.random.default_rng([game, moment])
    if batch_of == "continuous":
        return np.column_stack([rng.uniform(0.0, 1.5, vehicles), rng.uniform(-180.0, 180.0, vehicles)])
    return rng.integers(0, 17 if batch_of == "discrete" else 45, vehicles)


def play_all(batch, kind="discrete"):
    """Plays all games; returns what was seen and paid in each, as bytes, and how each ended."""
    told, ends, length = defaultdict(list), {}, defaultdict(int)
    turn = batch.start(np.arange(GAMES) + 100)
    vehicles = turn.observations.shape[1]
    for b in np.flatnonzero(turn.games >= 0):
        told[int(turn.games[b])].append(turn.observations[b].tobytes())
    while (turn.games >= 0).any():
        playing = turn.games.tolist()
        idle = np.zeros_like(action_of(0, 0, kind, vehicles)) - 7
        turn = batch.step(np.array([idle if g < 0 else action_of(g, length[g], kind, vehicles) for g in playing]))
        last = {int(lane): k for k, lane in enumerate(turn.ended.lanes)}
        assert sorted(last) == np.flatnonzero(turn.done).tolist()
        for b, game in enumerate(playing):
            if game < 0:
                assert (turn.rewards[b] == 0).all()
                assert (turn.observations[b] == 0).all()
                assert not turn.done[b]
                continue
            length[game] += 1
            seen = turn.ended.observations[last[b]] if b in last else turn.observations[b]
            told[game] += [seen.tobytes(), turn.rewards[b].tobytes()]
            if b in last:
                one = [array[last[b]] for array in turn.ended]
                assert one[0:2] == [b, game]
                assert one[3] == length[game]
                ends[game] = int(one[2]), one[4].tobytes(), one[5].tobytes()
                if turn.games[b] >= 0:
                    assert turn.games[b] not in told
                    told[int(turn.games[b])].append(turn.observations[b].tobytes())
    return {game: b"".join(words) for game, words in told.items()}, ends


SHORT = {"max_time_s": 40, "starts": "random", "world_size_m": (60, 40), "max_score": 2}


@pytest.mark.parametrize(
    ("rules", "kind", "observations"),
    [
        ({"profile": "clean"}, "discrete", "normalised"),
        ({"pid_reset": False}, "continuous", "raw"),
        ({"profile": "pyquaticus-2025-11", "team_size": (1, 3), "max_time_s": 8}, "field_points", "normalised"),
    ],
)
def test_a_game_does_not_depend_on_lanes_and_threads(rules, kind, observations):
    rules = make_rules(**SHORT | rules)

    def batch(lanes, threads):
        return Batch(
            lanes, rules, reward="mctf.rewards:progress", actions=kind, observations=observations, threads=threads
        )

    told, ends = play_all(batch(1, 1), kind)
    assert sorted(told) == sorted(ends) == list(range(GAMES))
    for lanes, threads in ((2, 2), (3, 1), (4, 3), (GAMES, 2), (20, 5)):
        one = batch(lanes, threads)
        assert play_all(one, kind) == (told, ends)
        assert play_all(one, kind) == (told, ends)  # nothing is left of what the lanes played before


def test_a_game_is_the_environments():
    rules = make_rules(profile="clean", **SHORT)
    told, ends = play_all(Batch(3, rules))
    env = mctf.parallel_env(profile="clean", **SHORT)
    for game in range(GAMES):
        observations, _ = env.reset(seed=100 + game)
        words = [np.array(list(observations.values())).tobytes()]
        for moment in range(10**6):
            actions = dict(zip(env.agents, action_of(game, moment).tolist(), strict=True))
            observations, rewards, terminated, _, infos = env.step(actions)
            words += [np.array(list(observations.values())).tobytes(), np.array(list(rewards.values())).tobytes()]
            if not env.agents:
                break
        assert b"".join(words) == told[game]
        end, score, events = ends[game]
        assert terminated["blue_0"] == (end != TIME_OUT)
        assert env.save()["score"].tobytes() == score
        assert env.save()["events"].tobytes() == events
        assert [infos["blue_0"][name] for name in EVENTS] == np.frombuffer(events, np.int64)[: len(EVENTS)].tolist()


def test_no_lane_idles_while_games_wait():
    rules = make_rules(max_time_s=3)
    batch = Batch(4, rules)
    turn = batch.start(np.arange(10))
    assert turn.games.tolist() == [0, 1, 2, 3]
    played = []
    for _ in range(9):
        turn = batch.step(np.full((4, 4), 16))
        played.append((turn.done.tolist(), turn.games.tolist(), turn.ended.games.tolist()))
    no, yes = [False] * 4, [True] * 4
    assert played == [
        *[(no, [0, 1, 2, 3], [])] * 2,
        (yes, [4, 5, 6, 7], [0, 1, 2, 3]),
        *[(no, [4, 5, 6, 7], [])] * 2,
        (yes, [8, 9, -1, -1], [4, 5, 6, 7]),
        *[(no, [8, 9, -1, -1], [])] * 2,
        ([True, True, False, False], [-1, -1, -1, -1], [8, 9]),
    ]
    assert turn.ended.ends.tolist() == [TIME_OUT] * 2
    assert turn.ended.steps.tolist() == [3, 3]
    with pytest.raises(RuntimeError, match="step must come after start and before the end of the last game"):
        batch.step(np.full((4, 4), 16))
    assert batch.start([5]).games.tolist() == [0, -1, -1, -1]
    assert batch.step(np.full((4, 4), 16)).done.tolist() == no


def test_a_batch_does_not_hold_more_than_it_needs():
    def size(thing):
        if isinstance(thing, np.ndarray):
            return thing.nbytes
        return sum(map(size, thing)) if isinstance(thing, tuple) else 0

    batch = Batch(10_000, make_rules())
    turn = batch.start(np.arange(10_000))
    turn = batch.step(np.zeros((10_000, 4), np.int64))
    assert turn.games[-1] == 9_999
    assert size(batch._lanes) < 100 * 2**20
    assert all(one.base is None and size(one) for one in (turn.observations, turn.rewards, turn.done, turn.games))
    again = batch.step(np.zeros((10_000, 4), np.int64))
    assert again.observations is turn.observations


def spoilt(shape, value, b=2, v=1):
    actions = np.zeros(shape, np.asarray(value).dtype)
    actions[b, v] = value
    return actions


@pytest.mark.parametrize("kind", ["discrete", "field_points"])
@pytest.mark.parametrize("value", [-1, 45, 2**40, -2, -(2**63)])
def test_actions_that_are_not_allowed(kind, value):
    batch = Batch(3, make_rules(), actions=kind)
    batch.start(np.arange(9))
    before = copy.deepcopy(batch._lanes)
    highest = {"discrete": 16, "field_points": 44}[kind]
    with pytest.raises(ValueError, match=f"actions of game 2, vehicle 1 must be a whole number 0..{highest}, but is"):
        batch.step(spoilt((3, 4), value))
    for name, array in before.state._asdict().items():
        assert array.tobytes() == getattr(batch._lanes.state, name).tobytes(), name
    batch.step(spoilt((3, 4), highest))


@pytest.mark.parametrize(
    "value", [(-0.1, 0), (1.6, 0), (0, 181), (0, -181), (math.nan, 0), (0, math.nan), (0, math.inf)]
)
def test_continuous_actions_that_are_not_allowed(value):
    batch = Batch(3, make_rules(), actions="continuous")
    batch.start(np.arange(9) + 50)
    with pytest.raises(ValueError, match=r"actions of game 2, vehicle 1 must be a speed in \[0, 1.5\] m/s and a turn"):
        batch.step(spoilt((3, 4, 2), np.array(value, float)))
    batch.step(spoilt((3, 4, 2), np.array((1.5, -180.0), np.float32)))


@pytest.mark.parametrize(
    ("actions", "words"),
    [
        (np.zeros((3, 3), int), r"actions must be whole numbers of shape \(3, 4\), but has \(3, 3\) of int64"),
        (np.zeros((3, 4)), "but has .* of float64"),
        (np.zeros((3, 4), bool), "but has .* of bool"),
        ([["a"] * 4] * 3, "actions must be whole numbers"),
        (7, r"but has \(\) of int64"),
    ],
)
def test_arrays_that_are_no_actions(actions, words):
    batch = Batch(3, make_rules())
    batch.start([1, 2, 3])
    with pytest.raises(ValueError, match=words):
        batch.step(actions)
    batch.step([[0, 1, 2, 3]] * 3)
    batch.step(np.zeros((3, 4), np.uint8))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"lanes": 0}, "lanes must be a whole number >= 1, but is 0"),
        ({"lanes": 1.5}, "lanes must be"),
        ({"threads": 0}, "threads must be a whole number >= 1, but is 0"),
        ({"threads": True}, "threads must be"),
        ({"actions": "field_point"}, "actions must be one of .* Did you mean field_points?"),
        ({"observations": "Raw"}, "observations must be one of .* Did you mean raw?"),
        ({"reward": "sparce"}, "reward must be one of .* Did you mean sparse?"),
        ({"rules": {"team_size": 2}}, "rules must be of make_rules, but is"),
    ],
)
def test_settings_are_checked(given, words):
    with pytest.raises(ValueError, match=words):
        Batch(**{"lanes": 3, "rules": make_rules()} | given)


@pytest.mark.parametrize("seeds", [[-1], [0.5], [[1]], ["a"], 3, None, []])
def test_seeds_are_checked(seeds):
    with pytest.raises(ValueError, match=r"seeds must be"):
        Batch(1, make_rules()).start(seeds)


def test_step_before_start():
    with pytest.raises(RuntimeError, match="step must come after start"):
        Batch(1, make_rules()).step(np.zeros((1, 4), int))


def test_chunks_share_everything_once():
    for count in range(20):
        for threads in range(1, 8):
            parts = chunks(count, threads)
            assert [i for first, last in parts for i in range(first, last)] == list(range(count))
            assert all(last > first for first, last in parts)
            assert len(parts) == min(count, threads)


@pytest.mark.parametrize("profile", ["pyquaticus-2024-06", "clean"])
def test_scripted_games_are_the_same_for_any_number_of_threads(profile):
    rules = make_rules(profile=profile, starts="random", max_time_s=60)
    policies = np.random.default_rng(0).integers(0, len(NAMES), (7, 4))
    alone = play_scripted(policies, np.arange(7), rules)
    assert (alone.steps > 0).all()
    for threads in (2, 3, 16):
        shared = play_scripted(policies, np.arange(7), rules, threads=threads)
        for name, mine, theirs in zip(alone._fields, alone, shared, strict=True):
            assert mine.tobytes() == theirs.tobytes(), name
    with pytest.raises(ValueError, match="threads must be a whole number >= 1, but is 0"):
        play_scripted(policies, np.arange(7), rules, threads=0)
    assert len(play_scripted(policies[:0], np.zeros(0, np.uint64), rules, threads=2).steps) == 0


def test_ends_and_captures_agree():
    rules = make_rules(**SHORT | {"max_time_s": 120})
    _, ends = play_all(Batch(4, rules))
    for end, score, _ in ends.values():
        captures = np.frombuffer(score, np.int64).reshape(2, 3)[:, CAPTURES]
        assert end != RUNNING
        assert (captures.max() >= rules.max_score) == (end != TIME_OUT)
