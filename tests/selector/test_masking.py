import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import OPEN
from berteam_cli.selector.masking import guessing_loss, masked

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
