import numpy as np
import pytest

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.env.rps import Rps
from berteam_cli.games import Games, arrangements, as_side_0, both_sides, in_turn, pairings, seeds_of
from berteam_cli.workers import Workers
from tests.makers import SHORT, mctf, random_networks


def played(games, policies, lineups, key=7, record=True):
    outcomes, experience = games.play(policies, lineups, key, record=record)
    return [outcomes.scores, outcomes.steps, outcomes.events, outcomes.seeds, *trimmed(experience)]


def trimmed(experience):
    """What was written: rows behind the end of a game hold no meaning."""
    rows = []
    for b, length in enumerate(experience.lengths):
        rows.append(experience.observations[b, :, : length + 1])
        rows += [experience.actions[b, :, :length], experience.rewards[b, :, :length]]
    return [*rows, experience.lengths, experience.terminated]


def same(a, b):
    assert len(a) == len(b)
    for x, y in zip(a, b, strict=True):
        np.testing.assert_array_equal(x, y)


@pytest.fixture(scope="module")
def lineups():
    rng = np.random.default_rng(3)
    return pairings(rng.integers(9, size=(20, 2)), rng.integers(9, size=(20, 2)))


def policies(games):
    return joined([random_networks(6, games.env), fixed_policies([2, 5, 6])])


def test_the_number_of_workers_changes_nothing(lineups):
    """O12: every game draws from a stream of its own."""
    alone = mctf(1, **SHORT)
    expected = played(alone, policies(alone), lineups)
    for workers in (2, 3, 5):
        games = mctf(workers, **SHORT)
        same(played(games, policies(games), lineups), expected)


def test_a_game_is_the_same_alone_and_among_others(lineups):
    games = mctf(1, **SHORT)
    together = played(games, policies(games), lineups, record=False)
    seeds = seeds_of(7, 20)
    assert len(set(seeds.tolist())) == 20
    first_ten = pairings(lineups.teams[:10, 0], lineups.teams[:10, 1])
    same([x[:10] for x in together[:4]], played(games, policies(games), first_ten, record=False)[:4])


def test_another_key_is_another_game(lineups):
    games = mctf(1, **SHORT)
    one, two = (played(games, policies(games), lineups, key=key) for key in (1, 2))
    assert any((a != b).any() for a, b in zip(one[4:24], two[4:24], strict=True) if a.shape == b.shape)
    assert not set(seeds_of(1, 100).tolist()) & set(seeds_of(2, 100).tolist())


def test_experience_is_what_happened(lineups):
    games = mctf(2, **SHORT)
    outcomes, experience = games.play(policies(games), lineups, 7, record=True)
    np.testing.assert_array_equal(experience.members, lineups.teams.reshape(20, 4))
    np.testing.assert_array_equal(experience.lengths, outcomes.steps)
    for b, length in enumerate(experience.lengths):
        assert np.isfinite(experience.observations[b, :, : length + 1]).all()
        actions = experience.actions[b, :, :length]
        assert ((actions >= 0) & (actions < 17)).all()
        assert experience.terminated[b] == (outcomes.event("captures")[b].sum() > 0)
        if not experience.terminated[b]:
            assert length == 60


def test_nothing_is_kept_where_nobody_learns(lineups):
    games = mctf(1, **SHORT)
    _, experience = games.play(policies(games), lineups, 7)
    assert experience.observations.size == experience.rewards.size == len(experience.lengths) == 0


def test_scores_are_captures_and_sides_are_told_apart():
    games = mctf(1)
    blue_wins = pairings(np.array([[2, 2]]), np.array([[6, 6]]))
    red_wins = pairings(np.array([[6, 6]]), np.array([[2, 2]]))
    fixed = fixed_policies(range(7))
    for lineup, winner in ((blue_wins, 0), (red_wins, 1)):
        outcomes, _ = games.play(fixed, lineup, 0)
        assert outcomes.scores[0, winner] == 1
        assert outcomes.scores[0, 1 - winner] == 0
        assert outcomes.event("captures")[0, winner] == 1
        assert outcomes.event("grabs")[0, winner] >= 1
        np.testing.assert_array_equal(outcomes.winners, [[2, 2]])


def test_sides_are_taken_in_turn_anew_for_every_team():
    np.testing.assert_array_equal(in_turn(6, 3), [0, 1, 0] * 2)
    np.testing.assert_array_equal(in_turn(8, 4, 3), [0, 1, 2, 0] * 2)


def test_both_sides_and_back():
    ours, theirs = np.array([[0, 0], [1, 1], [2, 2]]), np.array([[7, 7], [8, 8], [9, 9]])
    lineups = both_sides(ours, theirs, 3)
    np.testing.assert_array_equal(lineups.teams[:, 0, 0], [0, 8, 2])
    games = mctf(1, **SHORT)
    outcomes, _ = games.play(random_networks(10, games.env), lineups, 0)
    turned = as_side_0(outcomes, 3)
    np.testing.assert_array_equal(turned.lineups.teams[:, 0], ours)
    np.testing.assert_array_equal(turned.lineups.teams[:, 1], theirs)
    np.testing.assert_array_equal(
        turned.scores[:, 0], [outcomes.scores[0, 0], outcomes.scores[1, 1], outcomes.scores[2, 0]]
    )
    np.testing.assert_array_equal(turned.events[1], outcomes.events[1, ::-1])


def test_every_side_of_three_and_back():
    games = Games(Rps(1, 3), Workers(1))
    ours, theirs = np.zeros((3, 1), dtype=int), np.ones((3, 1), dtype=int)
    lineups = both_sides(ours, theirs, 3, 3)
    np.testing.assert_array_equal(lineups.teams[:, :, 0], [[0, 1, 1], [1, 0, 1], [1, 1, 0]])
    outcomes, _ = games.play(fixed_policies([1, 0]), lineups, 0)  # paper against two rocks
    np.testing.assert_array_equal(outcomes.scores, np.eye(3))
    turned = as_side_0(outcomes, 3)
    np.testing.assert_array_equal(turned.scores, [[1, 0, 0]] * 3)
    np.testing.assert_array_equal(turned.lineups.teams[:, :, 0], [[0, 1, 1]] * 3)


def test_the_sides_after_ours_keep_their_order():
    outcomes, _ = Games(Rps(1, 3), Workers(1)).play(
        fixed_policies(range(3)), both_sides(np.array([[0]] * 3), np.array([[1]] * 3), 3, 3), 0
    )
    outcomes.events[:, :, 0] = [[10, 11, 12]] * 3
    np.testing.assert_array_equal(as_side_0(outcomes, 3).events[:, :, 0], [[10, 11, 12], [11, 12, 10], [12, 10, 11]])


@pytest.mark.parametrize("sides", [2, 3, 5])
def test_ways_to_hold_the_sides_differ_and_one_team_is_alone(sides):
    ways = arrangements(sides)
    assert len({tuple(way) for way in ways}) == len(ways) == (2 if sides == 2 else 2 * sides)
    assert set(ways.sum(axis=1)) == {1, sides - 1}
    np.testing.assert_array_equal(ways.sum(axis=0), len(ways) / 2)
    np.testing.assert_array_equal(ways[:2, 0], [True, False])


def test_pairings_of_three_sides():
    teams = pairings(np.array([[0, 1]]), np.array([[2, 3]]), 3).teams
    np.testing.assert_array_equal(teams, [[[0, 1], [2, 3], [2, 3]]])
