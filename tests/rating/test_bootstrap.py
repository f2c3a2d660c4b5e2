import numpy as np
import pytest

from berteam_cli.rating.bootstrap import fitted, held_samples, interval, rank_intervals, samples, superiority, times
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected, held_ratings, ratings
from berteam_cli.rating.counts import Counts, independent
from berteam_cli.rating.elo import nats, points


def drawn(rng, chances, draw_share, games):
    """Wins, draws and losses of games whose expected scores are ``chances``."""
    drawn_chance = draw_share * 2 * np.minimum(chances, 1 - chances)
    counts = rng.multinomial(
        games, np.stack([chances - drawn_chance / 2, drawn_chance, 1 - chances - drawn_chance / 2], axis=-1)
    )
    return counts[..., 0], counts[..., 1], counts[..., 2]


def tournament(rng, strengths, games, draw_share=0.3):
    wins, draws, losses = (
        np.triu(c, 1) for c in drawn(rng, expected(strengths[:, np.newaxis], strengths), draw_share, games)
    )
    return wins + losses.T, draws + draws.T, losses + wins.T


def test_intervals_of_a_tournament_cover_the_truth():
    """300 tournaments of 8 players, 4 games a pair."""
    rng = np.random.default_rng(1)
    inside = []
    for _ in range(300):
        truth = rng.normal(0, 0.8, 8)
        wins, draws, losses = tournament(rng, truth, 4)
        low, high = interval(samples(wins, draws, losses, rng, 400))
        elos = points(truth - truth.mean())
        inside.append((low <= elos) & (elos <= high))
    assert 0.92 <= np.mean(inside) <= 0.98


def test_intervals_against_anchors_cover_the_truth():
    """300 players against 28 anchors, 2 games each."""
    rng = np.random.default_rng(2)
    anchors = rng.normal(1000, 150, 28)
    truth = rng.normal(0, 0.8, 300)
    counts = drawn(rng, expected(truth[:, np.newaxis], nats(anchors)), 0.3, 2)
    low, high = interval(held_samples(independent(*counts), anchors, rng, 400))
    assert 0.92 <= np.mean((low <= points(truth)) & (points(truth) <= high)) <= 0.98


def test_a_fit_is_that_of_the_point_estimate():
    rng = np.random.default_rng(3)
    wins, draws, losses = tournament(rng, rng.normal(0, 1, 12), 6)
    wins[0, 1:], draws[0], losses[0] = 6, 0, 0  # a perfect record
    losses[1:, 0], draws[:, 0], wins[:, 0] = 6, 0, 0
    scores, games = wins + draws / 2, (wins + draws + losses).astype(float)
    elos, _ = ratings(scores, games)
    strengths = fitted(
        np.triu(games), scores.sum(axis=1) + PRIOR_DRAWS / 2, np.full(12, PRIOR_DRAWS), 0.0, np.zeros(12)
    )
    assert points(strengths - strengths.mean()) == pytest.approx(elos, abs=1e-3)


def test_many_games_of_a_kind_are_drawn_like_few():
    rng = np.random.default_rng(8)
    for games in (0.0, 3.0, 12.0, 40.0):
        drawn_times = np.array([times(games, rng) for _ in range(20_000)])
        assert drawn_times.mean() == pytest.approx(games, abs=5 * np.sqrt(games / 20_000))
        assert drawn_times.var() == pytest.approx(games, rel=0.06)


def test_samples_lie_around_the_point_estimate():
    rng = np.random.default_rng(4)
    anchors = np.linspace(800, 1200, 6)
    wins = rng.integers(0, 30, (5, 6))
    draws, losses = rng.integers(0, 30, (2, 5, 6))
    elos, _ = held_ratings(wins + draws / 2, (wins + draws + losses).astype(float), anchors)
    found = held_samples(independent(wins, draws, losses), anchors, rng, 2000)
    assert np.abs(found.mean(axis=0) - elos).max() < 4 * found.std(axis=0).max() / np.sqrt(2000) + 1


def test_hand_worked_variance():
    """Of games between equals ln(won / lost) scatters by 1/won + 1/lost, over however many anchors."""
    wins, losses = np.full((1, 100), 1), np.full((1, 100), 1)
    found = nats(
        held_samples(independent(wins, 0 * wins, losses), np.full(100, 1000.0), np.random.default_rng(5), 4000)
    )
    assert found.std() == pytest.approx(np.sqrt(1 / 100 + 1 / 100), rel=0.05)


def test_copies_make_nothing_surer():
    """As many different games as before, each played three times: the Elos scatter as if it were once."""
    rng, anchors = np.random.default_rng(6), np.full(50, 1000.0)
    won, lost = np.full((1, 50), 2), np.full((1, 50), 1)
    once = independent(won, 0 * won, lost)
    thrice = Counts(once.different, np.array([3]), once.settled)
    told = [held_samples(games, anchors, rng, 4000).std() for games in (once, thrice)]
    assert told[1] == pytest.approx(told[0], rel=0.05)
    assert held_samples(independent(3 * won, 0 * won, 3 * lost), anchors, rng, 4000).std() < 0.65 * told[0]


def test_a_perfect_record_has_an_interval():
    wins, none = np.array([[0, 27], [0, 0]]), np.zeros((2, 2), dtype=int)
    low, high = interval(samples(wins, none, wins.T, np.random.default_rng(0)))
    assert low[0] > 1150  # 27 of 27: it is far better than even,
    assert high[0] - low[0] > 200  # and how far, nobody knows


def test_few_games_a_pair_scatter_as_many_tournaments_do():
    rng = np.random.default_rng(1)
    truth = np.linspace(-0.9, 0.9, 12)
    cups = [tournament(rng, truth, 2) for _ in range(200)]
    again = np.array([ratings(w + d / 2, (w + d + l).astype(float))[0] for w, d, l in cups])  # noqa: E741
    told = np.mean([samples(*cup, rng, 200).std(axis=0) for cup in cups[:40]])
    # Somewhat wider, as few games are; drawing them anew within each pair would tell .7 of it.
    assert 0.95 <= told / again.std(axis=0).mean() <= 1.2


def test_the_same_generator_gives_the_same_samples():
    counts = np.arange(12).reshape(3, 4)
    games = independent(counts, counts, counts[::-1])
    one, two = (held_samples(games, np.zeros(4), np.random.default_rng(6), 50) for _ in range(2))
    assert np.array_equal(one, two)


def test_superiority_and_ranks():
    elos = np.array([[3.0, 2.0, 1.0], [3.0, 1.0, 2.0], [3.0, 2.0, 2.0], [3.0, 2.0, 1.0]])
    likely = superiority(elos)
    assert likely[0] == pytest.approx([0.5, 1, 1])
    assert likely[1, 2] == pytest.approx((1 + 0 + 0.5 + 1) / 4)
    assert likely + likely.T == pytest.approx(np.ones((3, 3)))
    low, high = rank_intervals(elos)
    assert low.tolist() == [1, 2, 2]
    assert high.tolist() == [1, 3, 3]
