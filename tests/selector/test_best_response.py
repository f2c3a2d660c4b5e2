from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
import torch

from berteam_cli.outcomes import ABSENT, OPEN
from berteam_cli.selector.best_response import best_response_loss, least_entropy, prefixes
from berteam_cli.selector.observations import nothing_seen
from berteam_cli.selector.updates import updated
from berteam_cli.selector.winners import Examples
from tests.selector.test_berteam import all_teams, made

TABLE = np.array([0.1, 0.2, 1.6, 0.3, 0.4, 0.5, 0.6, 0.7])  # of the eight teams of three from two members


def examples(teams, outcomes, inverses=None):
    teams = np.asarray(teams)
    inverses = np.ones(len(teams)) if inverses is None else np.asarray(inverses)
    nothing = nothing_seen((len(teams),), teams.shape[1])
    sides = np.zeros(len(teams), dtype=np.int64)
    return Examples(teams, np.asarray(outcomes) * inverses, sides, nothing.rows, nothing.lengths, inverses)


def everybody(size, members):
    return np.ones((size, members), dtype=np.bool_)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_finds_the_best_of_eight_teams(seed):
    """On the way (1, 1, 1) looks best: members 0 and 1 are alike at place 0, and 1 is better at place 1."""
    selector = made(2, 3, weighting=True, loss="l1", dropout=0.0, width=32, heads=4)
    rng = np.random.default_rng(seed)
    state = selector.init(rng)
    weighted = [[(examples(np.tile(all_teams(2, 3), (8, 1)), np.tile(TABLE, 8)), 1.0)]] * 400
    learnt, _ = updated(
        selector._network, state.learnt[0], weighted, selector._loss, rng, learning_rate=2e-3, averaging=0.0
    )
    total = selector.distribution(replace(state, learnt=(learnt,)))
    drawn = selector.sample(replace(state, learnt=(learnt,)), 1000, rng)
    teams, counts = np.unique(drawn, axis=0, return_counts=True)
    assert list(teams[counts.argmax()]) == [0, 1, 0]
    assert counts.max() > 500
    assert list(total.teams[total.probability.argmax()]) == [0, 0, 1]  # in ascending order


def flat(logits):
    """Returns a network of teams of one that takes these logits whatever it is shown."""
    return lambda teams, *_: logits.expand(len(teams), 1, len(logits))


def loss_of(network, weighted, allowed, coef=0.0, clip=0.3):
    return best_response_loss(network, weighted, allowed, coef, clip, 0.0, 0.0, np.random.default_rng(0))


def test_the_slope_is_that_of_the_mean_weighted_distance():
    """With every team once, that of 2 - 2 mean(w D), divided by mean(D): the baseline changes nothing."""
    start = torch.randn(8, generator=torch.Generator().manual_seed(0))
    ours, plain = start.clone().requires_grad_(), start.clone().requires_grad_()
    weighted = examples(np.arange(8)[:, np.newaxis], TABLE)
    loss_of(flat(ours), weighted, everybody(1, 8)).backward()
    chances = torch.softmax(plain, dim=0)
    ((torch.from_numpy(TABLE) * (2 - 2 * chances)).mean() / chances.mean().detach()).backward()
    torch.testing.assert_close(ours.grad, plain.grad)


def test_the_slope_does_not_vanish_with_the_chances():
    """Two of a hundred members have been seen, and the network hardly thinks of them."""
    logits = torch.cat([torch.zeros(2), torch.full((98,), 50.0)]).requires_grad_()
    loss_of(flat(logits), examples([[0], [1]], [1.0, 0.0]), everybody(1, 100)).backward()
    assert logits.grad[0].item() == pytest.approx(-0.5)
    assert logits.grad[1].item() == pytest.approx(0.5)


def test_a_team_weighs_by_how_much_more_common_it_is_now():
    """Two of three examples are of a team that was chosen twice as often; together they count as one."""
    weighted = examples([[0], [0], [1]], [1.0, 1.0, 0.0], [0.5, 0.5, 1.0])
    assert loss_of(flat(torch.zeros(2)), weighted, everybody(1, 2)).item() == pytest.approx(1.0)
    aged = examples([[0], [1]], [1.0, 0.0], [1.0, 0.0])  # so old that nothing is left of its weight
    assert loss_of(flat(torch.zeros(2)), aged, everybody(1, 2)).item() == pytest.approx(0.0)


def test_prefixes_by_hand():
    shown = prefixes(np.array([[4, 5, 6], [7, ABSENT, 9]]), np.array([[2, 0, 1], [1, 0, 2]]))
    assert shown[:, 0].tolist() == [[OPEN, OPEN, OPEN], [OPEN, OPEN, 6], [4, OPEN, 6]]
    assert shown[:, 1].tolist() == [[OPEN, ABSENT, OPEN], [OPEN, ABSENT, OPEN], [7, ABSENT, OPEN]]


def stub(chances):
    """Returns a network whose conditionals, (N,), are the same everywhere."""
    return lambda teams, sides, rows, lengths: torch.log(torch.tensor(chances)).expand(*teams.shape, len(chances))


def test_only_members_within_the_rules_have_chances():
    """Member 2 may stand nowhere: the others have 0.6 and 0.4, and expect 0.6 * 1 + 0.4 * 0."""
    allowed = np.array([[True, True, False]])
    weighted = examples([[0], [1]], [1.0, 0.0])
    network = stub([0.3, 0.2, 0.5])
    assert loss_of(network, weighted, allowed).item() == pytest.approx(2 - 2 * 0.6)
    entropy = -(0.6 * np.log(0.6) + 0.4 * np.log(0.4))
    loss = loss_of(network, weighted, allowed, 0.5, 1.0)
    assert loss.item() == pytest.approx(2 - 2 * 0.6 - 0.5 * entropy / np.log(2))


def test_absent_places_have_no_say():
    weighted = examples([[0, ABSENT], [1, ABSENT]], [1.0, 0.0])
    assert loss_of(stub([0.6, 0.4]), weighted, everybody(2, 2)).item() == pytest.approx(2 - 2 * 0.6)


@pytest.mark.parametrize("clip", [0.3, 1.0])
def test_entropy_above_the_clip_is_not_rewarded(clip):
    logits = torch.tensor([0.3, 0.0, -0.3, 0.1], requires_grad=True)
    loss = loss_of(flat(logits), examples([[0], [3]], [1.0, 1.0]), everybody(1, 4), 0.5, clip)
    loss.backward()
    assert (loss.item() == pytest.approx(-0.5)) == (clip < 1)
    assert (logits.grad.abs().max() > 1e-4) == (clip == 1)


@pytest.mark.parametrize("clip", [0.05, 0.3])
def test_the_clip_leaves_its_share_to_all_other_teams(clip):
    """Over all teams of three from four members, made of places that are alike."""
    one = (1 - clip) ** (1 / 3)
    place = np.array([one, *[(1 - one) / 3] * 3])
    teams = np.prod(place[all_teams(4, 3)], axis=1)
    assert teams.max() == pytest.approx(1 - clip)
    assert least_entropy(everybody(3, 4), clip) == pytest.approx(-(teams * np.log(teams)).sum())


def test_the_clip_at_its_ends():
    assert least_entropy(everybody(3, 4), 0.0) == 0.0
    assert least_entropy(everybody(3, 4), 1.0) == pytest.approx(3 * np.log(4))
    assert least_entropy(everybody(3, 1), 0.5) == 0.0
    rising = [least_entropy(everybody(2, 3), clip) for clip in np.linspace(0, 1, 21)]
    assert np.all(np.diff(rising) >= 0)


def test_the_mean_over_orders_is_the_chance_of_the_team():
    """The product along one order, over all orders, is what teams are drawn with."""
    selector = made(3, 3, weighting=True, loss="l1", dropout=0.0)
    state = selector.init(np.random.default_rng(0))
    odds = selector._own(selector._odds(state, np.array([0])))
    team = np.array([[2, 0, 1]])
    along = []
    for order in permutations(range(3)):
        shown = prefixes(team, np.array([order]))[:, 0]
        along.append(np.prod([odds(shown[k : k + 1], np.array([0]))[0, i, team[0, i]] for k, i in enumerate(order)]))
    drawn = selector.sample(state, 20_000, np.random.default_rng(1))
    share = np.all(drawn == team, axis=1).mean()
    assert abs(share - np.mean(along)) < 5 * np.sqrt(np.mean(along) / 20_000)


def test_a_smaller_team_is_learnt_from_where_rules_keep_others_from_its_absent_place():
    """Member 0 may not stand at the second place, which the first team does not have."""
    logits = torch.zeros(3, requires_grad=True)
    teams = np.array([[1, ABSENT], [0, 2]])
    allowed = np.array([[True, True, True], [False, True, True]])

    def network(shown, *_):
        return logits.expand(len(shown), 2, 3)

    rng = np.random.default_rng(0)
    loss = best_response_loss(network, examples(teams, [1.0, 0.0]), allowed, 0.5, 0.3, 0.0, 0.0, rng)
    loss.backward()
    assert torch.isfinite(loss)
    assert torch.isfinite(logits.grad).all()
    assert logits.grad.any()
