import numpy as np
import pytest

from berteam_cli.selector.base import Field, TeamDistribution
from berteam_cli.selector.independent import anybody, distribution, log_chances, sampled, top, with_all_teams

RULES = np.array([[True, True, False, False], [True, True, True, True]])
FIELD = Field(np.zeros(4, dtype=np.int64), 2, valid=RULES)


def test_teams_are_as_likely_as_the_orders_in_which_they_may_stand_are_many():
    found = distribution(anybody(FIELD), FIELD)
    assert found.teams.tolist() == [[0, 0], [0, 1], [0, 2], [0, 3], [1, 1], [1, 2], [1, 3]]
    np.testing.assert_allclose(8 * found.probability, [1, 2, 1, 1, 1, 1, 1])


def test_every_team_that_may_be_has_a_row():
    listed = TeamDistribution(np.array([[0, 2], [1, 1]]), np.array([0.25, 0.75]))
    found = with_all_teams(listed, FIELD)
    assert found.probability.tolist() == [0, 0, 0.25, 0, 0.75, 0, 0]


def test_samples_and_chances_agree():
    chances = np.array([[0.2, 0.8, 0, 0], [0.1, 0.2, 0.3, 0.4]])
    teams = sampled(chances, 20_000, np.random.default_rng(0))
    for team in ([0, 0], [1, 3], [1, 1]):
        share = (teams == team).all(axis=1).mean()
        exact = np.exp(log_chances(chances, np.array(team)))
        assert exact == pytest.approx(chances[0, team[0]] * chances[1, team[1]])
        assert abs(share - exact) < 5 * np.sqrt(exact / 20_000)


@pytest.mark.parametrize("listed", [True, False])
def test_the_most_probable_teams_are_found_by_listing_and_by_search(listed):
    chances = np.array([[0.2, 0.8, 0, 0], [0.1, 0.2, 0.3, 0.4]])
    found = top(chances, FIELD, 2, np.random.default_rng(0), listed=listed)
    assert found.teams.tolist() == [[1, 2], [1, 3]]
    np.testing.assert_allclose(found.probability, [0.24, 0.32])
