import math
import warnings

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test, parallel_seed_test

import mctf


@pytest.mark.parametrize("team_size", [1, 2, 3, 5])
def test_pettingzoo(team_size):
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        parallel_api_test(mctf.parallel_env(team_size=team_size), num_cycles=500)
        parallel_seed_test(lambda: mctf.parallel_env(team_size=team_size), num_cycles=50)


def stop(env):
    return dict.fromkeys(env.agents, 16)


def test_time_out_is_a_truncation():
    env = mctf.parallel_env(max_time_s=3)
    env.reset(seed=0)
    assert env.agents == ["blue_0", "blue_1", "red_0", "red_1"]
    for _ in range(3):
        assert env.agents
        _, _, terminated, truncated, infos = env.step(stop(env))
    assert all(truncated.values())
    assert not any(terminated.values())
    assert env.agents == []
    assert set(infos["red_1"]) > {"grabs", "steps_tagged", "team_tags"}
    with pytest.raises(RuntimeError, match="step"):
        env.step({})


def test_capture_is_a_termination_and_rewards_follow_it():
    env = mctf.parallel_env(team_size=1)
    env.reset()
    env._state.pos[0, 0] = 100.0, 20.0
    env._state.has_flag[0, 0] = env._state.flag_taken[0, 1] = env._state.pickup[0, 0] = True
    env._state.steps[0] = 7
    _, rewards, terminated, truncated, infos = env.step(stop(env))
    assert all(terminated.values())
    assert not any(truncated.values())
    assert rewards == {"blue_0": 1.0, "red_0": -1.0}
    assert infos["blue_0"]["captures"] == infos["blue_0"]["team_captures"] == 1
    assert infos["red_0"]["captures"] == infos["red_0"]["team_captures"] == 0


def test_step_before_reset():
    with pytest.raises(RuntimeError, match="reset"):
        mctf.parallel_env().step({})


@pytest.mark.parametrize("action", [17, -1, -2, math.nan, math.inf, 0.5, "4", None, [4], True])
def test_actions_that_are_not_allowed(action):
    env = mctf.parallel_env()
    env.reset()
    with pytest.raises(ValueError, match=r"actions\['red_0'\] must be a whole number 0..16, but is"):
        env.step(stop(env) | {"red_0": action})
    assert env.agents  # and the game goes on
    env.step(stop(env) | {"red_0": np.int64(3), "red_1": np.array(4)})


def test_actions_must_be_of_the_agents():
    env = mctf.parallel_env()
    env.reset()
    with pytest.raises(ValueError, match=r"lacks \['blue_0'\] and has \['green_0'\]"):
        actions = stop(env)
        del actions["blue_0"]
        env.step(actions | {"green_0": 0})


def test_settings_are_checked():
    with pytest.raises(ValueError, match="reward must be one of"):
        mctf.parallel_env(reward="none")
    with pytest.raises(ValueError, match="team_size"):
        mctf.parallel_env(team_size=0)
    with pytest.raises(TypeError):
        mctf.parallel_env(wind=3)


def test_rewards_are_chosen_by_name():
    earned = {}
    for name in ("custom_rew2", "custom_rew", "sparse"):
        env = mctf.parallel_env(reward=name)
        env.reset()
        env.step(dict.fromkeys(env.agents, 4))
        earned[name] = env.step(dict.fromkeys(env.agents, 4))[1]["blue_0"]
    assert earned["custom_rew2"] == earned["sparse"] == 0.0
    assert 0.0 < earned["custom_rew"] < 0.1
