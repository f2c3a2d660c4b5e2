import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import ABSENT, NOBODY, Lineups, Outcomes
from berteam_cli.selector import winners as memory
from berteam_cli.selector.observations import nothing_seen
from berteam_cli.selector.winners import Examples, minibatch, no_winners


def outcomes_of(teams, scores, log_chances=None):
    teams, scores = np.array(teams), np.array(scores, dtype=float)
    games, sides = scores.shape
    chances = np.full(scores.shape, np.nan) if log_chances is None else np.array(log_chances)
    lineups = Lineups(teams, np.full(scores.shape, NOBODY), chances)
    return Outcomes(
        lineups, scores, np.ones(games, int), np.zeros((games, sides, 4), int), np.zeros(games, dtype=np.uint64)
    )


THREE_GAMES = ([[[0, 1], [2, 3]], [[4, 5], [6, 7]], [[8, 9], [0, 0]]], [[1, 0], [0.5, 0.5], [0, 1]])


def examples(teams, weights, sides=None):
    teams = np.asarray(teams)
    sides = np.zeros(len(teams), dtype=np.int64) if sides is None else np.asarray(sides)
    nothing = nothing_seen((len(teams),), teams.shape[1])
    return Examples(teams, np.asarray(weights, dtype=float), sides, nothing.rows, nothing.lengths, np.ones(len(teams)))


def pushed(winners, teams, weights):
    return memory.pushed(winners, examples(teams, weights), 10_000)


def harvest(outcomes, draw_weight, cap, members, chosen=True):
    games, sides, size = outcomes.lineups.teams.shape
    log_uniform = None if members is None else -size * math.log(members)
    chosen = np.broadcast_to(chosen, (games, sides))
    found = memory.harvest(outcomes, nothing_seen((games, sides), size), chosen, draw_weight, cap, log_uniform)
    return found.teams, found.weights


@settings(deadline=None)
@given(st.integers(1, 7), st.lists(st.integers(0, 12), max_size=6))
def test_property_the_ring_holds_the_newest_and_knows_their_ages(capacity, pushes):
    winners, history = no_winners(capacity, 2), []
    for count in pushes:
        before = (winners.held.teams.copy(), winners.held.weights.copy(), winners.pushed)
        teams = len(history) + np.stack([np.arange(count), np.arange(count)], axis=1)
        after = pushed(winners, teams, teams[:, 0] + 0.5)
        assert np.array_equal(winners.held.teams, before[0])
        assert np.array_equal(winners.held.weights, before[1])
        assert winners.pushed == before[2]
        winners = after
        history += list(range(len(history), len(history) + count))
    newest = history[-capacity:]
    assert len(winners) == len(newest)
    held = winners.held.teams[: len(winners), 0]
    assert sorted(held) == newest
    assert np.array_equal(winners.held.weights[: len(winners)], held + 0.5)
    assert np.array_equal(winners.ages, len(history) - 1 - held)


def test_the_next_team_takes_the_place_of_the_oldest():
    winners = no_winners(3, 1)
    for k in range(4):
        winners = pushed(winners, np.array([[k]]), np.ones(1))
    assert winners.held.teams.ravel().tolist() == [3, 1, 2]


def test_minibatch_weights_decay_with_age_by_hand_and_have_mean_one():
    winners = pushed(no_winners(4, 1), np.arange(4)[:, np.newaxis], np.array([8.0, 4, 3, 1]))
    drawn = minibatch([winners], 200, 2.0, np.random.default_rng(0))
    teams, weights = drawn.teams, drawn.weights
    np.testing.assert_allclose(weights.mean(), 1.0)
    each = np.array([weights[teams[:, 0] == k][0] for k in range(4)])
    # Ages 3, 2, 1, 0 pushes with half-life 2.
    np.testing.assert_allclose(each / each[3], [8 * 2**-1.5, 4 * 2**-1, 3 * 2**-0.5, 1])
    drawn = minibatch([winners], 200, 0.0, np.random.default_rng(0))
    teams, weights = drawn.teams, drawn.weights
    each = np.array([weights[teams[:, 0] == k][0] for k in range(4)])
    np.testing.assert_allclose(each / each[3], [8, 4, 3, 1])


def test_minibatches_are_drawn_uniformly_with_replacement_from_what_is_there():
    winners = pushed(no_winners(100, 1), np.arange(4)[:, np.newaxis], np.array([9.0, 1, 1, 1]))
    teams = minibatch([winners], 20_000, 0.0, np.random.default_rng(1)).teams
    np.testing.assert_allclose(np.bincount(teams[:, 0]) / 20_000, 0.25, atol=5 * 0.44 / np.sqrt(20_000))


def test_very_old_winners_still_have_weights():
    winners = pushed(no_winners(5000, 1), np.zeros((5000, 1), int), np.ones(5000))
    for seed in range(20):
        weights = minibatch([winners], 2, 1.0, np.random.default_rng(seed)).weights
        np.testing.assert_allclose(weights.mean(), 1.0)


def test_only_winners_are_harvested_when_draws_weigh_nothing():
    teams, weights = harvest(outcomes_of(*THREE_GAMES), 0.0, 13.0, None)
    assert teams.tolist() == [[0, 1], [0, 0]]
    assert weights.tolist() == [1, 1]


def test_both_teams_of_a_draw_are_harvested_with_their_weight():
    teams, weights = harvest(outcomes_of(*THREE_GAMES), 0.25, 13.0, None)
    assert teams.tolist() == [[0, 1], [4, 5], [6, 7], [0, 0]]
    assert weights.tolist() == [1, 0.25, 0.25, 1]


def test_sides_that_share_a_draw_are_harvested_however_they_share_it():
    scores = [[1, 0, 0], [0.5, 0, 0.5], [1 / 3, 1 / 3, 1 / 3]]
    three_sides = outcomes_of(np.arange(9).reshape(3, 3, 1), scores)
    teams, weights = harvest(three_sides, 0.25, 13.0, None)
    assert teams.ravel().tolist() == [0, 3, 5, 6, 7, 8]
    assert weights.tolist() == [1] + [0.25] * 5
    assert harvest(three_sides, 0.0, 13.0, None)[0].tolist() == [[0]]


def test_inverse_probability_weights_by_hand():
    chances = np.log([[0.05, 1], [0.02, 0.5], [1, 0.0001]])  # of 100 ordered teams
    teams, weights = harvest(outcomes_of(*THREE_GAMES, chances), 0.5, 13.0, 10)
    assert teams.tolist() == [[0, 1], [4, 5], [6, 7], [0, 0]]
    np.testing.assert_allclose(weights, [0.2, 0.5 * 0.5, 0.5 * 0.02, 13])
    _, weights = harvest(outcomes_of(*THREE_GAMES, chances), 0.0, math.inf, 10)
    np.testing.assert_allclose(weights, [0.2, 100])


def test_weighting_refuses_teams_of_unknown_chance():
    with pytest.raises(ValueError, match="log_chances"):
        harvest(outcomes_of(*THREE_GAMES), 0.0, 13.0, 10)


def test_a_draw_of_three_is_a_draw_and_only_whoever_was_chosen_is_harvested():
    teams = [[[0, 1], [2, 3], [4, 5]], [[6, 7], [8, 9], [0, 0]]]
    games = outcomes_of(teams, [[1 / 3, 1 / 3, 1 / 3], [0, 1, 0]])
    found, weights = harvest(games, 0.25, 13.0, None)
    assert found.tolist() == [[0, 1], [2, 3], [4, 5], [8, 9]]
    assert weights.tolist() == [0.25, 0.25, 0.25, 1]
    found, _ = harvest(games, 0.25, 13.0, None, chosen=[[True, False, True], [True, False, False]])
    assert found.tolist() == [[0, 1], [4, 5]]


def test_sides_and_what_was_seen_stay_with_their_teams():
    games = outcomes_of(*THREE_GAMES)
    seen = nothing_seen((3, 2), 2, 4, 1)
    seen.rows[:] = np.arange(6).reshape(3, 2, 1, 1, 1)
    seen.lengths[:] = np.arange(6).reshape(3, 2, 1)
    found = memory.harvest(games, seen, np.ones((3, 2), dtype=bool), 0.0, 13.0, None)
    assert found.sides.tolist() == [0, 1]
    assert found.rows[:, 1, 3, 0].tolist() == found.lengths[:, 0].tolist() == [0, 5]
    ring = memory.pushed(no_winners(5, 2, 4, 1), found, 10)
    drawn = minibatch([ring], 50, 0.0, np.random.default_rng(0))
    assert {
        tuple(team): (side, row)
        for team, side, row in zip(drawn.teams.tolist(), drawn.sides, drawn.rows[:, 0, 0, 0], strict=True)
    } == {(0, 1): (0, 0), (0, 0): (1, 5)}


def test_rings_are_learnt_from_alike_however_full_they_are():
    rings = [pushed(no_winners(500, 1), np.full((count, 1), k), np.ones(count)) for k, count in enumerate([300, 3, 0])]
    drawn = minibatch(rings, 64, 0.0, np.random.default_rng(0))
    assert np.bincount(drawn.teams[:, 0]).tolist() == [32, 32]


def test_smaller_teams_are_held_beside_larger_ones():
    teams = np.array([[3, ABSENT, ABSENT], [0, 1, 2], [2, 2, ABSENT]])
    winners = pushed(no_winners(5, 3), teams, np.ones(3))
    assert np.array_equal(winners.held.teams[:3], teams)
    drawn = minibatch([winners], 100, 0.0, np.random.default_rng(0)).teams
    assert np.array_equal(np.unique(drawn, axis=0), np.unique(teams, axis=0))


@pytest.mark.parametrize(
    ("teams", "weights", "said"),
    [
        ([[0, 4]], [1], "member 4, but there are 4"),
        ([[-1, 0]], [1], "member -1"),
        ([[1, -3]], [1], "member -3"),
        ([[ABSENT, ABSENT]], [1], "must have a member"),
        ([[ABSENT, 0]], [1], "behind its members alone"),
        ([[0, 1]], [-0.5], "but one is -0.5"),
        ([[0, 1]], [math.nan], "but one is nan"),
        ([[0, 1]], [math.inf], "but one is inf"),
    ],
)
def test_what_cannot_be_learnt_from_is_refused(teams, weights, said):
    with pytest.raises(ValueError, match=said):
        memory.pushed(no_winners(5, 2), examples(teams, weights), 4)
