import numpy as np
import pytest

from berteam_cli.env.rps import Rps
from berteam_cli.outcomes import Experience
from berteam_cli.selector.observations import Looking, Seen, looking, nothing_seen, seen_in
from tests.makers import mctf

SETTINGS = {
    "use": "self",
    "stride": 3,
    "drop_input": 0.5,
    "drop_player": 0.1,
    "embed": "lstm",
    "lstm_layers": 2,
}


def watching(longest, stride):
    return Looking(**SETTINGS | {"stride": stride}, rows=longest // stride + 1, numbers=2)


def experience(lengths, players, longest):
    """Returns one whose observations tell game, player and step; what lies beyond an end is NaN.

    Args:
        lengths: (B,) of games, or (B, V) of each player, which makes a row of each.
        players: V.
        longest: L.
    """
    lengths = np.asarray(lengths)
    games, steps = len(lengths), np.arange(longest + 1)
    observations = np.empty((games, players, longest + 1, 2), dtype=np.float32)
    observations[..., 0] = (10 * np.arange(games)[:, np.newaxis] + np.arange(players))[..., np.newaxis]
    observations[..., 1] = steps
    ends = np.broadcast_to(lengths.reshape(games, -1), (games, players))
    observations[steps > ends[..., np.newaxis]] = np.nan
    each = lengths.ndim == 2
    rows = (games * players, 1) if each else (games, players)
    return Experience(
        members=np.zeros(rows, dtype=np.int64),
        observations=observations.reshape(*rows, longest + 1, 2),
        actions=np.zeros((*rows, longest), dtype=np.int16),
        rewards=np.zeros((*rows, longest), dtype=np.float32),
        lengths=lengths.ravel(),
        terminated=np.ones(rows[0], dtype=np.bool_),
    )


def test_steps_that_are_kept_by_hand():
    seen = seen_in(experience([7, 6, 2, 0], 2, 7), 4, 2, watching(7, 3))
    assert seen.rows.shape == (4, 2, 1, 3, 2)
    assert seen.rows.dtype == np.float16
    assert seen.lengths[:, :, 0].tolist() == [[3, 3], [3, 3], [1, 1], [1, 1]]
    steps = [seen.rows[b, 0, 0, : seen.lengths[b, 0, 0], 1].tolist() for b in range(4)]
    assert steps == [[1, 4, 7], [0, 3, 6], [2], [0]]
    assert not seen.rows[2:, :, :, 1:].any()


@pytest.mark.parametrize("stride", [1, 2, 5, 20])
def test_the_last_observation_is_always_kept_and_the_others_a_stride_apart(stride):
    lengths = np.arange(14)
    seen = seen_in(experience(lengths, 4, 13), 14, 2, watching(13, stride))
    assert seen.rows.shape == (14, 2, 2, 13 // stride + 1, 2)
    assert np.isfinite(seen.rows).all()  # nothing beyond the end of a game
    for b, s, t in np.ndindex(14, 2, 2):
        kept = seen.rows[b, s, t, : seen.lengths[b, s, t]]
        assert np.all(kept[:, 0] == 10 * b + 2 * s + t)  # of the player himself
        assert kept[-1, 1] == lengths[b]
        assert np.all(np.diff(kept[:, 1]) == stride)
        assert 0 <= kept[0, 1] < stride  # as many as there are


def test_a_game_with_one_length_is_seen_as_with_that_length_for_each_player():
    lengths, looked = np.array([5, 3, 0]), watching(6, 2)
    shared = seen_in(experience(lengths, 6, 6), 3, 3, looked)
    each = seen_in(experience(np.repeat(lengths[:, np.newaxis], 6, axis=1), 6, 6), 3, 3, looked)
    assert np.array_equal(shared.rows, each.rows)
    assert np.array_equal(shared.lengths, each.lengths)


def test_players_who_leave_early_have_lengths_of_their_own():
    lengths = np.array([[6, 2, 5, 0], [1, 6, 3, 4]])
    seen = seen_in(experience(lengths, 4, 6), 2, 2, watching(6, 2))
    assert np.array_equal(seen.lengths, (lengths // 2 + 1).reshape(2, 2, 2))
    for b, s, t in np.ndindex(2, 2, 2):
        last = seen.rows[b, s, t, seen.lengths[b, s, t] - 1]
        assert last.tolist() == [10 * b + 2 * s + t, lengths[b, 2 * s + t]]


def test_numbers_beyond_half_precision_stay_finite():
    played = experience([1], 2, 1)
    played.observations[0, 0] = [[1e9, -1e9], [np.inf, 65_000.0]]
    seen = seen_in(played, 1, 2, watching(1, 1))
    assert seen.rows[0, 0, 0].tolist() == [[65_504, -65_504], [65_504, 64_992]]
    assert played.observations[0, 0, 0, 0] == np.float32(1e9)


@pytest.mark.parametrize("stride", [1, 7, 60, 1000])
def test_looking_has_room_for_the_longest_game(stride):
    env = mctf(max_time_s=60.0).env
    looked = looking(SETTINGS | {"stride": stride}, env)
    assert looked.rows == env.longest // stride + 1
    assert looked.numbers == env.observation_size
    seen = seen_in(experience([env.longest], 4, env.longest), 1, 2, watching(env.longest, stride))
    assert np.all(seen.lengths == looked.rows)
    small = looking(SETTINGS | {"stride": stride}, Rps(team_size=3, sides=3))
    assert (small.rows, small.numbers) == (1 if stride > 1 else 2, 7)


def test_nothing_is_kept_where_nothing_is_used():
    looked = looking(SETTINGS | {"use": "none"}, Rps(team_size=2))
    assert (looked.rows, looked.numbers) == (0, 0)
    blind = nothing_seen((4, 2), 3)
    assert blind.rows.shape == (4, 2, 3, 0, 0)
    assert not blind.lengths.any()


def test_what_some_teams_saw_can_be_picked():
    seen = seen_in(experience([3, 1, 2], 4, 3), 3, 2, watching(3, 1))
    some = seen[np.array([2, 0]), np.array([1, 0])]
    assert isinstance(some, Seen)
    assert some.lengths.tolist() == [[3, 3], [4, 4]]
    assert some.rows[:, :, 0, 0].tolist() == [[22, 23], [0, 1]]
