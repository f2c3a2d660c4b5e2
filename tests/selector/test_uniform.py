import math

import numpy as np
import pytest

from berteam_cli.selector.base import Field, measured, orderings, team_count, unordered_teams
from berteam_cli.selector.uniform import Uniform

AGES = np.zeros(5, dtype=int)


def uniform(captain="matching", members=5, team_size=2, limit=5000, valid=None):
    return Uniform(Field(np.zeros(members, dtype=int), team_size, valid=valid, exact_limit=limit), captain)


@pytest.mark.parametrize("captain", ["matching", "uniform"])
def test_every_ordered_team_comes_equally_often(captain):
    lineups = uniform(captain).select(None, 20_000, AGES, np.random.default_rng(0))
    teams = lineups.teams.reshape(-1, 2)
    counts = np.bincount(teams[:, 0] * 5 + teams[:, 1], minlength=25) / len(teams)
    np.testing.assert_allclose(counts, 1 / 25, atol=0.004)
    np.testing.assert_allclose(lineups.log_chances, -math.log(25))
    assert (lineups.teams == lineups.captains[:, :, np.newaxis]).any(axis=2).all()
    assert (lineups.captains[:, 0] != lineups.captains[:, 1]).all()


def test_matching_lets_everyone_captain_in_turn():
    lineups = uniform().select(None, 10, AGES, np.random.default_rng(0))
    np.testing.assert_array_equal(np.bincount(lineups.captains.ravel()), 4)


def test_distribution_by_hand():
    found = uniform(members=2).distribution(None)
    np.testing.assert_array_equal(found.teams, [[0, 0], [0, 1], [1, 1]])
    np.testing.assert_allclose(found.probability, [0.25, 0.5, 0.25])
    assert found.entropy == pytest.approx(1.5 * math.log(2))


@pytest.mark.parametrize(("members", "size"), [(1, 1), (4, 1), (3, 4), (6, 3)])
def test_teams_and_their_orders(members, size):
    teams = unordered_teams(members, size)
    assert len(teams) == team_count(members, size)
    assert orderings(teams).sum() == members**size
    assert (np.diff(teams, axis=1) >= 0).all()


def test_orderings_by_hand():
    np.testing.assert_array_equal(orderings(np.array([[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 2]])), [1, 3, 3, 6])


def test_too_many_teams_are_sampled():
    exact = measured(uniform(limit=15), None, np.random.default_rng(0))
    assert exact.samples == 0
    assert exact.other == 0
    sampled = measured(uniform(limit=14), None, np.random.default_rng(0))
    assert len(sampled.teams) == 14
    assert sampled.samples > 0
    assert sampled.probability.sum() + sampled.other == pytest.approx(1)
    known = dict(zip(map(tuple, exact.teams), exact.probability, strict=True))
    np.testing.assert_allclose(sampled.probability, [known[tuple(t)] for t in sampled.teams], atol=0.01)


def test_entropy_is_told_only_where_all_teams_are_listed():
    """Most of 37,820 teams are in no sample of 20,000, and their entropy is in none either."""
    rng = np.random.default_rng(0)
    everybody = uniform(members=60, team_size=3)
    assert math.isnan(measured(everybody, None, rng).entropy)
    assert math.isnan(everybody.likeliest(None, 5, rng).entropy)
    few = uniform(members=4)
    assert math.isnan(few.likeliest(None, 5, rng).entropy)
    whole = few.likeliest(None, 10, rng)
    assert whole.entropy == pytest.approx(few.distribution(None).entropy)


def test_rules_are_kept_and_chances_are_those_of_who_is_drawn():
    allowed = np.array([[True, True, False], [False, True, True]])
    selector = uniform(members=3, valid=allowed)
    lineups = selector.select(None, 20_000, np.zeros(3, dtype=int), np.random.default_rng(0))
    teams = lineups.teams.reshape(-1, 2)
    assert allowed[np.arange(2), teams].all()
    # Captain 0 or 2 (a third each) leaves two for the other place, captain 1 stands at either.
    share = {(0, 1): 1 / 6 + 1 / 12, (0, 2): 1 / 6 + 1 / 6, (1, 1): 1 / 12 + 1 / 12, (1, 2): 1 / 6 + 1 / 12}
    for team, chance in share.items():
        these = (teams == team).all(axis=1)
        assert abs(these.mean() - chance) < 5 * 0.5 / np.sqrt(len(teams))
        np.testing.assert_allclose(lineups.log_chances.ravel()[these], math.log(chance))
    found = selector.distribution(None)
    np.testing.assert_array_equal(found.teams, [[0, 1], [0, 2], [1, 1], [1, 2]])
    np.testing.assert_allclose(found.probability, 0.25)


def test_errors_of_a_sampled_distribution_are_those_of_shares():
    sampled = measured(uniform(limit=14), None, np.random.default_rng(0))
    p = sampled.probability
    np.testing.assert_allclose(sampled.error, np.sqrt(p * (1 - p) / sampled.samples))


def test_large_teams_are_searched_without_listing():
    found = uniform(members=50, team_size=6).likeliest(None, 5, np.random.default_rng(0))
    assert len(found.teams) == 5
    # Six different members stand in 720 orders: no team is more likely.
    np.testing.assert_allclose(found.probability, 720 / 50.0**6)
