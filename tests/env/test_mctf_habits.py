"""Where teams stand, and who is paid what."""

import numpy as np
import pytest
from numba import njit

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.env.base import blank_results
from berteam_cli.env.mctf import blank_scratch
from berteam_cli.env.mctf_game import settle, watch
from berteam_cli.games import as_side_0, both_sides, pairings
from berteam_cli.outcomes import HABITS
from mctf.rewards import TERMS
from tests.makers import mctf, random_networks


@njit
def watched(state, rules, results, over):
    if over:
        settle(state, rules, 0, results)
    else:
        watch(state, rules, results, 0)


@pytest.mark.parametrize(("blue_side", "turned"), [("right", False), ("left", True)])
def test_habits_by_hand(blue_side, turned):
    env = mctf(world_size_m=[160.0, 120.0], blue_side=blue_side).env  # its diagonal is 200 m
    results, scratch = blank_results(env, 1, record=False), blank_scratch(env, fixed_policies([0]))
    x = np.array([[160.0, 120.0, 40.0, 0.0], [80.0, 80.0, 0.0, 160.0]])
    y = np.array([[0.0, 30.0, 0.0, 0.0], [0.0, 120.0, 120.0, 120.0]])
    for moment in range(2):
        scratch.state.pos[0, :, 0] = 160 - x[moment] if turned else x[moment]
        scratch.state.pos[0, :, 1] = y[moment]
        watched(scratch.state, env.rules, results, False)
    results.steps[0] = 2
    watched(scratch.state, env.rules, results, True)
    blue_advance, blue_spread = ((0 + 0.25) / 2 + 0.5) / 2, (50 / 200 + 120 / 200) / 2
    red_advance, red_spread = ((0.25 + 0) / 2 + (0 + 1) / 2) / 2, (40 / 200 + 160 / 200) / 2
    np.testing.assert_allclose(results.habits[0], [[blue_advance, blue_spread], [red_advance, red_spread]])


def test_habits_are_those_of_either_side():
    games = mctf(2, max_time_s=60.0)
    us, them = np.full((4, 2), 2), np.full((4, 2), 5)  # hard attackers against hard defenders
    outcomes, _ = games.play(fixed_policies(range(7)), both_sides(us, them, 2), 3)
    ours = as_side_0(outcomes, 2)
    advance, spread = (ours.habits[:, :, k] for k in range(len(HABITS)))
    assert (advance[:, 0] > advance[:, 1] + 0.05).all()
    assert ((spread >= 0) & (spread < 1)).all()
    assert ours.followed_by(ours).habits.shape == (8, 2, 2)


def test_factors_pay_exactly_as_many_times_and_change_nothing_else():
    weights = {"nearer_m": 0.5, "wall_hit": -2.0}
    games = mctf(2, max_time_s=60.0, reward_weights=weights)
    acting = joined([random_networks(2, games.env, seed=4), fixed_policies([2])])
    lineup = pairings(np.array([[0, 1]] * 3), np.array([[2, 2]] * 3))
    plain, seen = games.play(acting, lineup, 9, record=True)
    pay = np.ones((3, len(TERMS)))
    pay[1] = 3.0
    same, paid = games.play(acting._replace(pay=pay), lineup, 9, record=True)
    np.testing.assert_array_equal(plain.steps, same.steps)
    for b, length in enumerate(plain.steps):
        np.testing.assert_array_equal(paid.observations[b, :, : length + 1], seen.observations[b, :, : length + 1])
        np.testing.assert_array_equal(paid.rewards[b, [0, 2, 3], :length], seen.rewards[b, [0, 2, 3], :length])
        np.testing.assert_allclose(paid.rewards[b, 1, :length], 3 * seen.rewards[b, 1, :length], rtol=1e-6)
        assert seen.rewards[b, 1, :length].any()


def test_a_factor_is_of_its_own_term_alone():
    rewards, lineup = [], pairings(np.array([[0, 1]]), np.array([[2, 6]]))
    for tagged, factor in ((-1.0, 0.0), (0.0, 1.0), (-1.0, 1.0)):
        games = mctf(1, max_time_s=120.0, reward_weights={"nearer_m": 1.0, "tagged": tagged})
        pay = np.ones((7, len(TERMS)))
        pay[:, TERMS.index("tagged")] = factor
        outcomes, seen = games.play(fixed_policies(range(7))._replace(pay=pay), lineup, 9, record=True)
        rewards.append(seen.rewards[0, :, : outcomes.steps[0]])
    np.testing.assert_array_equal(rewards[0], rewards[1])
    assert (rewards[0] != rewards[2]).any()  # somebody was tagged
