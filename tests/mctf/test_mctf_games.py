"""Whole games: the same game comes out the same in any company, and the counters agree with the score."""

import threading

import numpy as np
import pytest

from mctf.commands import STOP
from mctf.draws import seed_of
from mctf.observe import observation_size, observe
from mctf.play import play_scripted
from mctf.rules import make_rules
from mctf.scripted import NAMES, RANDOM, act
from mctf.start import reset
from mctf.state import (
    CAPTURED,
    CAPTURES,
    GRABBED,
    GRABS,
    HIT_WALL,
    LOST_BY_TAG,
    LOST_BY_WALL,
    TAGGED,
    TAGS,
    UNTAGGED,
    WAS_TAGGED,
    empty,
)


def drawn(games, team_size, seed=0):
    policies = np.random.default_rng(seed).integers(0, len(NAMES), (games, 2 * team_size))
    return policies, np.array([seed_of(np.uint64(seed), np.uint64(i)) for i in range(games)], np.uint64)


def same(one, other):
    for name, mine, theirs in zip(one._fields, one, other, strict=True):
        assert mine.tobytes() == theirs.tobytes(), name


@pytest.mark.parametrize("team_size", [1, 2, 3, 5])
def test_a_game_does_not_depend_on_its_company(team_size):
    rules = make_rules(team_size=team_size)
    policies, seeds = drawn(12, team_size)
    together = play_scripted(policies, seeds, rules)
    for b in (0, 5, 11):
        alone = play_scripted(policies[b : b + 1], seeds[b : b + 1], rules)
        same(alone, type(alone)(*(array[b : b + 1] for array in together)))
    turned = play_scripted(policies[::-1], seeds[::-1], rules)
    same(together, type(turned)(*(np.ascontiguousarray(array[::-1]) for array in turned)))


def test_threads_do_not_matter():
    rules = make_rules()
    policies, seeds = drawn(40, 2)
    results = [None, None]

    def play(half):
        results[half] = play_scripted(policies[half::2], seeds[half::2], rules)

    threads = [threading.Thread(target=play, args=(half,)) for half in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    together = play_scripted(policies, seeds, rules)
    for half in range(2):
        same(results[half], type(together)(*(np.ascontiguousarray(array[half::2]) for array in together)))


@pytest.mark.parametrize("oob_counts", [True, False])
@pytest.mark.parametrize("team_size", [1, 2, 3])
def test_counters_agree_with_the_score(team_size, oob_counts):
    rules = make_rules(team_size=team_size, max_score=9, oob_counts_as_tag=oob_counts)
    policies, seeds = drawn(40, team_size, seed=1)
    policies[::2] = RANDOM
    policies[1::2, 0] = RANDOM
    state = play_scripted(policies, seeds, rules)
    totals = state.events.reshape(40, 2, team_size, -1).sum(axis=2)
    foes = totals[:, ::-1]
    walls = foes[..., HIT_WALL] if oob_counts else 0
    np.testing.assert_array_equal(totals[..., GRABBED], state.score[..., GRABS])
    np.testing.assert_array_equal(totals[..., CAPTURED], state.score[..., CAPTURES])
    np.testing.assert_array_equal(totals[..., TAGGED] + walls, state.score[..., TAGS])
    np.testing.assert_array_equal(totals[..., WAS_TAGGED], foes[..., TAGGED])
    np.testing.assert_array_equal(state.events[..., WAS_TAGGED] - state.events[..., UNTAGGED], state.is_tagged)
    lost = state.events[..., CAPTURED] + state.events[..., LOST_BY_TAG] + state.events[..., LOST_BY_WALL]
    np.testing.assert_array_equal(state.events[..., GRABBED] - lost, state.has_flag)
    assert totals[..., [GRABBED, CAPTURED, TAGGED, HIT_WALL]].sum(axis=(0, 1)).min() > 0


def test_the_seed_moves_the_random_policy_only():
    rules = make_rules(max_time_s=60)
    policies = np.array([[RANDOM, 0, 1, 2], [4, 0, 1, 2]])
    one, other = (play_scripted(policies, np.array([seed, seed], np.uint64), rules) for seed in (1, 2))
    assert not np.array_equal(one.pos[0, 0], other.pos[0, 0])
    assert np.array_equal(one.pos[1], other.pos[1])


@pytest.mark.parametrize(
    ("policies", "seeds", "named"),
    [
        (np.zeros((3, 2), int), np.zeros(3), "policies"),
        (np.full((3, 4), 99), np.zeros(3), "policies"),
        (np.zeros((3, 4), int), np.zeros(2), "seeds"),
    ],
)
def test_what_does_not_fit_is_named(policies, seeds, named):
    with pytest.raises(ValueError, match=named):
        play_scripted(policies, seeds.astype(np.uint64), make_rules())


def test_random_policy_draws_all_actions():
    raw, rules = np.zeros(45), make_rules()
    state = empty(1, rules)
    drawn = {act(RANDOM, state, 0, 0, raw, rules) for _ in range(500)}
    assert drawn == set(range(17))


def test_a_hard_defender_beyond_its_flag_stands_still(scene):
    game = scene()
    game.put(0, 190.0, 50.0)
    game.put(2, 100.0, 50.0, is_tagged=True)
    game.put(3, 90.0, 50.0, is_tagged=True)
    raw = np.zeros((4, 45))
    observe(game.state, 0, game.rules, raw)
    assert act(NAMES.index("defend_hard"), game.state, 0, 0, raw[0], game.rules) == STOP


def test_both_sides_see_the_same():
    """Half a turn of the field turns blue into red: walls, flags and team-mates are where they were."""
    rules = make_rules(team_size=3)
    blue, red = empty(1, rules), empty(1, rules)
    rng = np.random.default_rng(0)
    for state in (blue, red):
        reset(state, 0, rules)
    blue.pos[0] = np.float32(rng.uniform([5, 5], [195, 95], (6, 2)))
    blue.heading[0] = rng.uniform(-180, 180, 6)
    red.pos[0] = np.array([200.0, 100.0]) - np.roll(blue.pos[0], 3, axis=0)
    red.heading[0] = (np.roll(blue.heading[0], 3) + 360.0) % 360.0 - 180.0
    seen = np.zeros((2, 6, observation_size(rules)))
    observe(blue, 0, rules, seen[0])
    observe(red, 0, rules, seen[1])
    np.testing.assert_allclose(seen[0, :3], seen[1, 3:], atol=1e-4)
