import numpy as np
import pytest

from berteam_cli.acting import fixed_policies
from berteam_cli.evaluation.manners import Manners, composition, kinds, manners
from berteam_cli.games import as_side_0, both_sides
from berteam_cli.outcomes import Lineups, Outcomes
from berteam_cli.selector.base import TeamDistribution, unordered_teams
from tests.makers import mctf


def outcomes(*games):
    """Returns games of which (captures, grabs, tags, wall hits) of both sides are known."""
    events = np.array(games)
    count = len(events)
    nobody = np.full((count, 2), -1)
    lineups = Lineups(np.zeros((count, 2, 1), dtype=int), nobody, nobody.astype(float))
    return Outcomes(lineups, np.full((count, 2), 0.5), np.ones(count, int), events, np.zeros(count, np.uint64))


def test_aggression_by_hand_with_wall_hits_apart():
    quiet = ([0, 0, 0, 0], [0, 0, 0, 0])
    one = ([1, 2, 1, 5], [0, 0, 3, 7])  # (1 + 1.5 * 2 + 2 * 1 + 3) / (1 + 1)
    two = ([0, 0, 3, 0], [0, 0, 0, 9])  # 1 / 4
    found = manners(outcomes(quiet, one, two, two), np.ones((2, 2), dtype=int))
    np.testing.assert_allclose(found.ratios, [[1, 4.5], [0.25, 0.25]])
    np.testing.assert_allclose(found.aggression, [2.75, 0.25])
    made = {"tags": [0.5, 3], "times_tagged": [1.5, 0], "captures": [0.5, 0], "grabs": [1, 0], "wall_hits": [2.5, 0]}
    assert found.made.keys() == made.keys()
    for name, means in made.items():
        np.testing.assert_allclose(found.made[name], means)


def test_attackers_attack_and_defenders_defend_from_both_sides():
    games = mctf(2)
    ours = np.repeat([[2, 2], [5, 5]], 28, axis=0)
    theirs = np.tile(np.repeat([[0, 3], [1, 4]], 14, axis=0), (2, 1))
    played, _ = games.play(fixed_policies(range(7)), both_sides(ours, theirs, 28), 3)
    attack, defend = manners(as_side_0(played, 28), np.ones((2, 28), dtype=int)).aggression
    assert attack > 1.5
    assert defend < 0.7


def test_the_interval_is_that_of_a_mean():
    ratios = np.random.default_rng(0).gamma(2.0, 1.0, size=(3, 400))
    low, high = Manners(ratios, {}, np.ones(ratios.shape, dtype=int)).interval(np.random.default_rng(1))
    error = ratios.std(axis=1) / 20
    np.testing.assert_allclose(high - low, 2 * 1.96 * error, rtol=0.1)
    np.testing.assert_allclose((low + high) / 2, ratios.mean(axis=1), atol=0.03)


def test_copies_make_no_interval_narrower():
    ratios = np.random.default_rng(0).gamma(2.0, 1.0, size=(3, 100))
    once = Manners(ratios, {}, np.ones(ratios.shape, dtype=int))
    fourfold = Manners(np.tile(ratios, 4), {}, np.concatenate([4 * once.copies, *[0 * once.copies] * 3], axis=1))
    ends = [np.array(manner.interval(np.random.default_rng(1))) for manner in (once, fourfold)]
    np.testing.assert_array_equal(*ends)


def test_teams_are_called_as_their_members():
    members = np.array([0.5, 0.9, 1.5, 1.0])
    teams = np.array([[0, 1], [0, 0], [0, 2], [2, 2], [2, 3], [3, 3]])
    assert kinds(teams, members) == ["defensive", "defensive", "balanced", "aggressive", "balanced", "balanced"]


def test_the_mass_of_each_kind_by_hand():
    members = np.array([0.5, 0.9, 1.5])
    # 0-0, 0-1, 0-2, 1-1, 1-2, 2-2
    whole = TeamDistribution(unordered_teams(3, 2), np.array([0.1, 0.2, 0.05, 0.15, 0.3, 0.2]))
    expected = [("defensive", 3, 0.45), ("balanced", 2, 0.35), ("aggressive", 1, 0.2)]
    for row, hand in zip(composition(whole, members), expected, strict=True):
        assert row[:2] == hand[:2]
        assert row[2] == pytest.approx(hand[2])
    part = TeamDistribution(whole.teams[:3], whole.probability[:3], other=0.65, samples=100)
    assert composition(part, members)[-1] == ("other", 0, 0.65)
