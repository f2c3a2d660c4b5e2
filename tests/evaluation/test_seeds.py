"""What several seeds say of an algorithm."""

import numpy as np
import pytest
from scipy.stats import mannwhitneyu

from berteam_cli.evaluation.seeds import drawn_seeds, improvement, iqm


def test_the_interquartile_mean_leaves_a_quarter_out_at_either_end():
    assert iqm(np.array([1.0, 2, 3, 100])) == 2.5
    assert iqm(np.array([[0.0, 1, 2, 3, 4, 5, 6, 700], np.arange(8.0)])) == pytest.approx([3.5, 3.5])
    assert iqm(np.array([1.0, 4.0, 10.0])) == 5  # too few to leave any out


def test_improvement_is_that_of_mann_and_whitney():
    rng = np.random.default_rng(0)
    ours, theirs = rng.integers(0, 6, 9).astype(float), rng.integers(0, 5, 7).astype(float)
    assert improvement(ours, theirs) == pytest.approx(mannwhitneyu(ours, theirs).statistic / 63)
    assert improvement(ours, theirs) + improvement(theirs, ours) == pytest.approx(1)
    assert improvement(np.array([2.0, 1.0]), np.array([1.0])) == 0.75


def test_seeds_are_drawn_within_their_algorithm():
    of = np.array([0, 1, 0, 0, 2])
    chosen = drawn_seeds(of, 4000, np.random.default_rng(1))
    assert (of[chosen] == of).all()
    assert (chosen[:, [1, 4]] == [1, 4]).all()
    assert np.bincount(chosen[:, 0], minlength=5)[[0, 2, 3]] / 4000 == pytest.approx(np.full(3, 1 / 3), abs=0.03)
