"""What helps members to learn: they see the last steps, and practise from other starts."""

import pickle

import numpy as np
import pytest

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.build import curriculum
from berteam_cli.config_env import CurriculumConfig
from berteam_cli.curriculum import Curriculum
from berteam_cli.env.mctf import Mctf
from berteam_cli.env.rps import Rps
from berteam_cli.errors import InputError
from berteam_cli.games import pairings
from mctf.practice import BY_THE_RULES, Starts
from tests.makers import mctf, random_networks

SHORT = {"max_time_s": 60.0, "world_size_m": (80.0, 50.0)}
LINEUPS = pairings(np.array([[2, 6], [5, 2], [6, 6]]), np.array([[2, 5], [6, 6], [0, 1]]))


def played(k, policies=None, **settings):
    games = mctf(1, last_steps=k, **SHORT | settings)
    return games.play(fixed_policies(range(7)) if policies is None else policies, LINEUPS, 5, record=True)


def test_the_last_steps_are_seen_newest_first():
    """Scripted policies see the newest step only, so that the games are the same."""
    (one, plain), (three, stacked) = played(1), played(3)
    size = plain.observations.shape[-1]
    assert stacked.observations.shape[-1] == 3 * size
    np.testing.assert_array_equal(one.steps, three.steps)
    for b, steps in enumerate(one.steps):
        seen, newest = stacked.observations[b, :, : steps + 1], plain.observations[b, :, : steps + 1]
        for back in range(3):
            before = np.maximum(np.arange(steps + 1) - back, 0)  # the first again and again at the beginning
            np.testing.assert_array_equal(seen[..., back * size : (back + 1) * size], newest[:, before])
        np.testing.assert_array_equal(stacked.actions[b, :, :steps], plain.actions[b, :, :steps])
        np.testing.assert_array_equal(stacked.rewards[b, :, :steps], plain.rewards[b, :, :steps])


def test_the_next_game_remembers_nothing_of_the_one_before():
    _, seen = played(3)
    size = seen.observations.shape[-1] // 3
    first = seen.observations[:, :, 0].reshape(3, 4, 3, size)
    np.testing.assert_array_equal(first[:, :, 0], first[:, :, 2])


def faster(terms, before, after):
    return after[14] - before[14] if len(before) == 45 and len(after) == 45 else 1e9


def test_own_rewards_see_the_newest_step():
    """The speed before and after, of 45 numbers."""
    (steps, plain), (_, stacked) = (played(k, reward=faster) for k in (1, 4))
    for b, length in enumerate(steps.steps):
        np.testing.assert_array_equal(plain.rewards[b, :, :length], stacked.rewards[b, :, :length])
        assert plain.rewards[b, :, :length].any()


def test_a_network_of_fewer_steps_plays_as_ever_beside_others_of_more():
    """It reads the first numbers, which are the newest: so runs of different last_steps can meet."""
    few = random_networks(7, mctf(last_steps=1).env, seed=3)
    alone, seen = played(1, few)
    among, again = played(3, joined([few, random_networks(1, mctf(last_steps=3).env)]))
    np.testing.assert_array_equal(alone.steps, among.steps)
    for b, steps in enumerate(alone.steps):
        np.testing.assert_array_equal(seen.actions[b, :, :steps], again.actions[b, :, :steps])


def test_networks_make_use_of_the_last_steps():
    """Networks that agree on the newest step and differ on the one before do not play the same game."""
    env = mctf(last_steps=2).env
    table = random_networks(7, env, seed=3)
    blind = table.weights.copy().reshape(7, -1)
    size, hidden = env.observation_size // 2, 8
    blind[:, size * hidden : 2 * size * hidden] = 0.0
    _, seeing = played(2, table)
    _, not_seeing = played(2, table._replace(weights=blind))
    few = random_networks(7, mctf(last_steps=1).env)
    cut = np.concatenate([blind[:, : size * hidden], blind[:, 2 * size * hidden :]], axis=1)
    _, alone = played(1, few._replace(weights=np.ascontiguousarray(cut)))
    np.testing.assert_array_equal(not_seeing.actions[:, :, :10], alone.actions[:, :, :10])
    assert (seeing.actions[:, :, :10] != alone.actions[:, :, :10]).any()


@pytest.mark.parametrize("k", [0, 17, -1])
def test_as_many_steps_as_are_allowed(k):
    with pytest.raises(ValueError, match=f"last_steps must be a whole number from 1 to 16, but is {k}"):
        mctf(last_steps=k)


def carried(outcomes, seen):
    """Returns (B,) whether somebody had the flag in the very first moment."""
    return (seen.observations[:, :, 0, 15] > 0).any(axis=1)


def many(games, record=True):
    lineups = pairings(np.full((60, 2), 0), np.full((60, 2), 5))
    return games.play(fixed_policies(range(7)), lineups, 5, record=record)


def test_practice_starts_otherwise_and_the_game_itself_does_not():
    games = mctf(1, **SHORT)
    before, seen = many(games)
    practised = Curriculum(Starts(carrying=0.5), 0).practice(games, 7)
    outcomes, other = many(practised)
    assert 15 < carried(outcomes, other).sum() < 45
    after, again = many(games)
    assert not carried(after, again).any()
    np.testing.assert_array_equal(before.steps, after.steps)
    np.testing.assert_array_equal(seen.observations[:, :, 0], again.observations[:, :, 0])
    # Nobody has grabbed what they started with: there may be captures without
    assert (outcomes.event("captures").sum(axis=1) > outcomes.event("grabs").sum(axis=1)).any()


def test_games_that_start_by_the_rules_are_the_same_in_practice():
    """Which start a game has is drawn from its own stream, before anything else is."""
    games = mctf(1, **SHORT)
    practised = Curriculum(Starts(random=0.5), 0).practice(games, 0)
    (plain, seen), (drawn, other) = many(games), many(practised)
    same = (seen.observations[:, :, 0] == other.observations[:, :, 0]).all(axis=(1, 2))
    assert 15 < same.sum() < 45
    np.testing.assert_array_equal(plain.steps[same], drawn.steps[same])  # these policies draw nothing


def test_a_game_that_travels_keeps_its_starts_and_its_settings():
    env = mctf(1, last_steps=2, potential=0.5, team_share=0.25, **SHORT).env.practice(Starts(random=0.25))
    again = pickle.loads(pickle.dumps(env))
    assert again.starts == Starts(random=0.25)
    assert (again.observation_size, again.last_steps) == (90, 2)
    assert again.reward.shaping == env.reward.shaping
    assert again.fingerprint() == env.fingerprint()
    assert mctf().env.starts == BY_THE_RULES


def test_shares_fall_as_told():
    falling, lasting = (Curriculum(Starts(0.2, 0.4, 0.1, 25.0), until) for until in (10, 0))
    assert falling.in_epoch(0) == lasting.in_epoch(0) == lasting.in_epoch(10**6) == Starts(0.2, 0.4, 0.1, 25.0)
    assert falling.in_epoch(5) == Starts(0.1, 0.2, 0.05, 25.0)
    assert falling.in_epoch(9) == pytest.approx((0.02, 0.04, 0.01, 25.0))
    assert falling.in_epoch(10) == falling.in_epoch(11) == Starts(0.0, 0.0, 0.0, 25.0)
    games = mctf()
    assert falling.practice(games, 10) is games
    assert falling.practice(games, 9).env.starts == falling.in_epoch(9)
    assert Curriculum(BY_THE_RULES, 0).practice(games, 0) is games


def test_what_is_refused():
    told = {"near_flag_m": 30.0, "until": 0}
    with pytest.raises(InputError, match="curriculum: random, near_flag and carrying must be at most 1 together, but"):
        curriculum(CurriculumConfig(random=0.5, near_flag=0.4, carrying=0.2, **told), mctf().env)
    with pytest.raises(InputError, match="curriculum must be none with env=rps, as only games of env=mctf"):
        curriculum(CurriculumConfig(random=0.5, near_flag=0.0, carrying=0.0, **told), Rps(team_size=2, sides=2))
    assert curriculum(CurriculumConfig(random=0.0, near_flag=0.0, carrying=0.0, **told), Rps(2, 2)).total == 0
    assert curriculum(CurriculumConfig(random=0.7, near_flag=0.2, carrying=0.1, **told), mctf().env).total == 1
    assert isinstance(mctf().env, Mctf)
