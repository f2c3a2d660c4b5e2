import numpy as np
import pytest

from berteam_cli.acting import fixed_policies
from berteam_cli.evaluation.reference import reference
from berteam_cli.evaluation.truth import Truth, choose_teams, truth
from berteam_cli.selector.base import TeamDistribution, unordered_teams
from tests.makers import mctf


def distribution(probability, members=4):
    return TeamDistribution(unordered_teams(members, 2), np.asarray(probability, dtype=float))


def rated(probability, elos, listed=True, width=10.0):
    count = len(elos)
    zeros = np.zeros(count, dtype=int)
    return Truth(
        *(zeros[:, np.newaxis], np.asarray(probability, dtype=float), np.broadcast_to(listed, count)),
        *(np.asarray(elos, dtype=float), np.full(count, width), zeros, zeros, zeros, 0),
    )


def test_all_teams_are_rated_if_there_are_games_for_them():
    teams, probability, listed = choose_teams(distribution(np.full(10, 0.1)), 56, 560, np.random.default_rng(0))
    np.testing.assert_array_equal(teams, unordered_teams(4, 2))
    np.testing.assert_array_equal(probability, 0.1)
    assert listed.all()


def test_else_half_are_the_most_probable_and_half_a_sample_of_the_rest():
    chances = np.arange(10) / 45
    seen = set()
    for seed in range(200):
        teams, probability, listed = choose_teams(distribution(chances), 56, 5 * 56 + 55, np.random.default_rng(seed))
        assert len(teams) == 5
        np.testing.assert_array_equal(listed, [True, True, True, False, False])
        np.testing.assert_array_equal(probability[:3], chances[[9, 8, 7]])
        assert (probability[3:] < chances[7]).all()
        assert len({tuple(t) for t in teams}) == 5
        seen |= {tuple(t) for t in teams[3:]}
    assert len(seen) == 7


def test_expected_elo_by_hand():
    expected, width = rated([0.5, 0.25, 0.25], [1200, 1000, 800]).expected_elo()
    assert expected == pytest.approx(1050)
    assert width == pytest.approx(10 * np.sqrt(0.25 + 0.0625 + 0.0625))


def test_a_sample_stands_for_the_rest():
    # Half the mass is listed; of the other half two teams were drawn, one twice as likely.
    truths = rated([0.5, 0.02, 0.01], [1300, 1000, 700], [True, False, False], width=0.0)
    expected, width = truths.expected_elo()
    assert expected == pytest.approx(0.5 * 1300 + 0.5 * (1000 * 2 + 700) / 3)
    spread = 0.5 * np.sqrt((2 / 3 * 100) ** 2 + (1 / 3 * 200) ** 2)
    assert width == pytest.approx(1.959964 * spread)


def test_predicted_elo_by_hand():
    predicted = rated([0.5, 0.05, 0.005, 0.0], [1, 2, 3, 4]).predicted_elos()
    np.testing.assert_allclose(predicted[:3], [1400, 1000, 600])
    assert predicted[3] == -np.inf


def test_the_fixed_teams_get_their_own_elos_back():
    """Teams that are the yardstick themselves are found where the yardstick has them."""
    games = mctf(2)
    known = reference(games, 28)
    assert known.source.startswith("shipped table")
    assert known.elos.mean() == pytest.approx(1000)
    chosen = (known.teams, np.full(28, 1 / 28), np.ones(28, dtype=bool))
    found = truth(games, fixed_policies(range(7)), chosen, known, 2, np.random.default_rng(0))
    assert (np.abs(found.elos - known.elos) < found.half_widths).all()
    assert (found.wins + found.draws + found.losses == 56).all()
    assert np.corrcoef(found.elos, known.elos)[0, 1] > 0.98


def test_other_rules_have_another_yardstick():
    games = mctf(2, max_time_s=60.0)
    known = reference(games, 3)
    assert known.source.startswith("tournament of 3 teams")
    np.testing.assert_array_equal(known.teams[[0, -1]], [[0, 0], [6, 6]])
    assert known.elos.mean() == pytest.approx(1000)
