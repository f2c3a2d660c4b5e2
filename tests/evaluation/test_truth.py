import numpy as np
import pytest

from berteam_cli.acting import fixed_policies
from berteam_cli.env.rps import Rps
from berteam_cli.evaluation.reference import Reference, reference
from berteam_cli.evaluation.truth import Chosen, Truth, choose_teams, fixture, replay_variance, truth
from berteam_cli.games import Games
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, expected, held_ratings
from berteam_cli.rating.counts import independent
from berteam_cli.rating.elo import nats
from berteam_cli.selector.base import TeamDistribution, unordered_teams
from berteam_cli.workers import Workers
from tests.makers import mctf


def distribution(probability, members=4):
    return TeamDistribution(unordered_teams(members, 2), np.asarray(probability, dtype=float))


def drawn_by(found, seed=0):
    rng = np.random.default_rng(seed)
    return lambda count: rng.permuted(found.teams[rng.choice(len(found.teams), count, p=found.probability)], axis=1)


def rated(probability, elos, listed=True, draws=0, width=10.0):
    count = len(elos)
    zeros = np.zeros(count, dtype=int)
    probability, listed = np.asarray(probability, dtype=float), np.broadcast_to(listed, count)
    draws = np.broadcast_to(draws, count)
    chosen = Chosen(zeros[:, np.newaxis], probability, listed, draws, float(probability[listed].sum()))
    return Truth(
        chosen, np.asarray(elos, dtype=float), np.full(count, width), independent(*np.zeros((3, count, 1), dtype=int))
    )


def test_all_teams_are_rated_if_there_are_games_for_them():
    found = distribution(np.full(10, 0.1))
    chosen = choose_teams(found, drawn_by(found), 56, 560)
    np.testing.assert_array_equal(chosen.teams, unordered_teams(4, 2))
    np.testing.assert_array_equal(chosen.probability, 0.1)
    assert chosen.listed.all()
    assert chosen.listed_mass == 1


def test_else_half_are_the_most_probable_and_the_others_are_drawn_from_the_rest():
    chances = np.arange(10) / 45
    found = distribution(chances)
    counts = np.zeros(10)
    for seed in range(500):
        chosen = choose_teams(found, drawn_by(found, seed), 56, 5 * 56 + 55)
        listed = chosen.listed
        np.testing.assert_array_equal(chosen.probability[listed], chances[[9, 8, 7]])
        assert chosen.listed_mass == pytest.approx(24 / 45)
        assert chosen.draws.sum() == 2
        assert not chosen.draws[listed].any()
        assert len({tuple(t) for t in chosen.teams}) == len(chosen)
        for team, draws in zip(chosen.teams, chosen.draws, strict=True):
            counts[(found.teams == team).all(axis=1)] += draws
    np.testing.assert_allclose(counts / 1000, [*chances[:7] / chances[:7].sum(), 0, 0, 0], atol=0.05)


def test_a_sampled_distribution_is_drawn_anew():
    """The most frequent of a sample came too often in it; their chances are taken from other draws."""
    flat = distribution(np.full(10, 0.1))
    lucky = TeamDistribution(flat.teams[:4], np.array([0.3, 0.2, 0.1, 0.1]), other=0.3, samples=20_000)
    chosen = choose_teams(lucky, drawn_by(flat), 56, 560)
    assert chosen.listed.sum() == 4
    np.testing.assert_allclose(chosen.probability[chosen.listed], 0.1, atol=0.01)
    assert np.isnan(chosen.probability[~chosen.listed]).all()
    assert chosen.draws.sum() == 6  # ten are afforded, four of them for the most frequent that are known


def test_expected_elo_by_hand():
    expected, width = rated([0.5, 0.25, 0.25], [1200, 1000, 800]).expected_elo()
    assert expected == pytest.approx(1050)
    assert width == pytest.approx(10 * np.sqrt(0.25 + 0.0625 + 0.0625))


def test_a_sample_stands_for_the_rest():
    # Half the mass is listed; from the other half three draws hit two teams, one of them twice.
    truths = rated([0.5, 0.02, 0.01], [1300, 1000, 700], [True, False, False], [0, 2, 1], width=0.0)
    expected, width = truths.expected_elo()
    assert expected == pytest.approx(0.5 * 1300 + 0.5 * 900)
    scatter = (2 * 100**2 + 200**2) / 2
    assert width == pytest.approx(4.302653 * 0.5 * np.sqrt(scatter / 3))  # Student's t with 2 degrees


def test_too_few_draws_tell_no_interval():
    one = rated([0.5, 0.02], [1300, 1000], [True, False], [0, 1])
    assert one.expected_elo()[0] == pytest.approx(1150)
    assert np.isnan(one.expected_elo()[1])
    assert np.isnan(rated([0.5], [1300]).expected_elo()).all()


@pytest.mark.parametrize("draws", [0, 1])
def test_a_rest_that_is_never_drawn_costs_no_more_than_it_could_change(draws):
    # 1,200 and 1,000 are of the listed teams; a millionth of the mass is of others, here of one of 800.
    found = rated([0.6, 0.4 - 1e-6, 1e-6], [1200, 1000, 800], [True, True, False], [0, 0, draws])
    expected, width = found.expected_elo()
    assert expected == pytest.approx((0.6 * 1200 + (0.4 - 1e-6) * 1000) / (1 - 1e-6), abs=1e-9)
    scatter = 10 * np.sqrt(0.6**2 + (0.4 - 1e-6) ** 2) / (1 - 1e-6)
    assert width == pytest.approx(scatter + 1e-6 * 400, abs=1e-9)
    assert abs(expected - (0.6 * 1200 + (0.4 - 1e-6) * 1000 + 1e-6 * 800)) < width
    much = rated([0.6, 0.4 - 2e-3, 2e-3], [1200, 1000, 800], [True, True, False], [0, 0, draws])
    assert np.isnan(much.expected_elo()[1])


def test_the_elo_of_all_but_a_millionth_of_the_mass_is_told():
    chances = np.full(210, 1e-6 / 208)
    chances[[17, 99]] = 0.6, 0.4 - 1e-6
    found = distribution(chances, members=20)
    chosen = choose_teams(found, drawn_by(found), 56, 56 * 40)
    assert chosen.listed.sum() == 20
    assert chosen.draws.sum() < 2
    assert chosen.listed_mass < 1 - 1e-7
    elos = np.where(chosen.probability > 0.5, 1300.0, np.where(chosen.probability > 0.1, 900.0, 1000.0))
    known = Truth(chosen, elos, np.full(len(chosen), 30.0), independent(*np.zeros((3, len(chosen), 1), dtype=int)))
    assert known.expected_elo() == pytest.approx((1140, 30 * np.sqrt(0.6**2 + 0.4**2)), abs=1e-3)


def test_the_interval_of_the_expected_elo_covers_it():
    """Of 300 evaluations of a few of 78 teams, about 95 % have the truth within their interval."""
    rng = np.random.default_rng(5)
    found = distribution(rng.dirichlet(np.ones(78) * 0.5), members=12)
    elos = rng.normal(1000, 150, size=78)
    by_team = {tuple(t): e for t, e in zip(found.teams, elos, strict=True)}
    covered = 0
    for seed in range(300):
        chosen = choose_teams(found, drawn_by(found, seed), 1, 16)
        known = np.array([by_team[tuple(t)] for t in chosen.teams])
        none = independent(*np.zeros((3, len(chosen), 1), dtype=int))
        mean, width = Truth(chosen, known, np.zeros(len(chosen)), none).expected_elo()
        covered += abs(mean - found.probability @ elos) <= width
    assert 0.90 <= covered / 300 <= 1


def test_the_interval_holds_where_shares_are_of_few_draws():
    """Of 400 samples of 200 teams, about 95 % have the truth in their interval, of which the shares are the most."""
    rng = np.random.default_rng(6)
    flat = distribution(np.full(10, 0.1))
    elos = np.linspace(600, 1400, 10)
    by_team = {tuple(t): e for t, e in zip(flat.teams, elos, strict=True)}
    covered = 0
    for seed in range(400):
        draw = drawn_by(flat, seed)
        teams, counts = np.unique(np.sort(draw(200), axis=1), axis=0, return_counts=True)
        chosen = choose_teams(TeamDistribution(teams, counts / 200, samples=200), draw, 1, 14)
        errors = rng.normal(0, 10, size=10)
        known = np.array([by_team[tuple(t)] for t in chosen.teams]) + errors[: len(chosen)]
        none = independent(*np.zeros((3, len(chosen), 1), dtype=int))
        mean, width = Truth(chosen, known, np.full(len(chosen), 19.6), none).expected_elo()
        covered += abs(mean - 1000) <= width
    assert 0.92 <= covered / 400 <= 0.98


def test_the_interval_holds_where_the_same_teams_are_drawn_again():
    """Six teams of a rest of 20, drawn 40 times: the error of each is one, however often it came."""
    rng = np.random.default_rng(7)
    true = rng.normal(1000, 20, size=6)
    covered = 0
    for _ in range(1000):
        draws = rng.multinomial(40, np.full(6, 1 / 6))
        found = rated(np.full(6, 0.001), true + rng.normal(0, 60, size=6), False, draws, width=1.96 * 60)
        mean, width = found.expected_elo()
        covered += abs(mean - true.mean()) <= width
    assert 0.92 <= covered / 1000 <= 0.98


def test_predicted_elo_by_hand():
    predicted = rated([0.5, 0.05, 0.005, 0.0], [1, 2, 3, 4]).predicted_elos()
    np.testing.assert_allclose(predicted[:3], [1400, 1000, 600])
    assert np.isnan(predicted[3])


def test_the_fixed_teams_get_their_own_elos_back():
    """Teams that are the yardstick themselves are found where the yardstick has them."""
    games = mctf(2)
    known = reference(games, 28)
    assert known.source.startswith("shipped table")
    assert known.elos.mean() == pytest.approx(1000)
    chosen = Chosen(known.teams, np.full(28, 1 / 28), np.ones(28, dtype=bool), np.zeros(28, dtype=int), 1.0)
    found = truth(games, fixed_policies(range(7)), chosen, known, 2, np.random.default_rng(0))
    assert (np.abs(found.elos - known.elos) < found.half_widths).all()
    assert (found.counts.results.sum(axis=0) == 2).all()
    assert np.corrcoef(found.elos, known.elos)[0, 1] > 0.98
    # Of held anchors, each team makes the points that are expected of it, but for the prior's.
    strengths, held = nats(found.elos)[:, np.newaxis], nats(known.elos)
    made = (found.counts.results[0] + 0.5 * found.counts.results[1]).sum(axis=1)
    missing = made - (2 * expected(strengths, held)).sum(axis=1)
    np.testing.assert_allclose(missing, PRIOR_DRAWS * (expected(strengths[:, 0], 0.0) - 0.5), atol=1e-6)


def test_the_variance_of_repeated_games_is_known_from_one_evaluation():
    """Whatever a team's chances against each opponent are, even such as no two Elos give."""
    rng = np.random.default_rng(0)
    anchors, repetitions = np.linspace(800, 1200, 12), 4000
    chances = rng.dirichlet([0.3, 0.3, 0.3], size=12)
    chances[:4] = [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]  # nothing is left to chance there
    results = rng.multinomial(10, chances, size=(repetitions, 12)).transpose(2, 0, 1)
    elos, widths = held_ratings(results[0] + 0.5 * results[1], np.full((repetitions, 12), 10), anchors)
    nobody = Chosen(np.zeros((repetitions, 1)), np.zeros(repetitions), np.zeros(0), np.zeros(0), 1.0)
    known = Reference(np.zeros((12, 1)), anchors, "by hand")
    estimated = replay_variance(Truth(nobody, elos, widths, independent(*results)), known)
    assert estimated.mean() == pytest.approx(elos.var(), rel=0.08)
    once = Truth(nobody, elos[:1], widths[:1], independent(*np.ones((3, 1, 12), dtype=int) * [[[1]], [[0]], [[0]]]))
    assert np.isnan(replay_variance(once, known)).all()


def test_games_played_again_make_nothing_surer():
    """Two teams without chance have eight different games; forty make an Elo no surer, and repeating them no other."""
    games, sure = mctf(2), range(6)
    known = reference(games, 28)
    teams = unordered_teams(7, 2)[[8, 9]]
    assert np.isin(teams, sure).all()
    chosen = Chosen(teams, np.full(2, 0.5), np.ones(2, dtype=bool), np.zeros(2, dtype=int), 1.0)
    few, many = (truth(games, fixed_policies(range(7)), chosen, known, g, np.random.default_rng(0)) for g in (8, 40))
    np.testing.assert_array_equal(many.record.sum(axis=0), 28 * 40)
    certain = np.isin(known.teams, sure).all(axis=1)
    assert 0 < certain.sum() < 28
    twins = certain & (known.teams[:, 0] == known.teams[:, 1])  # who have four, as their orders are the same
    for found, each in ((few, 8), (many, 40)):
        np.testing.assert_array_equal(found.counts.settled, [certain, certain])
        different = np.where(twins, 4, np.where(certain, 8, each))
        np.testing.assert_array_equal(found.counts.different.sum(axis=(0, 3)), [different, different])
        assert found.counts.repetition == pytest.approx(np.full(2, (each**2 / different).sum() / (28 * each)))
    # Seven of the 28 opponents know chance; more games with them do make the Elos surer.
    assert (many.half_widths > few.half_widths * 0.8).all()
    # Only opponents that know chance let an Elo differ from one evaluation to the next.
    alone = Reference(known.teams[certain], known.elos[certain], "without chance")
    repeated = truth(games, fixed_policies(range(7)), chosen, alone, 16, np.random.default_rng(1))
    np.testing.assert_array_equal(replay_variance(repeated, alone), 0)
    assert (replay_variance(many, known) > 0).all()


def test_teams_stand_on_both_sides_and_in_all_orders_equally_often():
    games = mctf(2)
    known = reference(games, 28)
    teams = unordered_teams(7, 2)[[1, 8]]
    found = fixture(games, fixed_policies(range(7)), teams, known, 8, np.random.default_rng(0))
    assert found.shape == (2, 28, 8)
    side = found.held.argmax(axis=1)
    ours = found.lineups.teams[np.arange(len(side)), side].reshape(2, 28, 8, 2)
    theirs = found.lineups.teams[np.arange(len(side)), 1 - side].reshape(2, 28, 8, 2) - 7
    np.testing.assert_array_equal(np.sort(ours, axis=3), np.broadcast_to(teams[:, None, None], ours.shape))
    np.testing.assert_array_equal(np.sort(theirs, axis=3), np.broadcast_to(known.teams[None, :, None], theirs.shape))
    ways = {(*a, *b, s) for a, b, s in zip(ours[0, 1], theirs[0, 1], side.reshape(2, 28, 8)[0, 1], strict=True)}
    assert len(ways) == 8  # 0-1 against 0-1: two orders of each, from both sides


def test_other_rules_have_another_yardstick():
    games = mctf(2, max_time_s=60.0)
    known = reference(games, 3)
    assert known.source.startswith("tournament of 3 teams")
    np.testing.assert_array_equal(known.teams[[0, -1]], [[0, 0], [6, 6]])
    assert known.elos.mean() == pytest.approx(1000)


@pytest.mark.parametrize("sides", [3, 4])
def test_the_fixed_teams_get_their_own_elos_back_among_more_sides(sides):
    games = Games(Rps(2, sides), Workers(1))
    known = reference(games, 28)
    chosen = Chosen(known.teams, np.full(6, 1 / 6), np.ones(6, dtype=bool), np.zeros(6, dtype=int), 1.0)
    found = truth(games, fixed_policies(range(3)), chosen, known, 2 * sides, np.random.default_rng(0))
    assert np.ptp(known.elos) > 80
    np.testing.assert_allclose(found.elos, known.elos, atol=3)  # but for the prior's pull to the mean
    np.testing.assert_array_equal(found.record.sum(axis=0), 12 * sides)
    np.testing.assert_array_equal(found.record[1] > found.record[2], found.elos > 1000)  # against itself a team draws


@pytest.mark.parametrize("sides", [3, 5])
def test_alone_a_share_of_the_points_is_what_an_equal_scores(sides):
    """One game, rock alone against rocks: it draws, and scores the 1 / S that it is expected to."""
    games = Games(Rps(1, sides), Workers(1))
    one = Chosen(np.zeros((1, 1), dtype=int), np.ones(1), np.ones(1, dtype=bool), np.zeros(1, dtype=int), 1.0)
    rocks = Reference(np.zeros((1, 1), dtype=int), np.full(1, 1000.0), "by hand")
    found = truth(games, fixed_policies(range(3)), one, rocks, 1, np.random.default_rng(0))
    assert found.elos[0] == pytest.approx(1000, abs=1e-6)
    assert found.record[:, 0].tolist() == [0, 1, 0]
