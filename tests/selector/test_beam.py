import numpy as np
import pytest

from berteam_cli.selector.base import unordered_teams
from berteam_cli.selector.beam import likeliest
from berteam_cli.selector.chances import total_distribution
from berteam_cli.selector.filling import proposal
from tests.selector.odds import at_places
from tests.selector.test_chances import field, rules, table


@pytest.mark.parametrize("exchangeable", [True, False])
@pytest.mark.parametrize(("members", "size"), [(5, 1), (6, 2), (5, 3), (4, 4)])
def test_where_the_beam_is_wide_it_finds_what_listing_finds(members, size, exchangeable):
    odds = table(members, 3, exchangeable)
    total = total_distribution(odds, field(members, size), 0, exchangeable=exchangeable)
    top = np.sort(np.argsort(-total)[:5])
    found = likeliest(odds, field(members, size), 5, np.random.default_rng(0), exchangeable=exchangeable)
    np.testing.assert_array_equal(found.teams, unordered_teams(members, size)[top])
    np.testing.assert_allclose(found.probability, total[top], rtol=1e-9)
    assert found.other == pytest.approx(1 - total[top].sum())
    assert found.samples == 0
    assert found.error is None


def test_rules_are_kept():
    members, size = 6, 3
    allowed = rules(members, size, 4)
    odds = proposal(table(members, 1), np.zeros(members), allowed)
    total = total_distribution(odds, field(members, size, valid=allowed), 0, exchangeable=False)
    found = likeliest(odds, field(members, size, valid=allowed), 4, np.random.default_rng(0), exchangeable=False)
    np.testing.assert_allclose(np.sort(found.probability), np.sort(total)[-4:], rtol=1e-9)


def test_several_sources_give_the_mean_of_their_chances():
    odds, members, size = table(4, 3), 4, 2
    total = sum(total_distribution(odds, field(members, size), k, exchangeable=False) for k in range(3)) / 3
    found = likeliest(odds, field(members, size), 3, np.random.default_rng(0), exchangeable=False, sources=3)
    np.testing.assert_allclose(np.sort(found.probability), np.sort(total)[-3:], rtol=1e-9)


def test_a_needle_among_billions_of_teams_is_found():
    """Each place leads on: nearly all of the mass is on one team of 40^8, whose chance is known."""
    members, size, right = 40, 8, 0.97

    @at_places
    def odds(teams, known):
        chances = np.full((*teams.shape, members), (1 - right) / (members - 1))
        chances[..., np.arange(size), 5 * np.arange(size) % members] = right
        return chances

    found = likeliest(odds, field(members, size), 3, np.random.default_rng(0), exchangeable=False)
    best = found.probability.argmax()
    assert sorted(found.teams[best]) == sorted(5 * np.arange(size) % members)
    assert found.error is not None
    assert found.probability[best] == pytest.approx(right**size, rel=0.1)
