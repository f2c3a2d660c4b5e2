import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.selector.base import Field
from berteam_cli.selector.mcaa import Mcaa, McaaState
from tests.strategies import UNSEEN, floats, outcomes

ISLANDS = np.array([0, 0, 1, 2, 2, 2])
FITNESS = np.zeros(6)
RNG = np.random.default_rng(0)


def mcaa(train_every=1, learning_rate=0.2, team_size=2, valid=None, islands=ISLANDS):
    return Mcaa(Field(islands, team_size, valid=valid), learning_rate, train_every)


def rules(rng):
    """Returns (2, 6) who may stand where, at random, and (2, 3) of each island the part that may."""
    allowed = rng.random((2, 6)) < 0.5
    allowed[np.arange(2), rng.integers(6, size=2)] = True
    return allowed, allowed @ np.eye(3)[ISLANDS] / np.bincount(ISLANDS)


def winners(teams):
    """Returns games that the first of two sides won, ``teams``, (K, T)."""
    teams = np.asarray(teams)
    return outcomes(np.stack([teams, teams], axis=1), np.tile([1.0, 0], (len(teams), 1)))


DRAW = outcomes([[[0, 0], [2, 2]]], [[0.5, 0.5]])


@given(floats(3), st.integers(0, 2**32))
def test_the_step_is_the_gradient_of_half_the_squared_error(logits, seed):
    """O7: the same step as autograd of -eta / 2 ||q - softmax(theta)||^2."""
    rng = np.random.default_rng(seed)
    teams = rng.integers(6, size=(5, 2, 2))
    games = outcomes(teams, np.tile([1.0, 0], (5, 1)))
    learnt, _ = mcaa().learn(McaaState(logits, np.zeros(3, dtype=int), 0), games, UNSEEN, FITNESS, RNG)

    theta = torch.tensor(logits, requires_grad=True)
    q = torch.tensor(np.bincount(ISLANDS[teams[:, 0].ravel()], minlength=3) / 10)
    (-0.2 / 2 * ((q - torch.softmax(theta, 0)) ** 2).sum()).backward()
    np.testing.assert_allclose(learnt.logits, logits + theta.grad.numpy(), atol=1e-12)


@given(floats(3))
def test_distribution(logits):
    selector, state = mcaa(), McaaState(logits, np.zeros(3, dtype=int), 0)
    found = selector.distribution(state)
    assert found.probability.sum() == pytest.approx(1)
    shares = state.shares / [2, 1, 3]
    by_team = dict(zip(map(tuple, found.teams), found.probability, strict=True))
    assert by_team[0, 0] == pytest.approx(shares[0] ** 2)
    assert by_team[1, 2] == pytest.approx(2 * shares[0] * shares[1])
    np.testing.assert_allclose(selector.captains(state), shares[ISLANDS])


def test_sampled_teams_come_as_often_as_the_distribution_says():
    selector, state = mcaa(), McaaState(np.array([0.5, -1, 0]), np.zeros(3, dtype=int), 0)
    found = selector.distribution(state)
    drawn = np.sort(selector.sample(state, 20_000, np.random.default_rng(1)), axis=1)
    counts = [(drawn == team).all(axis=1).mean() for team in found.teams]
    np.testing.assert_allclose(counts, found.probability, atol=0.012)


def test_only_winners_count_and_only_every_so_many_epochs():
    selector = mcaa(train_every=2)
    state = selector.init(RNG)
    games = outcomes([[[2, 2], [0, 0]], [[0, 1], [3, 3]]], [[1, 0], [0.5, 0.5]])
    once, said = selector.learn(state, games, UNSEEN, FITNESS, RNG)
    np.testing.assert_array_equal(once.logits, 0)
    np.testing.assert_array_equal(once.wins, [0, 2, 0])
    assert said.updates == 0
    assert said.buffer == 1
    twice, said = selector.learn(once, outcomes([[[4, 4], [0, 0]]], [[1, 0]]), UNSEEN, FITNESS, RNG)
    assert said.updates == 1
    assert twice.logits[0] < 0
    assert twice.logits[1] == pytest.approx(twice.logits[2])
    np.testing.assert_array_equal(twice.wins, 0)
    np.testing.assert_array_equal(state.wins, 0)  # the state before is as it was


def test_no_wins_no_step():
    drawn = outcomes([[[0, 0], [2, 2]]], [[0.5, 0.5]])
    after, said = mcaa().learn(mcaa().init(RNG), drawn, UNSEEN, FITNESS, RNG)
    np.testing.assert_array_equal(after.logits, 0)
    assert said.updates == 0


def test_log_chances_are_those_of_the_ordered_team():
    selector, state = mcaa(), McaaState(np.array([0.5, -1, 0]), np.zeros(3, dtype=int), 0)
    lineups = selector.select(state, 7, np.zeros(6, dtype=int), np.random.default_rng(2))
    chances = selector.captains(state)[lineups.teams].prod(axis=2)
    np.testing.assert_allclose(np.exp(lineups.log_chances), chances)
    assert (lineups.captains == -1).all()


def test_tensors_and_back():
    state = McaaState(np.array([0.5, -1, 0]), np.array([1, 2, 3]), 5)
    again = mcaa().restored(mcaa().tensors(state))
    np.testing.assert_array_equal(again.logits, state.logits)
    np.testing.assert_array_equal(again.wins, state.wins)
    assert again.epochs == 5


def test_rules_are_kept_and_shares_hold_among_who_may_stand_there():
    allowed = np.array([[True, True, True, False, False, False], [False, False, False, True, True, False]])
    selector, state = mcaa(valid=allowed), McaaState(np.log([0.5, 0.2, 0.3]), np.zeros(3, dtype=int), 0)
    first = np.array([0.25, 0.25, 0.2]) / 0.7
    found = selector.distribution(state)
    by_team = dict(zip(map(tuple, found.teams), found.probability, strict=True))
    assert by_team == pytest.approx({(a, b): first[a] / 2 for a in range(3) for b in (3, 4)})
    lineups = selector.select(state, 200, np.zeros(6, dtype=int), np.random.default_rng(0))
    assert allowed[np.arange(2), lineups.teams].all()
    np.testing.assert_allclose(np.exp(lineups.log_chances), first[lineups.teams[:, :, 0]] / 2)


@given(floats(3), st.integers(0, 2**32))
def test_within_rules_the_step_is_the_gradient_too(logits, seed):
    """O7 with s the mean over places of what is drawn there: a softmax over who may stand there."""
    rng = np.random.default_rng(seed)
    allowed, parts = rules(rng)
    selector, state = mcaa(valid=allowed), McaaState(logits, np.zeros(3, dtype=int), 0)
    teams = selector.sample(state, 5, rng)
    learnt, said = selector.learn(state, winners(teams), UNSEEN, FITNESS, RNG)

    theta = torch.tensor(logits, requires_grad=True)
    q = torch.tensor(np.bincount(ISLANDS[teams.ravel()], minlength=3) / 10)
    s = torch.softmax(theta + torch.log(torch.tensor(parts)), dim=1).mean(dim=0)
    loss = ((q - s) ** 2).sum() / 2
    loss.backward()
    np.testing.assert_allclose(learnt.logits, logits - 0.2 * theta.grad.numpy(), atol=1e-12)
    assert said.loss == pytest.approx(loss.item(), abs=1e-12)


@given(floats(3), st.integers(0, 2**32))
def test_within_rules_shares_stay_where_winners_are_what_is_drawn(logits, seed):
    """A coin decides each game: members win as often as they are drawn, and these expected wins move nothing."""
    allowed, _ = rules(np.random.default_rng(seed))
    selector, nobody = mcaa(valid=allowed), np.zeros(3)
    drawn = np.bincount(ISLANDS, selector.captains(McaaState(logits, nobody, 0)))
    learnt, said = selector.learn(McaaState(logits, 1000 * drawn, 0), DRAW, UNSEEN, FITNESS, RNG)
    assert said.updates == 1
    np.testing.assert_allclose(learnt.logits, logits, atol=1e-12)


def test_within_rules_shares_stay_by_hand():
    """28 winners, every team as often as it is drawn: 5 : 5 : 4 for members 0, 1 and 2 beside 3 or 4."""
    allowed = np.array([[True, True, True, False, False, False], [False, False, False, True, True, False]])
    selector, logits = mcaa(valid=allowed), np.log([0.5, 0.2, 0.3])
    games = winners([(a, b) for a, often in enumerate((5, 5, 4)) for b in (3, 4) for _ in range(often)])
    after, _ = selector.learn(McaaState(logits, np.zeros(3, dtype=int), 0), games, UNSEEN, FITNESS, RNG)
    np.testing.assert_allclose(after.logits, logits, atol=1e-12)
    more, _ = selector.learn(McaaState(logits, np.zeros(3, dtype=int), 0), winners([(2, 3)]), UNSEEN, FITNESS, RNG)
    assert more.logits[1] > logits[1]  # it won more often than it is drawn


@given(floats(4), st.integers(0, 2**32))
def test_an_island_that_may_stand_nowhere_is_as_if_it_were_not_there(logits, seed):
    """As exploiters are: the others learn what they would without it."""
    teams = np.random.default_rng(seed).integers(6, size=(5, 2))
    islands, allowed = np.append(ISLANDS, [3, 3]), np.tile(np.arange(8) < 6, (2, 1))
    alone, _ = mcaa().learn(McaaState(logits[:3], np.zeros(3, dtype=int), 0), winners(teams), UNSEEN, FITNESS, RNG)
    beside, _ = mcaa(valid=allowed, islands=islands).learn(
        McaaState(logits, np.zeros(4, dtype=int), 0), winners(teams), UNSEEN, np.zeros(8), RNG
    )
    assert beside.logits[3] == logits[3]
    np.testing.assert_allclose(beside.logits[:3], alone.logits, atol=1e-12)
