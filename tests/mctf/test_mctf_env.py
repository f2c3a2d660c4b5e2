"""The PettingZoo environment: names, spaces, seeds, actions, rewards, and what is refused."""

import math

import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete

import mctf
from mctf import mctf_v0, render
from mctf.commands import FIELD_POINTS
from mctf.kernel import drive, step
from mctf.observe import observation_size, observe
from mctf.rewards import CARRIES
from mctf.start import reset
from mctf.state import EVENTS, State, empty


def everyone(env, action=16):
    return dict.fromkeys(env.agents, action)


def test_names_and_spaces():
    env = mctf.parallel_env(team_size=(2, 3))
    assert env.possible_agents == ["blue_0", "blue_1", "red_0", "red_1", "red_2"]
    assert env.agents == []
    assert env.metadata["name"] == "mctf_v0"
    assert env.metadata["render_fps"] == render.FRAMES_PER_SECOND
    for agent in env.possible_agents:
        assert env.action_space(agent) is env.action_space(agent)
        assert env.observation_space(agent) is env.observation_space(agent)
    assert env.action_space("blue_0") == Discrete(17)
    assert mctf.parallel_env(actions="field_points").action_space("red_1") == Discrete(len(FIELD_POINTS))
    space = mctf.parallel_env(actions="continuous", dynamics="heron").action_space("blue_0")
    assert space == Box(np.array([0, -180], np.float32), np.array([2, 180], np.float32))
    observations, _ = env.reset()
    assert {row.shape for row in observations.values()} == {(13 + 8 * 5,)} == {env.observation_space("red_2").shape}
    assert mctf_v0.env is mctf.env
    assert mctf_v0.parallel_env is mctf.parallel_env
    assert mctf_v0.raw_env is mctf.raw_env


@pytest.mark.parametrize(("profile", "bound"), [("pyquaticus-2024-06", np.inf), ("pyquaticus-2025-11", 1.0)])
def test_observations_have_bounds_where_the_rules_cut_them(profile, bound):
    env = mctf.parallel_env(profile=profile)
    assert env.observation_space("blue_0") == Box(-bound, bound, (45,), np.float32)
    assert env.state_space == Box(-bound, bound, (49,), np.float32)
    raw = mctf.parallel_env(profile=profile, observations="raw")
    assert raw.observation_space("blue_0") == Box(-np.inf, np.inf, (45,), np.float32)


def test_raw_observations_are_in_units():
    env = mctf.parallel_env(observations="raw")
    env.reset()
    for _ in range(5):
        observations, *_ = env.step(everyone(env, 3))
    state, seen = empty(1, env.rules), np.zeros((4, observation_size(env.rules)))
    reset(state, 0, env.rules)
    for _ in range(5):
        step(state, 0, np.full(4, 3), env.rules)
    observe(state, 0, env.rules, seen)
    np.testing.assert_array_equal(np.array(list(observations.values())), seen.astype(np.float32))


def test_continuous_actions_are_speed_and_turn():
    env = mctf.parallel_env(actions="continuous")
    env.reset(seed=0)
    state = empty(1, env.rules)
    reset(state, 0, env.rules)
    commands = np.array([[1.5, 0.0], [0.3, -180.0], [0.0, 180.0], [1.0, 12.5]], np.float32)
    for _ in range(20):
        env.step(dict(zip(env.agents, commands, strict=True)))
        drive(state, 0, commands.astype(np.float64), env.rules)
    saved = env.save()
    for name in State._fields:
        assert saved[name].tobytes() == getattr(state, name)[0].tobytes(), name


def test_field_points_are_driven_to():
    env = mctf.parallel_env(actions="field_points", field_points="scaled", field_point_reach_m=3.0, dynamics="heron")
    env.reset()
    for _ in range(150):
        env.step(everyone(env, FIELD_POINTS.index("CC")))
    saved = env.save()
    assert (np.hypot(*(saved["pos"] - [100, 50]).T) < 6.0).all()


def test_time_out_is_a_truncation():
    env = mctf.parallel_env(max_time_s=3)
    env.reset(seed=0)
    assert env.agents == ["blue_0", "blue_1", "red_0", "red_1"]
    for _ in range(3):
        assert env.agents
        _, _, terminated, truncated, infos = env.step(everyone(env))
    assert all(truncated.values())
    assert not any(terminated.values())
    assert env.agents == []
    assert set(infos["red_1"]) == {*EVENTS, "team_captures", "team_tags", "team_grabs"}
    with pytest.raises(RuntimeError, match="step must come after reset and before the end"):
        env.step({})


def test_capture_is_a_termination_and_rewards_follow_it():
    env = mctf.parallel_env(team_size=1)
    env.reset()
    saved = env.save()
    saved["pos"][0] = 100.0, 20.0
    saved["has_flag"][0] = saved["flag_taken"][1] = saved["pickup"][0] = True
    saved["steps"][...] = 7
    env.reset(options={"state": saved})
    _, rewards, terminated, truncated, infos = env.step(everyone(env))
    assert all(terminated.values())
    assert not any(truncated.values())
    assert rewards == {"blue_0": 1.0, "red_0": -1.0}
    assert infos["blue_0"]["captures"] == infos["blue_0"]["team_captures"] == 1
    assert infos["red_0"]["captures"] == infos["red_0"]["team_captures"] == 0
    with pytest.raises(ValueError, match="must be of a game that goes on"):
        env.reset(options={"state": env.save()})


def carrier(terms, before, after):
    return terms[CARRIES] + after[1] - before[1]


def test_rewards_are_chosen_by_name_place_or_function():
    earned = {}
    for reward in ("custom_rew2", "custom_rew", "sparse", "mctf.rewards:progress", carrier):
        env = mctf.parallel_env(reward=reward, observations="raw")
        before, _ = env.reset()
        before = env.step(everyone(env, 4))[0]
        after, paid, *_ = env.step(everyone(env, 4))
        earned[reward] = paid["blue_0"]
        way = float(after["blue_0"][1]) - float(before["blue_0"][1])
    assert earned["custom_rew2"] == earned["sparse"] == 0.0
    assert 0.0 < earned["custom_rew"] < 0.1
    assert earned["mctf.rewards:progress"] == earned["custom_rew"]
    assert earned[carrier] == pytest.approx(way, rel=1e-4)
    weighted = mctf.parallel_env(reward="sparse", reward_weights={"nearer_m": 2.0})
    weighted.reset()
    weighted.step(everyone(weighted, 4))
    assert weighted.step(everyone(weighted, 4))[1]["blue_0"] == pytest.approx(-2.0 * way, rel=1e-4)


def test_random_starts_come_from_the_seed():
    def start(seed, env=None):
        env = env or mctf.parallel_env(starts="random")
        env.reset(seed=seed)
        return env.save()["pos"].tobytes()

    assert start(5) == start(5)
    assert len({start(seed) for seed in (0, 1, 2, 2**64 - 1, np.int64(7))}) == 5
    assert start(None) != start(None)
    env, other = (mctf.parallel_env(starts="random") for _ in range(2))
    assert [start(3, env), start(None, env), start(None, env)] == [
        start(3, other),
        start(None, other),
        start(None, other),
    ]
    assert start(None, env) != start(3, env)


def test_the_global_state():
    env = mctf.parallel_env(observations="raw", team_size=(1, 2))
    with pytest.raises(RuntimeError, match="state must come after reset"):
        env.state()
    env.reset()
    expected = [150, 50, -90, 0, 0, 1, 0, 30, 0]
    for y in (100 / 3, 200 / 3):
        expected += [50, y, 90, 0, 0, 1, 0, 30, 0]
    expected += [175, 50, 175, 50, 0, 0, 25, 50, 25, 50, 0, 0, 0]
    np.testing.assert_array_equal(env.state(), np.array(expected, np.float32))
    scaled = mctf.parallel_env(profile="clean", team_size=1, max_time_s=100)
    scaled.reset()
    scaled.step(everyone(scaled))
    blue, red, flags = [0.5, 0, -0.5, -1, -1, 1, -1, 1, -1], [-0.5, 0, 0.5, -1, -1, 1, -1, 1, -1], [0.75, 0] * 2
    expected = [*blue, *red, *flags, -1, -1, *(-x for x in flags), -1, -1, -0.98]
    np.testing.assert_allclose(scaled.state(), expected, rtol=0, atol=1e-6)


def test_calls_out_of_order():
    env = mctf.parallel_env()
    for call, words in ((lambda: env.step({}), "step must come after reset"), (env.save, "save must come after reset")):
        with pytest.raises(RuntimeError, match=words):
            call()


@pytest.mark.parametrize("action", [17, -1, -2, math.nan, math.inf, 0.5, 3.0, "4", None, [4], True, [[1], [2, 3]]])
def test_actions_that_are_not_allowed(action):
    env = mctf.parallel_env()
    env.reset()
    with pytest.raises(ValueError, match=r"actions\['red_0'\] must be a whole number 0..16, but is"):
        env.step(everyone(env) | {"red_0": action})
    assert env.save()["time"] == 0.0
    env.step(everyone(env) | {"red_0": np.int64(3), "red_1": np.array(4)})


@pytest.mark.parametrize(
    "action",
    [3, (1.0,), (1.0, 2.0, 3.0), (1.6, 0), (-0.1, 0), (1, 180.1), (1, -181), (math.nan, 0), (0, math.nan), ("1", "2"),
     (True, False), None, (1, 1j), [[1, 2], [3]]],
)  # fmt: skip
def test_continuous_actions_that_are_not_allowed(action):
    env = mctf.parallel_env(actions="continuous")
    env.reset()
    fine = everyone(env, (1, 180))
    with pytest.raises(ValueError, match=r"actions\['red_0'\] must be a speed in \[0, 1.5\] m/s and a turn in"):
        env.step(fine | {"red_0": action})
    env.step(fine | {"red_0": np.array([1.5, -180.0])})


def test_the_highest_speed_is_allowed_in_single_and_double_precision():
    for speed in (1.3, 1.7):
        env = mctf.parallel_env(actions="continuous", max_speed=speed)
        env.reset()
        env.step(everyone(env, (speed, 0)))
        env.step(everyone(env, env.action_space("blue_0").high))


def test_actions_must_be_of_the_agents():
    env = mctf.parallel_env()
    env.reset()
    actions = everyone(env)
    del actions["blue_0"]
    with pytest.raises(ValueError, match=r"lacks \['blue_0'\] and has \['green_0'\]"):
        env.step(actions | {"green_0": 0})
    with pytest.raises(ValueError, match=r"must have one entry for each of .* has \['\[1, 2, 3, 4\]'\] besides"):
        env.step([1, 2, 3, 4])


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"reward": "custom_rew3"}, "reward must be one of .* Did you mean custom_rew2?"),
        ({"reward": 3}, "reward must be"),
        ({"actions": "discreet"}, "actions must be one of .* but is 'discreet'. Did you mean discrete?"),
        ({"observations": "normalized"}, "observations must be one of .* Did you mean normalised?"),
        ({"observations": None}, "observations must be one of"),
        ({"render_mode": "rgb"}, "render_mode must be one of .* Did you mean rgb_array?"),
        ({"team_size": 0}, "team_size"),
        ({"team_size": 10**6}, "team_size must be at most"),
        ({"team_size": (2, 60)}, "team_size must be at most 49, so that nobody starts within agent_radius_m"),
        ({"agent_radius_m": 20.0, "flag_keepout_m": 0.0, "team_size": 6}, "team_size must be at most 4,"),
        ({"world_size_m": (8, 8)}, r"world_size_m\[0\] must be >"),
        ({"profile": "clear"}, "profile must be one of .* Did you mean clean?"),
        ({"max_scores": 3}, "max_scores is no rule. Did you mean max_score?"),
    ],
)
def test_settings_are_checked(given, words):
    for make in (mctf.parallel_env, mctf.env, mctf.raw_env):
        with pytest.raises(ValueError, match=words):
            make(**given)


@pytest.mark.parametrize("seed", [-1, 2**64, 0.5, "1", True, np.float64(3)])
def test_seeds_are_checked(seed):
    env = mctf.parallel_env()
    with pytest.raises(ValueError, match=r"seed must be a whole number in \[0, 2\*\*64\), but is"):
        env.reset(seed=seed)


def test_options_are_checked():
    with pytest.raises(ValueError, match="options may have 'state' only, but has 'states'"):
        mctf.parallel_env().reset(options={"states": {}})
