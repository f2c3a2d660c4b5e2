from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import OPEN
from berteam_cli.selector.base import Field, orderings, unordered_teams
from berteam_cli.selector.captains import SCHEMES, opening
from berteam_cli.selector.chances import (
    code,
    estimated_log_chances,
    in_some_orders,
    log_chances,
    partial_teams,
    total_distribution,
    unordered_chances,
)
from berteam_cli.selector.filling import filled, proposal, within
from tests.selector.odds import at_places

sizes = st.sampled_from([(1, 1), (1, 3), (4, 1), (2, 2), (5, 2), (3, 3), (2, 4)])
seeds = st.integers(0, 2**16)


def table(members, seed, exchangeable=False):
    """Returns conditionals that are arbitrary, but always the same for the same partial team."""

    @at_places
    def odds(teams, known):
        chances = np.empty((*teams.shape, members))
        for k, (team, source) in enumerate(zip(teams + 1, known, strict=True)):
            if exchangeable:
                chances[k] = np.random.default_rng([seed, source, *np.sort(team)]).dirichlet(np.ones(members))
            else:
                chances[k] = np.random.default_rng([seed, source, *team]).dirichlet(np.ones(members), size=len(team))
        return chances

    return odds


def field(members, size, **settings):
    return Field(np.zeros(members, dtype=np.int64), size, **settings)


def everybody(members, size):
    return np.ones((size, members), dtype=np.bool_)


def start(scheme, odds, doubt, allowed, sources=1):
    """Returns the opening for each of ``sources``."""
    empty = odds(np.full((sources, len(allowed)), OPEN), np.arange(sources))
    return opening(scheme, empty, doubt, allowed)


def in_order(odds, team, order, source=0):
    """Returns the chances with which each place of ``team`` is filled, in ``order``."""
    partial, chances = np.full(len(team), OPEN), []
    for place in order:
        chances.append(odds(partial[np.newaxis], np.array([source]))[0, place, team[place]])
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
        chance = np.mean([np.prod(in_order(odds, team, order)) for order in orders])
        expected[tuple(np.sort(team))] += chance
    total = total_distribution(odds, field(members, size), 0, exchangeable=False)
    np.testing.assert_allclose(total, list(expected.values()), rtol=1e-12)


@settings(deadline=None, max_examples=30)
@given(sizes, seeds, st.booleans())
def test_property_total_distribution_sums_to_one(size, seed, exchangeable):
    members, team_size = size
    asked = []

    @at_places
    def odds(teams, known):
        asked.append(teams)
        return table(members, seed, exchangeable)(teams, known)

    total = total_distribution(odds, field(members, team_size), 0, exchangeable=exchangeable)
    assert len(total) == len(unordered_teams(members, team_size))
    np.testing.assert_allclose(total.sum(), 1.0, rtol=1e-12)
    rows = np.concatenate(asked)
    assert len(np.unique(rows, axis=0)) == len(rows)  # no partial team is asked about twice
    if exchangeable:
        assert len(rows) == sum(len(unordered_teams(members, count)) for count in range(team_size))


def test_total_distribution_equals_frequencies_of_filling():
    odds, count = table(4, 3), 40_000
    total = total_distribution(odds, field(4, 3), 0, exchangeable=False)
    teams = np.sort(
        filled(odds, np.full((count, 3), OPEN), np.zeros(count, dtype=int), np.random.default_rng(0)), axis=1
    )
    listed = unordered_teams(4, 3)
    share = np.bincount(np.searchsorted(code(listed, 4), code(teams, 4)), minlength=len(listed)) / count
    assert np.all(np.abs(share - total) < 5 * np.sqrt(total * (1 - total) / count))


@settings(deadline=None, max_examples=30)
@given(sizes, seeds)
def test_property_merging_over_places_changes_nothing_where_places_are_alike(size, seed):
    odds = table(size[0], seed, exchangeable=True)
    np.testing.assert_allclose(
        total_distribution(odds, field(*size), 0, exchangeable=True),
        total_distribution(odds, field(*size), 0, exchangeable=False),
    )


def test_total_distribution_without_captain_scheme_is_log_chances_opened_by_the_network():
    odds, members, size = table(3, 5), 3, 3
    first = start("berteam", odds, np.zeros(members), everybody(members, size))
    teams = unordered_teams(members, size)
    total = np.zeros(len(teams))
    for order in permutations(range(size)):
        total += np.exp(log_chances(odds, teams[:, order], np.zeros(len(teams), dtype=int), first))
    total *= orderings(teams) / 6
    np.testing.assert_allclose(total, total_distribution(odds, field(members, size), 0, exchangeable=False))


def rules(members, size, seed):
    """Returns (T, N) rules that forbid about a third, but leave somebody for each place."""
    rng = np.random.default_rng(seed)
    allowed = rng.random((size, members)) > 1 / 3
    allowed[np.arange(size), rng.integers(members, size=size)] = True
    return allowed


@settings(deadline=None, max_examples=40)
@given(sizes, seeds, st.sampled_from(SCHEMES), st.booleans())
def test_property_log_chances_of_all_ordered_teams_sum_to_one(size, seed, scheme, free):
    members, team_size = size
    allowed = everybody(*size) if free else rules(*size, seed)
    doubt = np.random.default_rng(seed).random(members)
    odds = proposal(table(members, seed), doubt, allowed)
    first = start(scheme, table(members, seed), doubt, allowed)
    teams = all_teams(members, team_size)
    with np.errstate(divide="ignore"):
        chances = np.exp(log_chances(odds, teams, np.zeros(len(teams), dtype=int), first))
    np.testing.assert_allclose(chances.sum(), 1.0, rtol=1e-12)
    assert not chances[~allowed[np.arange(team_size), teams].all(axis=1)].any()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_log_chances_are_sums_over_captains_and_fill_orders(scheme):
    members, size = 3, 3
    network, doubt = table(members, 7), np.array([0.9, 0.0, 0.4])
    allowed = np.array([[True, True, False], [True, True, True], [False, True, True]])
    odds = proposal(network, doubt, allowed)
    teams = all_teams(members, size)
    known = np.arange(len(teams)) % 2
    expected = np.zeros(len(teams))
    for k, team in enumerate(teams):
        empty = within(network(np.full((1, size), OPEN), known[k : k + 1])[0], allowed)
        for order in permutations(range(size)):
            seat, captain = order[0], team[order[0]]
            if scheme == "berteam":
                begin = odds(np.full((1, size), OPEN), known[k : k + 1])[0][seat, captain] / size
            else:
                begin = empty[seat, captain] / empty[:, captain].sum() / members
            rest = np.prod(in_order(odds, team, order, known[k])[1:])
            expected[k] += begin * rest / 2  # two orders for the other two places
    with np.errstate(divide="ignore"):
        found = log_chances(odds, teams, known, start(scheme, network, doubt, allowed, 2))
    np.testing.assert_allclose(np.exp(found), expected, rtol=1e-12)


def test_estimated_chances_are_right_in_the_mean():
    members, size = 3, 4
    odds, known = table(members, 2), np.zeros(5, dtype=int)
    first = start("matching", odds, np.zeros(members), everybody(members, size))
    teams = all_teams(members, size)[[0, 7, 40, 53, 80]]
    exact = np.exp(log_chances(odds, teams, known, first))
    along = np.exp(in_some_orders(odds, teams, known, first, 4000, np.random.default_rng(0)))
    error = along.std(axis=0) / np.sqrt(len(along))
    assert (error > 0).all()
    assert (np.abs(along.mean(axis=0) - exact) < 5 * error).all()
    estimates = [estimated_log_chances(odds, teams, known, first, np.random.default_rng(k)) for k in range(250)]
    np.testing.assert_allclose(np.exp(estimates).mean(axis=0), exact, atol=5 * error.max())


@pytest.mark.parametrize("exchangeable", [True, False])
@pytest.mark.parametrize(("members", "size"), [(4, 3), (2, 5), (3, 6)])
def test_chances_of_unordered_teams_are_those_of_the_whole_distribution(members, size, exchangeable):
    odds = table(members, 3, exchangeable)
    total = total_distribution(odds, field(members, size), 0, exchangeable=exchangeable)
    teams = unordered_teams(members, size)
    rng = np.random.default_rng(1)
    found, error = unordered_chances(odds, teams, 0, rng, exchangeable=exchangeable)
    if exchangeable or size <= 4:
        np.testing.assert_allclose(found, total, rtol=1e-10)
        assert not error.any()
    else:
        assert (np.abs(found - total) < 5 * error + 1e-12).all()
        assert error.max() > 0


def test_total_distribution_keeps_to_the_rules():
    members, size = 4, 3
    allowed = rules(members, size, 1)
    odds = proposal(table(members, 4), np.zeros(members), allowed)
    total = total_distribution(odds, field(members, size, valid=allowed), 0, exchangeable=False)
    possible = {tuple(np.sort(team)) for team in all_teams(members, size) if allowed[np.arange(size), team].all()}
    assert {tuple(team) for team in unordered_teams(members, size)[total > 0]} == possible
    np.testing.assert_allclose(total.sum(), 1.0, rtol=1e-12)
    teams = filled(odds, np.full((4000, size), OPEN), np.zeros(4000, dtype=int), np.random.default_rng(0))
    assert allowed[np.arange(size), teams].all()


@pytest.mark.parametrize("count", range(4))
def test_partial_teams_are_complete_and_in_order(count):
    teams = partial_teams(3, 3, count, merged=False)
    expected = [team for team in product(range(OPEN, 3), repeat=3) if team.count(OPEN) == 3 - count]
    assert list(map(tuple, teams)) == expected
    merged = partial_teams(3, 3, count, merged=True)
    assert list(map(tuple, merged)) == sorted({tuple(sorted(team)) for team in expected})
