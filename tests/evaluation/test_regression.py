import numpy as np
import pytest
from scipy.stats import linregress, spearmanr

from berteam_cli.evaluation.regression import regression

SLOPE, NOISE = 2e-4, 90.0


def teams(count, seed=0, scatter=0.02, noise=0.0):
    """Returns Elos as measured and probabilities on a line through the true ones, which scatter by 120 Elo."""
    rng = np.random.default_rng(seed)
    true = rng.normal(950, 120, count)
    probability = 0.1 + SLOPE * true + rng.normal(0, scatter, count)
    return true, true + rng.normal(0, 1, count) * noise, probability


def regressed(elos, probability, variance=0.0, seed=0):
    return regression(elos, probability, np.full(len(elos), float(variance)), np.random.default_rng(seed))


@pytest.mark.parametrize("count", [3, 28, 400])
def test_it_is_scipys(count):
    _, elos, probability = teams(count, noise=NOISE)
    probability[-1] = probability[0]  # a tie
    found = regressed(elos, probability)
    theirs = linregress(elos, probability)
    assert found["slope"][0] == pytest.approx(theirs.slope, rel=1e-9)
    assert found["intercept"][0] == pytest.approx(theirs.intercept, rel=1e-9)
    assert found["r_squared"][0] == pytest.approx(theirs.rvalue**2, rel=1e-9)
    assert found["rank_correlation"][0] == pytest.approx(spearmanr(elos, probability).statistic, rel=1e-9)


def test_a_line_falls_where_the_selector_likes_the_weak():
    _, elos, probability = teams(60, scatter=0.0)
    found = regressed(elos, 1 - probability)
    assert found["slope"][0] == pytest.approx(-SLOPE)
    assert found["rank_correlation"][0] == pytest.approx(-1)
    assert found["r_squared"] == pytest.approx((1, 1, 1))


def test_what_noise_took_is_given_back():
    true, elos, probability = teams(4000, noise=NOISE)
    found = regressed(elos, probability, NOISE**2)
    without = linregress(true, probability)
    assert found["reliability"][0] == pytest.approx(120**2 / (120**2 + NOISE**2), abs=0.01)
    assert found["slope"][0] < 0.75 * SLOPE
    assert found["slope_corrected"][0] == pytest.approx(SLOPE, rel=0.05)
    assert found["r_squared"][0] < 0.75 * without.rvalue**2
    assert found["r_squared_corrected"][0] == pytest.approx(without.rvalue**2, abs=0.03)
    assert found["intercept_corrected"][0] == pytest.approx(0.1, abs=0.01)


def test_intervals_cover_the_truth():
    """Of 120 evaluations of 60 teams, about 95 % have the true slope within the corrected one's interval."""
    covered = 0
    for seed in range(120):
        _, elos, probability = teams(60, seed, noise=NOISE)
        _, low, high = regressed(elos, probability, NOISE**2, seed)["slope_corrected"]
        covered += low <= SLOPE <= high
    assert 0.90 <= covered / 120 <= 0.99


def test_without_errors_nothing_is_corrected():
    _, elos, probability = teams(50)
    found = regressed(elos, probability)
    for name in ("slope", "intercept", "r_squared"):
        assert found[f"{name}_corrected"] == found[name]


def test_what_cannot_be_known_is_not():
    _, elos, probability = teams(50)
    flat = regressed(elos, np.full(50, 1 / 50) + np.linspace(0, 1e-17, 50))
    assert flat["slope"][0] == pytest.approx(0, abs=1e-15)
    assert np.isnan(flat["r_squared"]).all()
    assert np.isnan(flat["rank_correlation"]).all()
    noise = regressed(elos, probability, 1e6)
    assert noise["reliability"][0] < 0
    assert np.isnan(noise["slope_corrected"]).all()
    alike = regressed(np.full(50, 1000.0), probability, 100.0)
    assert np.isnan([value for name in alike for value in alike[name]]).all()
