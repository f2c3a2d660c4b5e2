"""What a choice is worth, for selectors of which it is known."""

import numpy as np
import pytest

from berteam_cli.acting import fixed_policies, noisy
from berteam_cli.env.rps import Rps
from berteam_cli.evaluation.calibration import calibration, deciles
from berteam_cli.evaluation.figures import Replayed, figures, picked, replayed
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.strength import Match, Strength
from berteam_cli.evaluation.truth import Chosen, Truth
from berteam_cli.games import Games
from berteam_cli.rating.bradley_terry import Z_95
from berteam_cli.rating.counts import independent
from berteam_cli.selector.base import TeamDistribution, unordered_teams
from berteam_cli.workers import Workers

TEAMS = unordered_teams(8, 2)
TRUE = np.random.default_rng(4).normal(1000, 120, len(TEAMS))
GAMES_ERROR, FRESH_ERROR = 60.0, 20.0


def measured(probability, seed, error=GAMES_ERROR):
    """Returns Elos of all teams as some games might have given them."""
    rng = np.random.default_rng(seed)
    count = len(TEAMS)
    chosen = Chosen(TEAMS, probability, np.ones(count, bool), np.zeros(count, int), 1.0)
    elos = TRUE + rng.normal(0, error, count)
    truth = Truth(chosen, elos, np.full(count, Z_95 * error), independent(*np.zeros((3, count, 1), int)))
    return Strength(truth, elos + rng.normal(0, error, (1000, count)), np.full(count, error**2), None)


def judged(probability, seed, error=GAMES_ERROR):
    """Returns the figures by name, after the two picked teams played other games."""
    found, rng = measured(probability, seed, error), np.random.default_rng(1000 + seed)
    favourite, best = picked(found.truth)
    fresh = TRUE + rng.normal(0, FRESH_ERROR, len(TEAMS))
    noise = rng.normal(0, FRESH_ERROR, (1000, len(TEAMS)))
    again = Replayed(favourite, best, fresh[[favourite, best]], (fresh + noise)[:, [favourite, best]])
    rows = figures(found, TeamDistribution(TEAMS, probability), again, rng)
    return {name: value for name, *value in rows}


UNIFORM = np.full(len(TEAMS), 1 / len(TEAMS))
KNOWING = (np.max(TRUE) == TRUE).astype(float)


def test_expected_elo_is_the_sum_over_all_teams():
    chances = np.random.default_rng(0).dirichlet(np.ones(len(TEAMS)))
    found = judged(chances, 0)
    elos = measured(chances, 0).truth.elos
    value, low, high, team = found["expected_elo"]
    assert value == pytest.approx(sum(p * e for p, e in zip(chances, elos, strict=True)))
    assert (high - low) / 2 == pytest.approx(Z_95 * GAMES_ERROR * np.sqrt((chances**2).sum()))
    assert team == ""
    assert judged(UNIFORM, 0)["effective_teams"][0] == pytest.approx(len(TEAMS))
    assert judged(KNOWING, 0)["effective_teams"][0] == pytest.approx(1)


def test_effective_teams_are_not_told_of_a_sampled_distribution():
    found, rng = measured(UNIFORM, 0), np.random.default_rng(0)
    again = Replayed(0, 1, np.array([1000.0, 1100]), np.zeros((1000, 2)))
    seen = TeamDistribution(TEAMS[:10], UNIFORM[:10], 1 - UNIFORM[:10].sum(), 1000, np.zeros(10))
    rows = {name: value for name, value, *_ in figures(found, seen, again, rng)}
    assert np.isnan(rows["effective_teams"])
    assert rows["expected_elo"] == judged(UNIFORM, 0)["expected_elo"][0]


def test_regret_of_a_selector_that_knows_and_of_one_that_does_not():
    """Over many evaluations: none, and the gap between the best and the mean, whatever luck the best Elo had."""
    found = [(judged(KNOWING, seed, 5.0), judged(UNIFORM, seed, 5.0)) for seed in range(60)]
    gap = TRUE.max() - TRUE.mean()
    assert np.mean([knowing["regret"][0] for knowing, _ in found]) == pytest.approx(0, abs=8)
    assert all(knowing["top_1_regret"][:3] == [0, 0, 0] for knowing, _ in found)
    assert np.mean([uniform["regret"][0] for _, uniform in found]) == pytest.approx(gap, abs=8)
    covered = [low <= gap <= high for _, low, high, _ in (uniform["regret"] for _, uniform in found)]
    assert np.mean(covered) >= 0.85


def test_the_winners_curse_is_taken_from_the_replayed():
    found = [judged(UNIFORM, seed) for seed in range(100)]
    lucky = np.mean([x["best_elo"][0] - TRUE[team_of(x["best_elo"])] for x in found])
    fresh = np.mean([x["best_elo_replayed"][0] - TRUE[team_of(x["best_elo"])] for x in found])
    assert lucky > 25
    assert abs(fresh) < 8


def team_of(row):
    return ["-".join(map(str, team)) for team in TEAMS].index(row[3])


def test_calibration_of_selectors_of_which_it_is_known():
    rng = np.random.default_rng(0)
    knowing = 10 ** (TRUE / 400)
    of_truth = calibration(measured(knowing / knowing.sum(), 0, 1e-6).truth, rng)
    assert of_truth["rank_error"] == (0, 0, 0)
    assert of_truth["calibration_slope"] == pytest.approx((1, 1, 1))
    sharp = knowing**2 / (knowing**2).sum()  # chosen by twice the Elo
    assert calibration(measured(sharp, 0, 1e-6).truth, rng)["calibration_slope"][0] == pytest.approx(0.5)
    wrong = calibration(measured(1 / knowing / (1 / knowing).sum(), 0, 1e-6).truth, rng)
    assert wrong["rank_error"][0] == pytest.approx(0.5)  # 35 + 33 + ... + 1, twice, over 36 * 36
    assert wrong["calibration_slope"][0] == pytest.approx(-1)
    blind = calibration(measured(UNIFORM, 0).truth, rng)
    assert blind["rank_error"][0] == pytest.approx(0.25)  # all ranks alike
    assert np.isnan(blind["calibration_slope"]).all()


def test_deciles_by_hand():
    chances = np.arange(len(TEAMS), 0, -1.0)
    chances[-4:] = 0  # never chosen
    chances /= chances.sum()
    found = measured(chances, 0)
    rows = list(deciles(found))
    assert [row[:2] for row in rows] == [(k + 1, 4 if k < 6 else 3) for k in range(10)]
    predicted, elos = found.truth.predicted_elos(), found.truth.elos
    for row, first in zip(rows, (0, 4, 8, 12, 16, 20, 24, 27, 30, 33), strict=True):
        part = slice(first, first + row[1])
        assert row[3] == pytest.approx(elos[part].mean())
        assert row[4] < row[3] < row[5]
        if first < 30:
            assert row[2] == pytest.approx(predicted[part].mean())
    assert rows[8][2] == pytest.approx(predicted[30:32].mean())
    assert np.isnan(rows[9][2])


def hands(workers=1):
    """Returns all pairs of hands, which slip now and then, against two of them, rock and paper."""
    known = Reference(np.array([[0, 0], [1, 1]]), np.array([950.0, 1050.0]), "by hand")
    return Match(Games(Rps(2), Workers(workers)), noisy(fixed_policies(range(3)), 0.1), known)


def pairs(probability):
    teams = unordered_teams(3, 2)
    return Chosen(teams, np.asarray(probability, float), np.ones(6, bool), np.zeros(6, int), 1.0)


def test_the_picked_teams_play_other_games(tmp_path):
    chosen = pairs([0.3, 0.1, 0.2, 0.2, 0.1, 0.1])
    found = hands().strength(chosen, 9, np.random.default_rng(0), "Rating", tmp_path / "played")
    again = replayed(hands(), found.truth, 400, np.random.default_rng(1), tmp_path / "replayed")
    assert again.favourite == 0
    assert again.best == found.truth.elos.argmax()
    assert again.samples.shape == (1000, 2)
    assert again.samples[:, 0].std() < found.samples[:, 0].std() / 4  # 44 times the games
    low, high = np.quantile(again.samples[:, 0], [0.001, 0.999])
    assert low < again.elos[0] < high


def test_strength_does_not_depend_on_workers(tmp_path):
    chosen = pairs(np.full(6, 1 / 6))
    one, other = (
        hands(workers).strength(chosen, 7, np.random.default_rng(0), "Rating", tmp_path / str(workers))
        for workers in (1, 3)
    )
    np.testing.assert_array_equal(one.samples, other.samples)
    np.testing.assert_array_equal(one.truth.elos, other.truth.elos)
    assert one.manners is None
