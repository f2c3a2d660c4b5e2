import numpy as np
import pytest
from numba import njit

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.env.base import blank_results
from berteam_cli.env.mctf import blank_scratch
from berteam_cli.env.mctf_game import settle
from berteam_cli.games import pairings, seeds_of
from mctf import play_scripted
from mctf.parallel import parallel_env
from mctf.state import CAPTURES, EVENTS
from tests.makers import mctf, random_networks


@pytest.mark.parametrize("team_size", [1, 2, 4])
def test_fixed_policies_play_as_in_the_package(team_size):
    """The runner's games are the package's own; policies that draw nothing decide them."""
    games = mctf(2, team_size=team_size)
    players = np.random.default_rng(team_size).integers(6, size=(30, 2, team_size))
    outcomes, _ = games.play(fixed_policies(range(7)), pairings(players[:, 0], players[:, 1]), 5)
    state = play_scripted(players.reshape(30, -1), seeds_of(5, 30), games.env.rules)
    np.testing.assert_array_equal(outcomes.steps, state.steps)
    events = state.events.reshape(30, 2, team_size, -1).sum(axis=2)
    for ours, theirs in (("captures", "captures"), ("grabs", "grabs"), ("tags", "tags"), ("wall_hits", "wall_hits")):
        np.testing.assert_array_equal(outcomes.event(ours), events[:, :, EVENTS.index(theirs)])
    gap = state.score[:, 0, CAPTURES] - state.score[:, 1, CAPTURES]
    np.testing.assert_array_equal(outcomes.scores[:, 0], (np.sign(gap) + 1) / 2)


@pytest.mark.parametrize("reward", ["custom_rew2", "custom_rew", "sparse", "outcome"])
def test_experience_is_what_the_pettingzoo_environment_gives(reward):
    """The same actions in the PettingZoo environment: the same observations, rewards and end."""
    games = mctf(1, reward=reward, max_time_s=250.0)
    # Hard attackers against networks that wander: grabs, tags and a capture happen.
    acting = random_networks(2, games.env, seed=4, scale=0.3)
    lineup = pairings(np.array([[2, 2]]), np.array([[0, 1]]))
    outcomes, seen = games.play(joined([acting, fixed_policies([2])]), lineup, 9, record=True)
    env = parallel_env(reward=reward, max_time_s=250.0)
    observations, _ = env.reset()
    agents = list(env.agents)
    for moment in range(outcomes.steps[0]):
        for v, agent in enumerate(agents):
            np.testing.assert_array_equal(seen.observations[0, v, moment], observations[agent])
        actions = {agent: int(seen.actions[0, v, moment]) for v, agent in enumerate(agents)}
        observations, rewards, terminations, truncations, _ = env.step(actions)
        for v, agent in enumerate(agents):
            assert seen.rewards[0, v, moment] == np.float32(rewards[agent])
    for v, agent in enumerate(agents):
        np.testing.assert_array_equal(seen.observations[0, v, outcomes.steps[0]], observations[agent])
    assert all(terminations.values()) == seen.terminated[0]
    assert all(truncations.values()) == (not seen.terminated[0])
    assert seen.rewards[0, :, : outcomes.steps[0]].any()


def still(terms, before, after):
    return 0.0


@pytest.mark.parametrize(
    ("paid", "ends"),
    [
        ({"reward": "custom_rew2"}, False),
        ({"reward": "outcome"}, True),
        ({"reward": "outcome", "reward_weights": {"won": 0.0, "lost": 0.0}}, False),
        ({"reward": "sparse", "reward_weights": {"drawn": -0.5}}, True),
        ({"reward": still}, False),
        ({"reward": still, "reward_weights": {"lost": -1.0}}, True),
    ],
)
def test_where_the_result_is_paid_nothing_follows_the_end_on_time(paid, ends):
    """Else learners, who cannot see the clock, would add the value of a game that pays its result again and again."""
    lineup = pairings(np.array([[6, 6]]), np.array([[6, 6]]))
    _, seen = mctf(1, max_time_s=5.0, **paid).play(fixed_policies(range(7)), lineup, 9, record=True)
    env = parallel_env(max_time_s=5.0, **paid)
    env.reset(seed=1)
    while env.agents:
        _, _, terminations, truncations, _ = env.step(dict.fromkeys(env.agents, 16))
    assert seen.terminated[0] == ends
    assert set(terminations.values()) == {ends}
    assert set(truncations.values()) == {not ends}


def test_the_random_policy_differs_from_game_to_game_and_not_from_run_to_run():
    games = mctf(1, max_time_s=60.0)
    lineups = pairings(np.full((5, 2), 6), np.full((5, 2), 6))
    first, second = (games.play(fixed_policies(range(7)), lineups, 3, record=True)[1] for _ in range(2))
    np.testing.assert_array_equal(first.actions[:, :, :60], second.actions[:, :, :60])
    assert len({a[:, :60].tobytes() for a in first.actions}) == 5


def test_the_fingerprint_tells_rules_apart_and_not_rewards():
    assert mctf().env.fingerprint() != mctf(flag_keepout_m=6.0).env.fingerprint()
    assert mctf().env.fingerprint() == mctf(reward="sparse").env.fingerprint()


def test_a_game_forgets_the_one_before_whatever_pid_reset_is():
    """The game before in the same thread would decide it otherwise, and with it the number of games."""
    games = mctf(1, pid_reset=False, first_kick=False, max_time_s=40.0)
    players = random_networks(4, games.env, seed=1)
    lineups = pairings(np.array([[0, 1]] * 16), np.array([[2, 3]] * 16))
    _, together = games.play(players, lineups, 3, record=True)
    results = blank_results(games.env, 16, record=True)
    for b in range(16):
        games.env.play(range(b, b + 1), lineups.teams.reshape(16, 4), players, seeds_of(3, 16), results)
    np.testing.assert_array_equal(together.rewards[:, :, :40], results.rewards[:, :, :40])
    np.testing.assert_array_equal(together.observations[:, :, :41], results.observations[:, :, :41])


@pytest.mark.parametrize(
    ("rules", "captures", "scores"),
    [
        ({"tie_at_max": "red", "capture_first_only": False}, (1, 1), (0.0, 1.0)),
        ({"tie_at_max": "draw", "capture_first_only": False}, (1, 1), (0.5, 0.5)),
        ({"max_score": 3, "max_time_s": 1.0}, (2, 1), (1.0, 0.0)),
        ({"max_score": 3, "max_time_s": 1.0}, (1, 1), (0.5, 0.5)),
    ],
)
def test_the_score_is_as_the_rules_end_the_game(rules, captures, scores):
    env = mctf(**rules).env
    results, scratch = blank_results(env, 1, record=False), blank_scratch(env, fixed_policies([0]))
    scratch.state.score[0, :, CAPTURES] = captures
    scratch.state.time[0] = env.rules.max_time_s

    @njit
    def settled(state, rules, results):
        settle(state, rules, 0, results)

    settled(scratch.state, env.rules, results)
    assert tuple(results.scores[0]) == scores
