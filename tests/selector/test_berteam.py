from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
import torch

from berteam_cli.outcomes import OPEN, Lineups, Outcomes
from berteam_cli.selector.base import Field, orderings, unordered_teams
from berteam_cli.selector.berteam import Berteam
from berteam_cli.selector.captains import SCHEMES, opening
from berteam_cli.selector.chances import log_chances
from berteam_cli.selector.filling import noise, proposal
from berteam_cli.selector.observations import Looking
from tests.strategies import UNSEEN

torch.set_num_threads(1)

SMALL = {
    "device": "cpu",
    "captain": "matching",
    "weighting": False,
    "weight_cap": np.inf,
    "noise_half_life": 10.0,
    "train_every": 1,
    "batch_size": 64,
    "minibatch_size": 16,
    "capacity": 100,
    "weight_half_life": 0.0,
    "draw_weight": 0.0,
    "loss": "mlm",
    "entropy_coef": 0.5,
    "entropy_clip": 0.3,
    "learning_rate": 1e-3,
    "averaging": 0.0,
    "layers": 1,
    "width": 16,
    "heads": 2,
    "dropout": 0.1,
    "position": "append",
    "side": "shared",
    "dataset": "shared",
    "observations": Looking("none", 10, 0.5, 0.1, "lstm", 2, 0, 0),
}


def made(members=4, team_size=2, sides=2, valid=None, limit=5000, **settings):
    field = Field(np.zeros(members, dtype=np.int64), team_size, sides, valid, limit)
    return Berteam(field=field, **SMALL | settings)


def begun(selector, seed=0, sharper=4.0):
    """Returns a state whose network has clear opinions, as if it had learnt something."""
    state = selector.init(np.random.default_rng(seed))
    learnt = []
    for network in state.learnt:
        weights = dict(network.weights)
        weights["writer.head.weight"] = weights["writer.head.weight"] * sharper
        learnt.append(replace(network, weights=weights))
    return replace(state, learnt=tuple(learnt))


def odds_of(selector, state, sources=1):
    """Returns the network's conditionals as a function of partial teams alone."""
    odds = selector._odds(state, np.arange(sources))
    return lambda teams, known=0: odds(teams, np.full(len(teams), known))


def learn(selector, state, outcomes, rng, seen=UNSEEN):
    return selector.learn(state, outcomes, seen, np.zeros(selector.field.members), rng)


def played(lineups, wins, seed=0):
    """Returns outcomes in which side 0 wins with chance ``wins[its team, the other team]``."""
    members = round(wins.shape[0] ** (1 / lineups.teams.shape[2]))
    code = lineups.teams @ members ** np.arange(lineups.teams.shape[2])[::-1]
    won = np.random.default_rng(seed).random(len(lineups)) < wins[code[:, 0], code[:, 1]]
    return scored(lineups, np.stack([won, ~won], axis=1).astype(float))


def scored(lineups, scores):
    games, sides = scores.shape
    nothing = np.zeros((games, sides, 4), dtype=np.int64)
    return Outcomes(lineups, scores, np.ones(games, dtype=np.int64), nothing, np.zeros(games, dtype=np.uint64))


def same_winner(selector, team, games=20):
    teams = np.tile(np.array(team), (games, 2, 1))
    return scored(Lineups(teams, teams[:, :, 0], np.zeros((games, 2))), np.tile([1.0, 0.0], (games, 1)))


def chances_of(selector, state, teams, ages):
    """Returns the chance that ``select`` makes each of ``teams``."""
    odds, doubt = selector._odds(state, np.array([0])), noise(ages, selector.noise_half_life)
    field, known = selector.field, np.zeros(len(teams), dtype=int)
    first = opening(selector.captain, odds(np.full((1, field.team_size), OPEN), known[:1]), doubt, field.allowed)
    return np.exp(log_chances(proposal(odds, doubt, field.allowed), teams, known, first))


def ordered(selector, state):
    """Returns (N^2,) the chance of every ordered team of two to be sampled."""
    members = selector.field.members
    free = replace(selector, captain="berteam", noise_half_life=0.0)
    return chances_of(free, state, all_teams(members, 2), np.zeros(members))


@cache
def all_teams(members, size):
    return np.array(list(product(range(members), repeat=size)))


def byte_string(selector, state):
    return {name: value.numpy().tobytes() for name, value in selector.tensors(state).items()}


# --- select


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("size", [2, 3])
def test_weighted_by_inverse_chance_every_team_is_equally_common(scheme, size):
    members, games = 3, 15_000
    selector = made(members, size, captain=scheme, weighting=True)
    state, ages = begun(selector), np.array([0, 5, 40])  # noise 1, 0.71, 0.06
    lineups = selector.select(state, games, ages, np.random.default_rng(1))
    weights = np.exp(-size * np.log(members) - lineups.log_chances.ravel())
    code = (lineups.teams @ members ** np.arange(size)[::-1]).ravel()
    share = np.bincount(code, weights=weights, minlength=members**size) / (2 * games)
    chances = chances_of(selector, state, all_teams(members, size), ages)
    np.testing.assert_allclose(chances.sum(), 1.0, rtol=1e-9)
    np.testing.assert_allclose(lineups.log_chances.ravel(), np.log(chances[code]), rtol=1e-5)
    assert chances.max() > 1.5 * chances.min()  # else there would be nothing to correct
    error = members**-size * np.sqrt((1 / chances - 1) / (2 * games))
    assert np.all(np.abs(share - float(members) ** -size) < 5 * error)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_captains_play_in_their_teams(scheme):
    selector = made(6, 3, captain=scheme)
    lineups = selector.select(begun(selector), 9, np.full(6, 20), np.random.default_rng(0))
    assert lineups.teams.shape == (9, 2, 3)
    assert lineups.captains.shape == lineups.log_chances.shape == (9, 2)
    assert np.all((lineups.teams == lineups.captains[:, :, np.newaxis]).any(axis=2))
    assert np.isnan(lineups.log_chances).all()


def test_each_member_captains_once_when_matched():
    selector = made(10, 2)
    lineups = selector.select(begun(selector), 5, np.zeros(10), np.random.default_rng(0))
    assert sorted(lineups.captains.ravel()) == list(range(10))


def test_captains_stand_where_the_network_likes_them():
    selector = made(2, 2, captain="uniform", noise_half_life=0.0)
    state = begun(selector, sharper=8.0)
    for member in range(2):  # teams of old member captains: the other place is filled by the network
        first = odds_of(selector, state)(np.array([[OPEN, OPEN]]))[0][:, member]
        expected = first[0] / first.sum()
        lineups = selector.select(state, 4000, np.full(2, 10**6), np.random.default_rng(0))
        teams = lineups.teams.reshape(-1, 2)[lineups.captains.ravel() == member]
        then = odds_of(selector, state)(np.array([[member, OPEN], [OPEN, member]]))
        at_first = expected * then[0, 1, 1 - member]  # captain at place 0 and the other behind
        share = np.mean((teams[:, 0] == member) & (teams[:, 1] != member))
        assert abs(share - at_first) < 5 * 0.5 / np.sqrt(len(teams))


def test_teams_are_chosen_with_the_averages_where_there_are_any():
    selector = made(averaging=0.9)
    state, rng = selector.init(np.random.default_rng(0)), np.random.default_rng(1)
    for _ in range(5):
        state, _ = learn(selector, state, same_winner(selector, [3, 1]), rng)
    (learnt,) = state.learnt
    as_if = replace(state, learnt=(replace(learnt, weights=learnt.averages, averages={}),))
    newest = replace(state, learnt=(replace(learnt, averages={}),))
    chosen, expected, other = (selector.distribution(x).probability for x in (state, as_if, newest))
    assert np.array_equal(chosen, expected)
    assert not np.allclose(chosen, other)


def test_new_members_fill_places_the_network_would_not_give_them():
    selector = made(4, 2, captain="uniform")
    state = begun(selector)
    learnt, _ = learn(selector, state, same_winner(selector, [1, 1]), np.random.default_rng(0))
    for epoch in range(60):
        learnt, _ = learn(selector, learnt, same_winner(selector, [1, 1]), np.random.default_rng(epoch))
    old, new = (selector.select(learnt, 3000, np.full(4, age), np.random.default_rng(1)) for age in (10**6, 0))
    shares = [np.bincount(lineups.teams.ravel(), minlength=4) / lineups.teams.size for lineups in (old, new)]
    assert shares[0][1] > 0.5  # half of the captains are given, the rest is mostly member 1
    np.testing.assert_allclose(shares[1], 0.25, atol=5 * 0.44 / np.sqrt(12_000))


def test_chance_comes_from_the_generator_alone():
    selector = made(5, 2, weighting=True)
    torch.manual_seed(1)
    np.random.seed(1)  # noqa: NPY002 - the global generator must not matter
    expected = torch.rand(1), np.random.rand()  # noqa: NPY002
    runs = []
    torch.manual_seed(1)
    np.random.seed(1)  # noqa: NPY002
    for _ in range(2):
        rng = np.random.default_rng(3)
        state = selector.init(rng)
        lineups = selector.select(state, 10, np.zeros(5), rng)
        state, _ = learn(selector, state, played(lineups, np.full((25, 25), 0.5)), rng)
        runs.append((lineups.teams.tobytes(), lineups.log_chances.tobytes(), byte_string(selector, state)))
    assert (torch.rand(1), np.random.rand()) == expected  # noqa: NPY002
    assert runs[0] == runs[1]


# --- distribution, sample, captains


@pytest.mark.parametrize("position", ["append", "add", "none"])
def test_distribution_equals_frequencies_of_sample(position):
    selector, count = made(4, 3, position=position), 30_000
    state = begun(selector)
    total = selector.distribution(state)
    assert np.array_equal(total.teams, unordered_teams(4, 3))
    assert (total.other, total.samples) == (0.0, 0)
    np.testing.assert_allclose(total.probability.sum(), 1.0, rtol=1e-14)
    teams = np.sort(selector.sample(state, count, np.random.default_rng(0)), axis=1)
    share = np.array([np.all(teams == team, axis=1).mean() for team in total.teams])
    assert np.all(np.abs(share - total.probability) < 5 * np.sqrt(total.probability / count))


def test_distribution_is_free_of_dropout_and_of_noise():
    selector = made(4, 2)
    state = begun(selector)
    one, other = selector.distribution(state), replace(selector, noise_half_life=0.0).distribution(state)
    assert np.array_equal(one.probability, other.probability)


def test_with_position_none_a_team_is_as_likely_in_any_order():
    for position, alike in (("none", True), ("append", False)):
        selector = made(4, 2, position=position)
        chances = ordered(selector, begun(selector)).reshape(4, 4)
        assert np.allclose(chances, chances.T, rtol=1e-4) == alike


def test_captains_are_the_mean_first_choice():
    selector = made(5, 1)
    state = begun(selector)
    np.testing.assert_allclose(selector.captains(state), selector.distribution(state).probability)
    selector = made(5, 3)
    state = begun(selector)
    first = odds_of(selector, state)(np.full((1, 3), OPEN))[0]
    np.testing.assert_allclose(selector.captains(state), first.sum(axis=0) / 3)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("members", "size"), [(1, 1), (1, 3), (5, 4), (2, 1)])
def test_any_population_and_any_team_size(scheme, members, size):
    selector = made(members, size, captain=scheme, weighting=True)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    lineups = selector.select(state, 3, np.zeros(members), rng)
    state, did = learn(selector, state, scored(lineups, np.tile([0.0, 1.0], (3, 1))), rng)
    assert did.updates == 4
    np.testing.assert_allclose(selector.distribution(state).probability.sum(), 1.0)
    assert selector.sample(state, 7, rng).shape == (7, size)
    assert np.isclose(selector.captains(state).sum(), 1.0)


# --- learn


def test_updates_come_every_so_many_epochs():
    selector = made(train_every=3)
    state, rng = selector.init(np.random.default_rng(0)), np.random.default_rng(1)
    updates = []
    for _ in range(7):
        state, did = learn(selector, state, same_winner(selector, [0, 1]), rng)
        updates.append(did.updates)
        assert np.isnan(did.loss) == (did.updates == 0)
    assert updates == [0, 0, 4, 0, 0, 4, 0]
    assert did.buffer == 100
    assert state.learnt[0].steps == 8


def test_without_any_winner_there_is_no_update():
    selector = made()
    state, rng = selector.init(np.random.default_rng(0)), np.random.default_rng(1)
    lineups = selector.select(state, 5, np.zeros(4), rng)
    draws = scored(lineups, np.full((5, 2), 0.5))
    after, did = learn(selector, state, draws, rng)
    assert (did.updates, did.buffer) == (0, 0)
    assert np.isnan(did.loss)
    assert after.learnt is state.learnt
    assert after.epochs == 1
    after, did = learn(replace(selector, draw_weight=0.5), state, draws, rng)
    assert (did.updates, did.buffer) == (4, 10)
    assert set(after.winners[0].held.weights[:10]) == {0.5}


def test_the_state_handed_in_stays():
    selector = made(weighting=True)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    state, _ = learn(selector, state, same_winner(selector, [0, 1]), rng)
    before = byte_string(selector, state)
    after, _ = learn(selector, state, same_winner(selector, [2, 1]), rng)
    assert byte_string(selector, state) == before
    assert byte_string(selector, after) != before


def test_a_single_winner_becomes_almost_certain():
    selector = made()
    state = selector.init(np.random.default_rng(0))
    for epoch in range(80):
        state, _ = learn(selector, state, same_winner(selector, [3, 1]), np.random.default_rng(epoch))
    total = selector.distribution(state)
    assert total.probability[np.all(total.teams == [1, 3], axis=1)] > 0.9


@pytest.mark.parametrize("averaging", [0.0, 0.9])
def test_a_restored_state_goes_on_as_if_nothing_had_happened(averaging):
    selector = made(weighting=True, averaging=averaging)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    for _ in range(3):
        lineups = selector.select(state, 6, np.arange(4), rng)
        state, _ = learn(selector, state, played(lineups, np.full((16, 16), 0.5)), rng)
    saved = {name: value.clone() for name, value in selector.tensors(state).items()}
    other = made(weighting=True, averaging=averaging)
    again = other.restored(saved)
    assert byte_string(other, again) == byte_string(selector, state)
    for _ in range(2):
        lineups, same = (
            s.select(t, 6, np.arange(4), np.random.default_rng(5)) for s, t in ((selector, state), (other, again))
        )
        assert np.array_equal(lineups.teams, same.teams)
        assert np.array_equal(lineups.log_chances, same.log_chances)
        outcomes = played(lineups, np.full((16, 16), 0.5))
        state, _ = learn(selector, state, outcomes, np.random.default_rng(6))
        again, _ = learn(other, again, outcomes, np.random.default_rng(6))
        assert byte_string(other, again) == byte_string(selector, state)


# --- what learning converges to (paper, Appendix D)


def win_matrix(seed):
    """Returns (16, 16) chances that one ordered team of 4 members beats another; order does not matter."""
    strength = np.random.default_rng(seed).normal(0, 1.5, size=len(unordered_teams(4, 2)))
    of = [np.flatnonzero(np.all(unordered_teams(4, 2) == np.sort(team), axis=1))[0] for team in all_teams(4, 2)]
    return 1 / (1 + np.exp(strength[of] - strength[of][:, np.newaxis]))


def far(one, other):
    """Returns the total variation distance."""
    return np.abs(one - other).sum() / 2


LEARNER = {
    "captain": "berteam",
    "noise_half_life": 0.0,
    "width": 32,
    "dropout": 0.0,
    "batch_size": 4096,
    "minibatch_size": 256,
    "capacity": 20_000,
    "learning_rate": 2e-3,
}


@pytest.mark.parametrize("weighting", [True, False])
def test_weighting_fits_win_rates_and_no_weighting_the_replicator(weighting):
    selector, wins = made(weighting=weighting, **LEARNER | {"averaging": 0.9}), win_matrix(1)
    start = begun(selector, seed=1, sharper=1.5)
    before = ordered(selector, start)
    rates = wins @ before  # W(A) = P(A beats B), B drawn from the network
    fit = {True: rates / rates.sum(), False: before * rates / (before @ rates)}
    assert far(fit[True], fit[False]) > 0.3

    lineups = selector.select(start, 20_000, np.zeros(4), np.random.default_rng(0))
    outcomes = played(lineups, wins)
    state = start
    for epoch in range(12):
        slower = replace(selector, learning_rate=2e-3 if epoch < 8 else 2e-4)
        state, _ = learn(slower, state, outcomes, np.random.default_rng(epoch))
    assert far(ordered(selector, state), fit[weighting]) < 0.05


# --- settings


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ({"captain": "alphabetical"}, "selector.captain"),
        ({"loss": "l2"}, "selector.loss"),
        ({"loss": "l1"}, "selector.loss=l1 needs selector.weighting=true"),
        ({"position": "sideways"}, "selector.position"),
        ({"side": "upside"}, "selector.side"),
        ({"side": "separate"}, "selector.dataset"),
        ({"minibatch_size": 48}, "selector.minibatch_size"),
        ({"heads": 3}, "selector.width"),
        ({"width": 9, "heads": 3}, "selector.width"),
    ],
)
def test_settings_that_cannot_be_are_refused(settings, name):
    with pytest.raises(ValueError, match=name):
        made(**settings)


def test_large_teams_are_fine_without_weighting():
    selector = made(3, 9)
    lineups = selector.select(begun(selector), 2, np.zeros(3), np.random.default_rng(0))
    assert lineups.teams.shape == (2, 2, 9)


def test_unordered_teams_of_the_distribution_add_up_from_ordered_ones():
    selector = made(3, 2)
    state = begun(selector)
    chances = ordered(selector, state).reshape(3, 3)
    total = selector.distribution(state)
    both = np.array([(chances[a, b] + chances[b, a]) / 2 for a, b in total.teams]) * orderings(total.teams)
    np.testing.assert_allclose(total.probability, both, rtol=1e-5)
