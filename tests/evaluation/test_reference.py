"""Which teams of fixed policies are the yardstick."""

import numpy as np
import pytest

from berteam_cli.evaluation.reference import reference_teams, team_at
from berteam_cli.selector.base import team_count, unordered_teams


@pytest.mark.parametrize(("policies", "team_size"), [(1, 4), (3, 1), (3, 5), (7, 2), (7, 4)])
def test_each_team_is_found_without_the_others(policies, team_size):
    everyone = unordered_teams(policies, team_size)
    assert [team_at(k, policies, team_size) for k in range(len(everyone))] == everyone.tolist()


def test_they_are_evenly_spaced_and_large_teams_are_not_listed():
    teams = reference_teams(7, 4, 28)
    everyone = unordered_teams(7, 4)
    np.testing.assert_array_equal(teams, everyone[np.linspace(0, len(everyone) - 1, 28).round().astype(int)])
    large = reference_teams(7, 49, 28)
    assert team_count(7, 49) > 20_000_000
    assert large.shape == (28, 49)
    assert large[0].tolist() == [0] * 49
    assert large[-1].tolist() == [6] * 49
    assert (np.diff(large, axis=1) >= 0).all()
