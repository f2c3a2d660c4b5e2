"""Pairs that play until it is clear who is stronger."""

import numpy as np
import pytest

from berteam_cli.evaluation.sequential import UNSEEN, Sprt

TEST = Sprt(rounds=400, elo0=-20.0, elo1=20.0, alpha=0.05, beta=0.05)


def test_bounds_and_ratio_by_hand():
    assert TEST.bounds == pytest.approx((-np.log(19), np.log(19)))
    # 60 won and 40 lost: mean .6, variance .24; the hypotheses expect .5 -+ .0287.
    gap = 1 / (1 + 10 ** (-20 / 400)) - 0.5
    games = np.array([60.0, 0.0, 40.0]) - UNSEEN + np.array([0, UNSEEN, 0])
    ratio = TEST.log_ratio(games[0], -UNSEEN, games[2])
    assert ratio == pytest.approx(100 * 2 * gap * 2 * 0.1 / (2 * 0.24))
    assert TEST.decided(np.array([2.9, 2.95, -2.95, 0.0])).tolist() == [0, 1, -1, 0]


def test_swapping_the_two_swaps_the_verdict():
    wins, draws, losses = np.arange(30).reshape(3, 10)
    assert TEST.log_ratio(wins, draws, losses) == pytest.approx(-TEST.log_ratio(losses, draws, wins))


@pytest.mark.parametrize("elo", [-20.0, 20.0])
def test_errors_are_as_rare_as_was_asked(elo):
    rng = np.random.default_rng(0)
    pairs, chance = 2000, 1 / (1 + 10 ** (-elo / 400))
    counts, verdict = np.zeros((3, pairs)), np.zeros(pairs, dtype=int)
    for _ in range(TEST.rounds):
        drawn = 0.3
        games = rng.multinomial(8, [chance - drawn / 2, drawn, 1 - chance - drawn / 2], size=pairs).T
        counts += np.where(verdict == 0, games, 0)
        verdict = np.where(verdict == 0, TEST.decided(TEST.log_ratio(*counts)), verdict)
    assert (verdict == 0).mean() < 0.01
    assert (verdict == -np.sign(elo)).mean() < 0.06
    played = counts.sum(axis=0)
    assert np.median(played) < 0.5 * TEST.rounds * 8  # and most stop early
