"""Intervals of Elos: how often they hold the truth, and what they do not depend on."""

import numpy as np
import pytest

from berteam_cli.rating import bootstrap
from berteam_cli.rating.bootstrap import held_samples, interval, rank_intervals, samples, superiority
from berteam_cli.rating.bradley_terry import held_ratings, ratings

DRAWN = 0.8  # of what may be drawn: a draw takes as much from either's chance to win


def results(games, chance, rng):
    """Games won, drawn and lost where ``chance`` is the expected score."""
    drawn = DRAWN * np.minimum(chance, 1 - chance)
    luck = rng.random((games, *chance.shape))
    wins = (luck < chance - drawn).sum(axis=0)
    losses = (luck >= chance + drawn).sum(axis=0)
    return wins, games - wins - losses, losses


def chances(elos, others):
    return 1 / (1 + 10 ** ((others - elos[:, np.newaxis]) / 400))


def cup(elos, games, rng):
    """(wins, draws), (K, K), of every pair."""
    upper = np.triu(np.ones((len(elos), len(elos)), dtype=bool), 1)
    wins, draws, losses = (np.where(upper, x, 0) for x in results(games, chances(elos, elos), rng))
    return wins + losses.T, draws + draws.T


def test_intervals_of_tournaments_hold_the_truth_19_times_in_20():
    rng, held, of = np.random.default_rng(0), 0, 0
    for _ in range(300):
        elos = rng.normal(0.0, 150.0, 8)
        elos += 1000 - elos.mean()
        low, high = interval(samples(*cup(elos, 6, rng), rng, 400))
        held, of = held + ((low <= elos) & (elos <= high)).sum(), of + 8
    assert 0.92 <= held / of <= 0.98


def test_intervals_against_held_anchors_hold_the_truth_19_times_in_20():
    rng = np.random.default_rng(0)
    anchors, elos = np.linspace(800, 1300, 28), rng.normal(1000.0, 120.0, 300)
    counts = results(4, chances(elos, anchors), rng)
    low, high = interval(held_samples(*counts, anchors, rng))
    assert 0.92 <= ((low <= elos) & (elos <= high)).mean() <= 0.98


def test_few_games_a_pair_scatter_as_many_tournaments_do():
    rng = np.random.default_rng(1)
    elos = np.linspace(850.0, 1150.0, 12)
    again = np.array([ratings(w + 0.5 * d, w + w.T + d)[0] for w, d in (cup(elos, 2, rng) for _ in range(400))])
    told = np.mean([samples(*cup(elos, 2, rng), rng, 200).std(axis=0) for _ in range(40)])
    assert told == pytest.approx(again.std(axis=0).mean(), rel=0.1)


def test_samples_scatter_around_the_ratings():
    rng = np.random.default_rng(2)
    wins, draws = cup(np.array([850.0, 1000, 1150]), 200, rng)
    drawn = samples(wins, draws, rng)
    best = ratings(wins + 0.5 * draws, wins + wins.T + draws)[0]
    np.testing.assert_allclose(drawn.mean(axis=0), best, atol=2)
    np.testing.assert_allclose(drawn.mean(axis=1), 1000)
    anchors = np.array([900.0, 1100.0])
    counts = results(100, chances(np.array([950.0, 1020.0]), anchors), rng)
    alone = held_samples(*counts, anchors, rng)
    best = held_ratings(counts[0] + 0.5 * counts[1], np.full((2, 2), 100.0), anchors)[0]
    np.testing.assert_allclose(alone.mean(axis=0), best, atol=3)


def test_large_tournaments_are_drawn_from_what_refitting_tends_to(monkeypatch):
    rng = np.random.default_rng(3)
    wins, draws = cup(rng.normal(1000, 100, 20), 30, rng)
    refitted = samples(wins, draws, rng)
    monkeypatch.setattr(bootstrap, "MOST_REFITTED", 19)
    drawn = samples(wins, draws, rng)
    np.testing.assert_allclose(drawn.std(axis=0), refitted.std(axis=0), rtol=0.12)
    np.testing.assert_allclose(drawn.mean(axis=0), refitted.mean(axis=0), atol=3)


def test_a_perfect_record_has_an_interval():
    wins = np.array([[0, 27], [0, 0]])
    low, high = interval(samples(wins, np.zeros((2, 2)), np.random.default_rng(0)))
    assert low[0] > 1150  # 27 of 27: it is far better than even,
    assert high[0] - low[0] > 200  # and how far, nobody knows


def test_renaming_players_renames_their_intervals():
    rng = np.random.default_rng(4)
    wins, draws = cup(np.array([900.0, 1000, 1050, 1200]), 40, rng)
    order = np.array([2, 0, 3, 1])
    ends = interval(samples(wins, draws, np.random.default_rng(0), 4000))
    renamed = interval(samples(wins[order][:, order], draws[order][:, order], np.random.default_rng(0), 4000))
    for end, other in zip(ends, renamed, strict=True):
        np.testing.assert_allclose(other, end[order], atol=8)


def test_superiority_and_ranks_by_hand():
    drawn = np.array([[3.0, 2, 1], [2.0, 3, 1], [3.0, 3, 1], [3.0, 2, 1]])
    np.testing.assert_allclose(superiority(drawn), [[0.5, 0.625, 1], [0.375, 0.5, 1], [0, 0, 0.5]])
    low, high = rank_intervals(drawn)
    np.testing.assert_array_equal(low, [1, 1, 3])
    np.testing.assert_array_equal(high, [2, 2, 3])


def test_the_same_generator_gives_the_same_samples():
    wins, draws = cup(np.array([900.0, 1100.0, 1000.0]), 10, np.random.default_rng(5))
    one, other = (samples(wins, draws, np.random.default_rng(6), 50) for _ in range(2))
    np.testing.assert_array_equal(one, other)
