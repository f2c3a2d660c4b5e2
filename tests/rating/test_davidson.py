"""Draws as an outcome of their own."""

import numpy as np
import pytest

from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected, ratings
from berteam_cli.rating.davidson import FEWEST_DECIDED, FEWEST_DRAWS, davidson
from berteam_cli.rating.elo import nats


def chances(strengths, nu):
    """(3, K, K) of Davidson's model."""
    p = np.exp(strengths)
    odds = np.stack([np.broadcast_to(p[:, None], (len(p),) * 2), nu * np.sqrt(np.outer(p, p)), np.tile(p, (len(p), 1))])
    return odds / odds.sum(axis=0)


def test_a_hand_worked_case():
    """Won 160, drawn 80, lost 20: p ratio 8, nu = 80 / sqrt(160 * 20) = sqrt 2."""
    many = 1e4
    found = davidson(np.array([[0, 160], [20, 0]]) * many, np.array([[0, 80], [80, 0]]) * many)
    assert found.elos[0] - found.elos[1] == pytest.approx(400 * np.log10(8), abs=0.05)
    assert found.elos.mean() == pytest.approx(1000)
    assert found.nu == pytest.approx(np.sqrt(2), abs=1e-3)


def test_expected_points_and_draws_are_those_made():
    rng = np.random.default_rng(0)
    wins = rng.integers(0, 9, (6, 6)) * (1 - np.eye(6))
    draws = np.triu(rng.integers(0, 9, (6, 6)), 1)
    draws = draws + draws.T
    found = davidson(wins, draws)
    strengths = nats(found.elos)
    # The prior holds the average to 0 nat; the fit is found up to a shift, which it fixes.
    shift = min(np.linspace(-1, 1, 4001), key=lambda x: abs((expected(strengths + x, 0.0) - 0.5).sum()))
    win, draw, _ = chances(strengths, found.nu)
    games = wins + wins.T + draws
    points = (games * (win + draw / 2) * (1 - np.eye(6))).sum(axis=1) + PRIOR_DRAWS * expected(strengths + shift, 0.0)
    assert points == pytest.approx((wins + draws / 2).sum(axis=1) + PRIOR_DRAWS / 2, abs=1e-3)
    told = np.triu(games * draw, 1).sum() + (FEWEST_DRAWS + FEWEST_DECIDED) * found.nu / (2 + found.nu)
    assert told == pytest.approx(np.triu(draws, 1).sum() + FEWEST_DRAWS, abs=1e-3)


def test_truth_is_found_again():
    rng = np.random.default_rng(1)
    truth, nu = rng.normal(0, 0.7, 8), 1.5
    wins, draws = np.zeros((2, 8, 8))
    for i, j in zip(*np.triu_indices(8, 1), strict=True):
        won, drawn, lost = rng.multinomial(4000, chances(truth, nu)[:, i, j])
        wins[i, j], wins[j, i], draws[i, j], draws[j, i] = won, lost, drawn, drawn
    found = davidson(wins, draws)
    assert nats(found.elos) == pytest.approx(truth - truth.mean(), abs=0.05)
    assert found.nu == pytest.approx(nu, rel=0.03)
    # Draws as halves shrink what is between players, as only decided games tell them apart.
    halves = ratings(wins + draws / 2, wins + wins.T + draws)[0]
    assert np.ptp(halves) < 0.8 * np.ptp(found.elos)


def test_nobody_ever_draws_or_always():
    wins = np.array([[0, 6], [2, 0]])
    none = davidson(wins * 1e3, np.zeros((2, 2)))
    assert none.elos[0] - none.elos[1] == pytest.approx(400 * np.log10(3), abs=1)
    assert 0 < none.nu < 0.01
    always = davidson(np.zeros((2, 2)), np.array([[0, 50], [50, 0]]))
    assert always.elos == pytest.approx([1000, 1000])
    assert 50 < always.nu < np.inf
