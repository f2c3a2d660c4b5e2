"""What others do with the environment: PettingZoo's own tests, its turns, SuperSuit, Stable-Baselines3."""

import warnings

import numpy as np
import pytest
from pettingzoo.test import (
    api_test,
    max_cycles_test,
    parallel_api_test,
    parallel_seed_test,
    render_test,
    seed_test,
    state_test,
)
from pettingzoo.utils.conversions import aec_to_parallel
from stable_baselines3 import PPO
from stable_baselines3.common.utils import set_random_seed

import mctf
from mctf import mctf_v0, render
from mctf.kernel import RUNNING, TIME_OUT, finished
from mctf.profiles import PROFILES

CASES = [(profile, size) for profile in PROFILES for size in range(1, 11)]


@pytest.fixture
def no_other_warnings():
    """PettingZoo warns of what it dislikes; it may dislike that spaces have no bounds, and nothing else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        warnings.filterwarnings("ignore", ".* space value is -?infinity", UserWarning)
        yield


@pytest.mark.usefixtures("no_other_warnings")
@pytest.mark.parametrize(("profile", "size"), CASES)
def test_all_at_once(profile, size):
    def make():
        return mctf_v0.parallel_env(profile=profile, team_size=size, max_cycles=60, starts="random")

    parallel_api_test(make(), num_cycles=80)
    parallel_seed_test(make, num_cycles=20)


@pytest.mark.usefixtures("no_other_warnings")
@pytest.mark.parametrize(("profile", "size"), CASES)
def test_in_turns(profile, size):
    def make(**given):
        return mctf_v0.env(profile=profile, team_size=size, max_cycles=20, starts="random", **given)

    api_test(make(), num_cycles=30)
    seed_test(make, num_cycles=10)
    state_test(make(), mctf_v0.parallel_env(profile=profile, team_size=size), num_cycles=30)


@pytest.mark.usefixtures("no_other_warnings")
@pytest.mark.parametrize("actions", ["discrete", "continuous", "field_points"])
@pytest.mark.parametrize("observations", ["normalised", "raw"])
@pytest.mark.parametrize("profile", PROFILES)
def test_kinds_of_actions_and_observations(profile, actions, observations):
    given = {"profile": profile, "actions": actions, "observations": observations, "team_size": (1, 2)}
    parallel_api_test(mctf_v0.parallel_env(**given, max_cycles=30), num_cycles=40)
    parallel_seed_test(lambda: mctf_v0.parallel_env(**given), num_cycles=10)
    api_test(mctf_v0.env(**given, max_cycles=10), num_cycles=20)
    api_test(mctf_v0.raw_env(**given, max_cycles=10), num_cycles=20)


def test_pettingzoo_renders(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(render, "FRAMES_PER_SECOND", 1000)
    render_test(mctf_v0.env)


@pytest.mark.parametrize("profile", ["pyquaticus-2024-06", "pyquaticus-2025-11"])
@pytest.mark.parametrize("substeps", [1, 3, 10])
def test_max_cycles_is_a_number_of_steps(profile, substeps):
    env = mctf.parallel_env(max_cycles=307, profile=profile, substeps=substeps)
    env.reset()
    for _ in range(307):
        assert env.agents
        env.step(dict.fromkeys(env.agents, 4))
    assert not env.agents


@pytest.mark.parametrize("profile", ["pyquaticus-2024-06", "clean"])
def test_the_last_of_many_steps_is_played(profile):
    """Where the clock does not overrun, a game of the rules is over near its time already."""
    env = mctf.parallel_env(max_cycles=200_000, profile=profile)
    env.reset()
    state = env._lanes.state
    for steps, end in ((199_999, RUNNING), (200_000, TIME_OUT)):
        substeps = np.full(steps * env.rules.substeps, env.rules.tau_s)
        state.time[0] = np.add.accumulate(substeps)[-1]  # one after the other, as the clock runs
        assert finished(state, 0, env.rules) == end


def test_max_cycles():
    max_cycles_test(mctf_v0)
    with pytest.raises(ValueError, match="max_cycles and max_time_s say the same"):
        mctf.parallel_env(max_cycles=3, max_time_s=3)
    with pytest.raises(ValueError, match="max_cycles must be a whole number >= 1, but is 0"):
        mctf.parallel_env(max_cycles=0)


def test_turns_are_the_same_game():
    together, turns = mctf.parallel_env(starts="random"), mctf.env(starts="random")
    together.reset(seed=2)
    turns.reset(seed=2)
    rng = np.random.default_rng(0)
    for _ in range(40):
        actions = {agent: int(rng.integers(17)) for agent in together.agents}
        for agent in turns.agent_iter(4):
            turns.step(actions[agent])
        observations, rewards, *_ = together.step(actions)
        assert turns.rewards == rewards
        assert all(np.array_equal(turns.observe(agent), observations[agent]) for agent in actions)
        np.testing.assert_array_equal(turns.state(), together.state())
    assert isinstance(aec_to_parallel(turns), type(together))


def test_turns_refuse_an_action_at_once():
    turns = mctf.env(max_cycles=1)
    with pytest.raises(RuntimeError, match="step must come after reset"):
        turns.step(0)
    turns.reset()
    for action in (17, None):
        with pytest.raises(ValueError, match=r"actions\['blue_0'\] must be a whole number 0..16"):
            turns.step(action)
    for agent in list(turns.agents):
        assert turns.agent_selection == agent
        turns.step(16)
    with pytest.raises(ValueError, match="the action of blue_0 must be None, as its game is over, but is 3"):
        turns.step(3)
    for _ in range(4):
        turns.step(None)
    with pytest.raises(RuntimeError, match="before the end of the game"):
        turns.step(None)


@pytest.mark.parametrize("actions", ["discrete", "continuous"])
def test_supersuit_and_stable_baselines3(actions):
    supersuit = pytest.importorskip("supersuit")  # it is not built for every Python
    env = supersuit.frame_stack_v1(mctf.parallel_env(actions=actions, max_cycles=20, profile="clean"), 2)
    assert env.observation_space("blue_0").shape == (90,)
    lanes = supersuit.concat_vec_envs_v1(
        supersuit.pettingzoo_env_to_vec_env_v1(env), 2, num_cpus=0, base_class="stable_baselines3"
    )
    assert lanes.num_envs == 8
    set_random_seed(0)  # PPO's own seed wants a method that SuperSuit's lanes lack
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of minibatches, which are tiny here
        learner = PPO("MlpPolicy", lanes, n_steps=16, batch_size=64, n_epochs=1)
    before = [weight.detach().clone() for weight in learner.policy.parameters()]
    learner.learn(2 * 16 * 8)
    assert learner.num_timesteps == 2 * 16 * 8
    assert any((old != new).any() for old, new in zip(before, learner.policy.parameters(), strict=True))
