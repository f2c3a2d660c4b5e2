import numpy as np
import pytest

from berteam_cli.evaluation.alpha_rank import alpha_rank, at_rest, fixation

RPS = np.array([[0.5, 0, 1], [1, 0.5, 0], [0, 1, 0.5]])


def test_rock_paper_scissors_shares_the_time():
    assert alpha_rank(RPS) == pytest.approx([1 / 3] * 3)


def test_two_teams_by_hand():
    """With u = alpha times the gain the chances are as rho(u) to rho(-u), which is e^((m - 1) u)."""
    alpha, m, gain = 0.3, 6, 0.5
    share = alpha_rank(np.array([[0.5, 0.75], [0.25, 0.5]]), alpha, m)
    assert share[0] / share[1] == pytest.approx(np.exp((m - 1) * alpha * gain))


def test_without_selection_all_are_alike():
    assert alpha_rank(np.random.default_rng(0).random((4, 4)), alpha=0.0) == pytest.approx([0.25] * 4)


def test_who_beats_everyone_has_it_all_and_order_does_not_matter():
    scores = np.array([[0.5, 1, 1, 1], *np.hstack([np.zeros((3, 1)), RPS])])
    assert alpha_rank(scores) == pytest.approx([1, 0, 0, 0], abs=1e-9)
    rng = np.random.default_rng(1)
    scores = rng.random((6, 6))
    order = rng.permutation(6)
    assert alpha_rank(scores[np.ix_(order, order)], 0.5) == pytest.approx(alpha_rank(scores, 0.5)[order])


def test_at_rest_is_a_fixed_point():
    chain = np.random.default_rng(2).dirichlet(np.ones(5), 5)
    assert at_rest(chain) @ chain == pytest.approx(at_rest(chain))


def test_chance_to_take_over_is_continuous():
    assert fixation(np.array([1e-8, 0.0, -1e-8]), 10) == pytest.approx([0.1] * 3, rel=1e-6)
