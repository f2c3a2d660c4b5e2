import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import ABSENT, OPEN
from berteam_cli.selector.masking import forgotten, guessing_loss, masked, masking_loss
from berteam_cli.selector.winners import Examples

torch.set_num_threads(1)
COUNT = 40_000


def test_of_two_places_one_or_both_are_hidden_equally_often():
    _, hidden = masked(np.zeros((COUNT, 2), dtype=int), 3, np.random.default_rng(0))
    assert abs(np.mean(hidden.sum(axis=1) == 2) - 0.5) < 5 * 0.5 / np.sqrt(COUNT)
    np.testing.assert_allclose(hidden.mean(axis=0), 0.75, atol=5 * 0.45 / np.sqrt(COUNT))


def test_numbers_of_hidden_places_of_three_by_hand():
    # q = 0: 1; q = 1/3: 1, 2, 3 with 4/9, 4/9, 1/9; q = 2/3: with 1/9, 4/9, 4/9; q = 1: 3.
    _, hidden = masked(np.zeros((COUNT, 3), dtype=int), 3, np.random.default_rng(1))
    share = np.bincount(hidden.sum(axis=1), minlength=4)[1:] / COUNT
    np.testing.assert_allclose(share, np.array([14, 8, 14]) / 36, atol=5 * 0.5 / np.sqrt(COUNT))


def test_hidden_places_show_mask_anyone_or_themselves():
    teams = np.full((COUNT, 2), 3)
    shown, hidden = masked(teams, 10, np.random.default_rng(2))
    assert np.array_equal(shown[~hidden], teams[~hidden])
    seen, total = shown[hidden], hidden.sum()
    error = 5 * 0.4 / np.sqrt(total)
    assert abs(np.mean(seen == OPEN) - 0.8) < error
    assert abs(np.mean(seen == 3) - (0.1 + 0.01)) < error  # anyone is sometimes oneself
    for member in (0, 9):
        assert abs(np.mean(seen == member) - 0.01) < error / 4


def test_each_team_draws_from_its_own_number_of_places():
    teams = np.full((2 * COUNT, 5), ABSENT)
    teams[::2, :2] = 1
    teams[1::2, [0, 2, 4]] = 1  # places need not be the first
    shown, hidden = masked(teams, 3, np.random.default_rng(4))
    assert np.array_equal(shown == ABSENT, teams == ABSENT)
    assert not hidden[teams == ABSENT].any()
    for rows, expected in ((hidden[::2], [1 / 2, 1 / 2]), (hidden[1::2], np.array([14, 8, 14]) / 36)):
        share = np.bincount(rows.sum(axis=1), minlength=6)[1:]
        np.testing.assert_allclose(share[: len(expected)] / COUNT, expected, atol=5 * 0.5 / np.sqrt(COUNT))
        assert not share[len(expected) :].any()
    np.testing.assert_allclose(hidden[1::2, [0, 2, 4]].mean(axis=0), 2 / 3, atol=5 * 0.5 / np.sqrt(COUNT))


@settings(deadline=None)
@given(st.integers(1, 6), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_property_something_is_always_hidden(size, members, seed):
    rng = np.random.default_rng(seed)
    teams = rng.integers(members, size=(20, size))
    before = teams.copy()
    shown, hidden = masked(teams, members, rng)
    assert np.all(hidden.any(axis=1))
    assert np.all((shown >= OPEN) & (shown < members))
    assert np.array_equal(teams, before)


def test_loss_by_hand():
    third = np.log(3.0)
    logits = torch.zeros(2, 2, 3)
    logits[0, 0] = torch.log(torch.tensor([0.5, 0.25, 0.25]))
    teams = torch.tensor([[0, 1], [2, 2]])
    hidden = torch.tensor([[True, True], [False, True]])
    weights = torch.tensor([0.5, 1.5])
    expected = (0.5 * (np.log(2) + third) / 2 + 1.5 * third) / 2
    np.testing.assert_allclose(guessing_loss(logits, teams, hidden, weights).item(), expected, rtol=1e-6)


def test_places_that_are_not_hidden_do_not_matter():
    rng = torch.Generator().manual_seed(0)
    logits = torch.randn(4, 2, 3, generator=rng)
    teams, hidden = torch.ones(4, 2, dtype=torch.long), torch.tensor([[True, False]] * 4)
    loss = guessing_loss(logits, teams, hidden, torch.ones(4))
    logits[:, 1] += torch.randn(4, 3, generator=rng)
    assert torch.equal(loss, guessing_loss(logits, teams, hidden, torch.ones(4)))


def test_padding_does_not_matter_to_the_loss():
    rng = torch.Generator().manual_seed(0)
    logits = torch.randn(3, 4, 5, generator=rng)
    teams, hidden = torch.tensor([[1, 2], [0, 4], [3, 3]]), torch.tensor([[True, False], [True, True], [False, True]])
    padded = torch.nn.functional.pad(teams, (0, 2), value=ABSENT)
    loss = guessing_loss(logits, padded, torch.nn.functional.pad(hidden, (0, 2)), torch.ones(3))
    assert torch.equal(loss, guessing_loss(logits[:, :2], teams, hidden, torch.ones(3)))


def test_what_members_saw_is_forgotten_by_whole_teams_or_whole_members():
    lengths = np.full((COUNT, 2), 7)
    lengths[:, 1] = np.where(np.arange(COUNT) % 2, 0, 3)
    left = forgotten(lengths, 0.5, 0.1, np.random.default_rng(0))
    assert np.all((left == lengths) | (left == 0))  # never a part
    pairs = left[lengths[:, 1] > 0] > 0
    share = np.array([np.mean(~pairs.any(axis=1)), np.mean(pairs.all(axis=1))])
    np.testing.assert_allclose(share, [0.5 + 0.5 * 0.01, 0.5 * 0.81], atol=5 * 0.5 / np.sqrt(COUNT / 2))
    single = left[lengths[:, 1] == 0, 0] > 0
    assert abs(single.mean() - 0.45) < 5 * 0.5 / np.sqrt(COUNT / 2)
    assert np.array_equal(lengths[:2], [[7, 3], [7, 0]])


def test_shares_of_forgetting_can_be_told():
    lengths = np.full((50, 3), 4)
    assert np.array_equal(forgotten(lengths, 0.0, 0.0, np.random.default_rng(0)), lengths)
    assert not forgotten(lengths, 1.0, 0.0, np.random.default_rng(0)).any()
    assert not forgotten(lengths, 0.0, 1.0, np.random.default_rng(0)).any()
    teams = forgotten(lengths, 0.5, 0.0, np.random.default_rng(0))
    assert set(teams.sum(axis=1)) == {0, 12}


@pytest.mark.parametrize("rows", [0, 3])
def test_the_network_is_shown_what_is_left_and_judged_by_what_is_hidden(rows):
    teams = np.where(np.arange(3) < np.array([[2], [3], [1]]), np.array([[1, 0, 2]]), ABSENT)
    seen = np.random.default_rng(0).normal(size=(3, 3, rows, 2)).astype(np.float16)
    examples = Examples(teams, np.array([0.5, 2.0, 0.5]), np.array([0, 1, 1]), seen, np.full((3, 3), rows), np.ones(3))
    asked = []

    def network(*inputs):
        asked.append(inputs)
        return torch.randn(3, 3, 4, generator=torch.Generator().manual_seed(1), dtype=torch.float64)

    loss = masking_loss(network, examples, 4, 0.3, 0.5, np.random.default_rng(5))
    rng = np.random.default_rng(5)
    shown, hidden = masked(teams, 4, rng)
    ((found, sides, *known),) = asked
    assert np.array_equal(found, shown)
    assert np.array_equal(sides, examples.sides)
    if rows:
        assert np.array_equal(known[0], seen)
        assert np.array_equal(known[1], forgotten(examples.lengths, 0.3, 0.5, rng))
    else:
        assert known == [None, None]
    surprise = -torch.log_softmax(network(), dim=-1).numpy()
    each = [
        np.mean([surprise[k, i, teams[k, i]] for i in np.flatnonzero(hidden[k])]) * weight
        for k, weight in enumerate(examples.weights)
    ]
    np.testing.assert_allclose(loss.item(), np.mean(each), rtol=1e-6)
