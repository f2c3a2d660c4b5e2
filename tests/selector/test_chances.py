from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import OPEN
from berteam_cli.selector.base import orderings, unordered_teams
from berteam_cli.selector.captains import SCHEMES, opening
from berteam_cli.selector.chances import code, log_chances, partial_teams, total_distribution
from berteam_cli.selector.filling import filled, towards_uniform

sizes = st.sampled_from([(1, 1), (1, 3), (4, 1), (2, 2), (5, 2), (3, 3), (2, 4)])
seeds = st.integers(0, 2**16)


def table(members, seed, exchangeable=False):
    """Returns conditionals that are arbitrary, but always the same for the same partial team."""

    def odds(teams):
        chances = np.empty((*teams.shape, members))
        for k, team in enumerate(teams + 1):
            if exchangeable:
                chances[k] = np.random.default_rng([seed, *np.sort(team)]).dirichlet(np.ones(members))
            else:
                chances[k] = np.random.default_rng([seed, *team]).dirichlet(np.ones(members), size=len(team))
        return chances

    return odds


def in_order(odds, team, order, doubt):
    """Returns the chances with which each place of ``team`` is filled, in ``order``."""
    partial, chances = np.full(len(team), OPEN), []
    for place in order:
        chances.append(towards_uniform(odds(partial[np.newaxis])[0, place], doubt)[team[place]])
        partial[place] = team[place]
    return chances


def all_teams(members, size):
    return np.array(list(product(range(members), repeat=size)))


@pytest.mark.parametrize(("members", "size"), [(4, 3), (3, 2), (2, 4)])
def test_total_distribution_is_the_average_over_all_fill_orders(members, size):
    odds = table(members, 1)
    expected = dict.fromkeys(map(tuple, unordered_teams(members, size)), 0.0)
    for team in all_teams(members, size):
        orders = list(permutations(range(size)))
        chance = np.mean([np.prod(in_order(odds, team, order, np.zeros(members))) for order in orders])
        expected[tuple(np.sort(team))] += chance
    total = total_distribution(odds, members, size, exchangeable=False)
    np.testing.assert_allclose(total, list(expected.values()), rtol=1e-12)


@settings(deadline=None, max_examples=30)
@given(sizes, seeds, st.booleans())
def test_property_total_distribution_sums_to_one(size, seed, exchangeable):
    members, team_size = size
    asked = []

    def odds(teams):
        asked.append(teams)
        return table(members, seed, exchangeable)(teams)

    total = total_distribution(odds, members, team_size, exchangeable=exchangeable)
    assert len(total) == len(unordered_teams(members, team_size))
    np.testing.assert_allclose(total.sum(), 1.0, rtol=1e-12)
    rows = np.concatenate(asked)
    assert len(np.unique(rows, axis=0)) == len(rows)  # no partial team is asked about twice
    if exchangeable:
        assert len(rows) == sum(len(unordered_teams(members, count)) for count in range(team_size))


def test_total_distribution_equals_frequencies_of_filling():
    odds, count = table(4, 3), 40_000
    total = total_distribution(odds, 4, 3, exchangeable=False)
    teams = np.sort(filled(odds, np.full((count, 3), OPEN), np.zeros(4), np.random.default_rng(0)), axis=1)
    listed = unordered_teams(4, 3)
    share = np.bincount(np.searchsorted(code(listed, 4), code(teams, 4)), minlength=len(listed)) / count
    assert np.all(np.abs(share - total) < 5 * np.sqrt(total * (1 - total) / count))


@settings(deadline=None, max_examples=30)
@given(sizes, seeds)
def test_property_merging_over_places_changes_nothing_where_places_are_alike(size, seed):
    odds = table(size[0], seed, exchangeable=True)
    np.testing.assert_allclose(
        total_distribution(odds, *size, exchangeable=True), total_distribution(odds, *size, exchangeable=False)
    )


def test_total_distribution_without_captain_scheme_is_log_chances_opened_by_the_network():
    odds, members, size = table(3, 5), 3, 3
    first = opening("berteam", odds(np.full((1, size), OPEN))[0], np.zeros(members))
    teams = unordered_teams(members, size)
    total = np.zeros(len(teams))
    for order in permutations(range(size)):
        total += np.exp(log_chances(odds, teams[:, order], first, np.zeros(members)))
    total *= orderings(teams) / 6
    np.testing.assert_allclose(total, total_distribution(odds, members, size, exchangeable=False))


@settings(deadline=None, max_examples=40)
@given(sizes, seeds, st.sampled_from(SCHEMES))
def test_property_log_chances_of_all_ordered_teams_sum_to_one(size, seed, scheme):
    members, team_size = size
    odds, doubt = table(members, seed), np.random.default_rng(seed).random(members)
    first = opening(scheme, odds(np.full((1, team_size), OPEN))[0], doubt)
    chances = np.exp(log_chances(odds, all_teams(members, team_size), first, doubt))
    np.testing.assert_allclose(chances.sum(), 1.0, rtol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_log_chances_are_sums_over_captains_and_fill_orders(scheme):
    members, size = 3, 3
    odds, doubt = table(members, 7), np.array([0.9, 0.0, 0.4])
    empty = odds(np.full((1, size), OPEN))[0]
    teams = all_teams(members, size)
    expected = np.zeros(len(teams))
    for k, team in enumerate(teams):
        for order in permutations(range(size)):
            seat, captain = order[0], team[order[0]]
            if scheme == "berteam":
                start = towards_uniform(empty[seat], doubt)[captain] / size
            else:
                start = empty[seat, captain] / empty[:, captain].sum() / members
            rest = np.prod(in_order(odds, team, order, doubt)[1:])
            expected[k] += start * rest / 2  # two orders for the other two places
    found = log_chances(odds, teams, opening(scheme, empty, doubt), doubt)
    np.testing.assert_allclose(np.exp(found), expected, rtol=1e-12)


@pytest.mark.parametrize("count", range(4))
def test_partial_teams_are_complete_and_in_order(count):
    teams = partial_teams(3, 3, count, merged=False)
    expected = [team for team in product(range(OPEN, 3), repeat=3) if team.count(OPEN) == 3 - count]
    assert list(map(tuple, teams)) == expected
    merged = partial_teams(3, 3, count, merged=True)
    assert list(map(tuple, merged)) == sorted({tuple(sorted(team)) for team in expected})
