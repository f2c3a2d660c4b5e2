"""Games between runs, counted and rated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from berteam_cli import build
from berteam_cli.acting import fixed_policies
from berteam_cli.config import checked
from berteam_cli.evaluation.comparison import Plan, Played, compared, counted, even_share, planned
from berteam_cli.evaluation.contenders import Contender
from berteam_cli.evaluation.reference import Reference
from berteam_cli.games import placed
from berteam_cli.outcomes import Outcomes
from berteam_cli.rating.bradley_terry import held_ratings
from berteam_cli.selector.base import Plain
from berteam_cli.training import begin
from tests.test_config import composed

ANCHORS = Reference(np.array([[0], [1]]), np.array([900.0, 1100.0]), "by hand")


def games():
    """Two runs: each samples two teams for two fixed ones, on both sides; then five games between them."""
    rng = np.random.default_rng(0)
    first = np.concatenate([np.tile([True, False], 8), [True, True, False, False, True]])
    lineups = placed(np.zeros((21, 1), int), np.ones((21, 1), int), np.stack([first, ~first], axis=1))
    plan = Plan(fixed_policies([0, 1]), lineups, first, [2, 2], np.zeros(5, int), np.ones(5, int))
    ours = rng.choice([0.0, 0.5, 1.0], 21)
    scores = np.where(first[:, None], np.stack([ours, 1 - ours], axis=1), np.stack([1 - ours, ours], axis=1))
    return plan, Outcomes(lineups, scores, np.ones(21, int), np.zeros((21, 2, 4), int), np.zeros(21, np.uint64)), ours


def test_games_are_counted_for_whom_they_are():
    plan, outcomes, ours = games()
    found = counted(plan, outcomes, 2)
    for r, run in enumerate(ours[:16].reshape(2, 2, 2, 2)):
        for column, score in enumerate((1.0, 0.5, 0.0)):
            np.testing.assert_array_equal(found.fixed[r][:, :, column], (run == score).sum(axis=2))
    between = [(ours[16:] == score).sum() for score in (1.0, 0.5, 0.0)]
    np.testing.assert_array_equal(found.versus[0, 1], between)
    np.testing.assert_array_equal(found.versus[1, 0], between[::-1])
    assert not found.versus[[0, 1], [0, 1]].any()


def test_swapping_the_colours_of_all_games_changes_nothing():
    plan, outcomes, _ = games()
    swapped = counted(replace(plan, first=~plan.first), replace(outcomes, scores=outcomes.scores[:, ::-1]), 2)
    found = counted(plan, outcomes, 2)
    np.testing.assert_array_equal(swapped.versus, found.versus)
    np.testing.assert_array_equal(swapped.fixed, found.fixed)


def test_both_sides_get_the_same_number_of_games_and_nobody_too_few():
    assert [even_share(games, parts) for games, parts in ((10, 1), (10, 3), (1, 4), (7, 2))] == [10, 4, 2, 4]


class Sided(Plain):
    """Shows paper as blue, 1, and scissors as red, 2."""

    by_side = True

    def sample(self, state, count, rng, side):
        return np.full((count, 1), 1 + side)


def test_who_tells_sides_apart_fields_a_team_on_its_side_only():
    parts = build.parts(checked(composed("env=rps", "team_size=1", "population=hands", "selector=uniform")))
    run = begin(parts)
    any_hand = Contender(Path("any"), 0, parts, run, {}, "")
    sided = replace(any_hand, parts=replace(parts, selector=Sided()))
    hands = Reference(np.arange(3)[:, np.newaxis], np.full(3, 1000.0), "by hand")
    plan = planned([sided, any_hand], np.array([0, 1]), hands, 3, 40, 9, np.random.default_rng(0))
    assert plan.teams == [6, 5]  # five teams are asked for, and as many for either side
    ours = plan.lineups.teams[:, :, 0]
    mine, others = slice(0, 6 * 3 * 2), slice(6 * 3 * 2, (6 + 5) * 3 * 2)
    assert plan.first[mine].sum() == 18
    np.testing.assert_array_equal(np.where(plan.first, ours[:, 0], ours[:, 1])[mine], np.where(plan.first, 1, 2)[mine])
    np.testing.assert_array_equal(plan.first[others], np.tile([True, False], 15))
    between = plan.first[others.stop :]  # where the run that is looked at is the same
    np.testing.assert_array_equal(np.where(between, *ours[others.stop :].T), np.where(between, 1, 2))
    outcomes, _ = parts.games.play(plan.acting, plan.lineups, 0)
    found = counted(plan, outcomes, 3).fixed[0]
    paper, scissors = [[2, 0, 0], [0, 2, 0], [0, 0, 2]], [[0, 0, 2], [2, 0, 0], [0, 2, 0]]
    np.testing.assert_array_equal(found, [paper] * 3 + [scissors] * 3)


def played(strong, weak, teams=40):
    """An algorithm of two strong runs and one of a weak run: games won, drawn and lost against each anchor."""
    fixed = [np.tile(x, (teams, 2, 1)) for x in (strong, strong, weak)]
    versus = np.zeros((3, 3, 3), int)
    versus[0, 2], versus[1, 2] = (150, 20, 30), (150, 20, 30)
    versus[2, 0] = versus[2, 1] = (30, 20, 150)
    return Played(versus, fixed)


def test_a_stronger_algorithm_is_said_to_be_stronger():
    of = np.array([0, 0, 1])
    found = compared(played((3, 0, 1), (1, 1, 2)), of, ANCHORS, np.random.default_rng(1))
    assert found.algorithms.mixed[0] > found.algorithms.mixed[1] + 100
    assert found.algorithms.scores[0, 1] == pytest.approx(320 / 400)
    assert found.algorithms.scores[0, 1] + found.algorithms.scores[1, 0] == pytest.approx(1)
    assert np.isnan(found.algorithms.scores[0, 0])
    assert found.improvement[0, 1] == 1
    assert np.isnan(found.iqm[1])
    assert found.iqm[0] == pytest.approx(found.runs.mixed[:2].mean())
    assert np.isnan(found.iqm_samples[:, 1]).all()
    low, high = np.quantile(found.algorithms.mixed_samples, [0.025, 0.975], axis=0)
    assert (low < found.algorithms.mixed).all()
    assert (found.algorithms.mixed < high).all()


def test_one_sampled_team_tells_nothing_of_others():
    one, many = np.array([[[3, 0, 1]] * 2]), np.array([[[0, 2, 2]] * 2, [[3, 0, 1]] * 2])
    found = compared(
        Played(np.full((4, 4, 3), 5), [one, many, one, many]), np.array([0, 1, 2, 2]), ANCHORS, np.random.default_rng(3)
    )
    for figures, lone in ((found.runs, [0, 2]), (found.algorithms, [0])):
        for samples in (figures.mixed_samples, figures.expected_samples):
            assert np.flatnonzero(np.isnan(samples).any(axis=0)).tolist() == lone
    assert not np.isnan(found.runs.mixed).any()
    assert not np.isnan(found.improvement_samples[:, 0, 2]).any()


def test_the_expected_elo_is_the_mean_of_the_sampled_teams():
    strong, weak = np.array([[3, 0, 1]] * 2), np.array([[0, 2, 2]] * 2)
    mixed = Played(np.zeros((2, 2, 3), int), [np.stack([strong] * 3 + [weak]), np.stack([weak] * 4)])
    found = compared(mixed, np.array([0, 1]), ANCHORS, np.random.default_rng(2))
    elos = held_ratings(np.array([[3.0, 3.0], [1.0, 1.0]]), np.full((2, 2), 4.0), ANCHORS.elos)[0]
    assert found.runs.expected == pytest.approx([(3 * elos[0] + elos[1]) / 4, elos[1]])
    assert found.runs.expected_samples[:, 1] == pytest.approx(np.full(1000, elos[1]))  # all its teams are alike
    assert found.runs.expected_samples[:, 0].std() > 10
