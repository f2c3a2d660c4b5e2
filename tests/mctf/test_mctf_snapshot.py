"""Games saved and restored, and pictures: neither changes how a game goes on."""

import copy
import io
import pickle

import numpy as np
import pytest
from gymnasium.spaces import Discrete

import mctf
from mctf import render, snapshot
from mctf.kernel import step
from mctf.observe import observation_size, observe
from mctf.rules import make_rules
from mctf.scripted import NAMES, act
from mctf.start import reset
from mctf.state import EVENTS, empty


def everyone(env, action=16):
    return dict.fromkeys(env.agents, action)


def drawn(env, rng):
    """Actions of all agents from the test's own generator."""
    space = env.action_space(env.possible_agents[0])
    if isinstance(space, Discrete):
        return {agent: int(rng.integers(space.n)) for agent in env.agents}
    return {agent: rng.uniform(space.low, space.high).astype(np.float32) for agent in env.agents}


def played(env, steps, seed=0):
    """The bytes of all that happens in ``steps`` more steps."""
    rng, seen = np.random.default_rng(seed), []
    for _ in range(steps):
        observations, rewards, *_ = env.step(drawn(env, rng))
        seen.append(b"".join(row.tobytes() for row in observations.values()) + repr(rewards).encode())
    return seen, b"".join(array.tobytes() for array in env.save().values())


@pytest.mark.parametrize("actions", ["discrete", "continuous", "field_points"])
@pytest.mark.parametrize("profile", ["pyquaticus-2024-06", "pyquaticus-2025-11", "clean"])
def test_a_saved_game_goes_on_as_it_did(profile, actions):
    env = mctf.parallel_env(profile=profile, actions=actions, starts="random")
    env.reset(seed=4)
    played(env, 60)
    saved = env.save()
    twins = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    ahead = played(env, 60, seed=1)
    env.reset()
    drawn_start = env.save()["pos"].tobytes()
    env.restore(saved)
    assert played(env, 60, seed=1) == ahead
    env.reset()
    assert env.save()["pos"].tobytes() == drawn_start  # the stream of random numbers is part of it
    file = io.BytesIO()
    np.savez(file, **saved)
    file.seek(0)
    other = mctf.parallel_env(profile=profile, actions=actions, starts="random")
    seen, _ = other.reset(options={"state": np.load(file)})
    again, infos = env.restore(saved)
    assert all(np.array_equal(seen[agent], again[agent]) for agent in env.agents)
    assert infos["red_0"]["wall_hits"] == saved["events"][2, EVENTS.index("wall_hits")]
    for twin in (other, *twins):
        assert played(twin, 60, seed=1) == ahead


@pytest.mark.parametrize("version", ["2024", "2025"])
def test_the_memory_of_fixed_policies_is_saved(version):
    rules = make_rules(policy_version=version, starts="random", max_time_s=1000)
    policies = [NAMES.index(name) for name in ("waypoint", "combined_medium", "combined_hard", "random")]

    def play(state, steps):
        raw = np.zeros((4, observation_size(rules)))
        for _ in range(steps):
            observe(state, 0, rules, raw)
            step(state, 0, np.array([act(p, state, 0, v, raw[v], rules) for v, p in enumerate(policies)]), rules)
        return snapshot.saved(state, 0, rules)

    state, other = empty(1, rules), empty(3, rules)
    reset(state, 0, rules)
    saved = play(state, 100)
    assert saved["goal"][0] > 0
    assert np.isfinite(saved["reach"][1])
    ahead = play(state, 100)
    snapshot.restore(saved, other, 2, rules)
    snapshot.restore(snapshot.saved(other, 2, rules), state, 0, rules)
    again = play(state, 100)
    assert {name: array.tobytes() for name, array in again.items()} == {
        name: array.tobytes() for name, array in ahead.items()
    }


def test_a_seed_and_a_saved_game():
    env = mctf.parallel_env(starts="random")
    env.reset(seed=1)
    saved = env.save()
    env.reset(seed=9, options={"state": saved})
    assert env.save()["pos"].tobytes() == saved["pos"].tobytes()
    env.reset()
    first = env.save()["pos"].tobytes()
    env.reset(seed=9)
    assert env.save()["pos"].tobytes() == first


def test_a_game_that_keeps_its_controllers_memory():
    env = mctf.parallel_env(pid_reset=False)
    env.reset()
    env.step(everyone(env, 1))
    env.reset()
    assert env.save()["heading_error_known"].all()
    assert (env.save()["heading_error_prev"] != 0).all()
    forgetful = mctf.parallel_env()
    forgetful.reset()
    forgetful.step(everyone(forgetful, 1))
    forgetful.reset()
    assert not forgetful.save()["heading_error_known"].any()


def spoilt(saved, name, change):
    saved = copy.deepcopy(saved)
    saved[name] = change(saved[name])
    return saved


def filled(value):
    return lambda array: np.full_like(array, value)


def test_snapshots_that_do_not_fit_are_refused():
    env = mctf.parallel_env()
    env.reset()
    saved = env.save()
    for other, words in (
        (mctf.parallel_env(team_size=3), "blue_size was 2, not 3"),
        (mctf.parallel_env(team_size=(1, 3)), "blue_size was 2, not 1"),
        (mctf.parallel_env(max_score=2), "max_score was 1, not 2"),
        (mctf.parallel_env(world_size_m=(160, 80)), "width_m was 200, not 160"),
    ):
        with pytest.raises(ValueError, match=f"must be of a game of the same rules, but {words}"):
            other.restore(saved)
        assert other.agents == []
    for wrong, words in (
        (3, "must be named arrays as of save, but is int"),
        ({}, "lacks .* and has \\[\\] besides"),
        (saved | {"wind": np.zeros(1)}, "has \\['wind'\\] besides"),
        (spoilt(saved, "pos", lambda a: a[:3]), r"pos must have shape \(4, 2\) of float64, but has \(3, 2\)"),
        (spoilt(saved, "pos", lambda a: a.astype(np.float32)), "pos must have shape .* of float32"),
        (spoilt(saved, "speed", filled(np.nan)), "speed must be finite, but has nan"),
        (spoilt(saved, "heading", filled(181.0)), r"heading must be in \[-180.0, 180.0\], but has 181.0..181.0"),
        (spoilt(saved, "tagged_opponent", filled(4)), r"tagged_opponent must be in \[-1, 3\]"),
        (spoilt(saved, "goal", filled(-1)), r"goal must be in \[0, 5\], but has -1..-1"),
        (spoilt(saved, "rules", lambda a: a[1:]), "rules must be numbers of shape"),
    ):
        before = env.save()
        with pytest.raises(ValueError, match=words):
            env.restore(wrong)
        assert all(np.array_equal(before[name], array, equal_nan=True) for name, array in env.save().items())


@pytest.mark.parametrize("mode", ["rgb_array", "ansi", "human"])
def test_pictures_change_nothing(mode, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(render, "FRAMES_PER_SECOND", 1000)
    with_pictures = mctf.parallel_env(render_mode=mode, starts="random", max_time_s=25)
    without = mctf.parallel_env(starts="random", max_time_s=25)
    for env in (with_pictures, without):
        env.reset(seed=11)
    for seed in range(25):
        with_pictures.render()
        assert played(with_pictures, 1, seed) == played(without, 1, seed)
        with_pictures.render()
    assert with_pictures.agents == without.agents == []
    with_pictures.close()


def test_pictures():
    env = mctf.parallel_env(render_mode="rgb_array")
    with pytest.raises(RuntimeError, match="render must come after reset"):
        env.render()
    env.reset()
    first = env.render()
    assert first.dtype == np.uint8
    assert first.ndim == 3
    for _ in range(5):
        env.step(everyone(env, 4))
    assert (env.render() != first).any()
    blind = mctf.parallel_env()
    blind.reset()
    with pytest.raises(RuntimeError, match="render needs a render_mode"):
        blind.render()
