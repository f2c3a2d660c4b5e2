import numpy as np
import pytest
import torch

from berteam_cli.selector.embedders import EMBEDDERS, embedder
from berteam_cli.selector.layers import sinusoids

torch.set_num_threads(1)
NUMBERS, WIDTH = 5, 8


def made(name, dropout=0.0, **settings):
    torch.manual_seed(0)
    standard = {"numbers": NUMBERS, "width": WIDTH, "heads": 2, "lstm_layers": 2, "dropout": dropout}
    return embedder(name, **standard | settings)


def seen_of(teams=3, players=2, steps=6, seed=0):
    rng = np.random.default_rng(seed)
    lengths = rng.integers(1, steps + 1, size=(teams, players))
    rows = rng.normal(size=(teams, players, steps, NUMBERS)).astype(np.float16)
    return torch.from_numpy(rows), torch.from_numpy(lengths)


def test_the_paper_s_lstm_has_the_known_number_of_parameters():
    lstm = made("lstm", numbers=45, width=128)
    assert sum(weight.numel() for weight in lstm.parameters()) == 221_696


@pytest.mark.parametrize("name", EMBEDDERS)
def test_each_player_is_embedded_as_alone_and_whatever_stands_beyond_its_length(name):
    module, (rows, lengths) = made(name), seen_of()
    lengths[0, 0] = 6
    for k, p in np.ndindex(*lengths.shape):
        rows[k, p, lengths[k, p] :] = torch.nan
    vectors = module(rows, lengths)
    assert vectors.shape == (3, 2, WIDTH)
    for k, p in np.ndindex(*lengths.shape):
        alone = module(rows[k : k + 1, p : p + 1, : lengths[k, p]], lengths[k : k + 1, p : p + 1])
        torch.testing.assert_close(alone[0, 0], vectors[k, p], atol=1e-5, rtol=0)
    vectors.square().sum().backward()
    assert all(torch.isfinite(weight.grad).all() and weight.grad.any() for weight in module.parameters())


@pytest.mark.parametrize("name", EMBEDDERS)
def test_who_saw_nothing_is_nothing_and_changes_nobody(name):
    module, (rows, lengths) = made(name), seen_of()
    everybody = module(rows, lengths)
    present = torch.tensor([[True, False], [False, False], [True, True]])
    some = module(rows, torch.where(present, lengths, 0))
    torch.testing.assert_close(some, everybody * present[..., None], atol=1e-5, rtol=0)
    assert torch.equal(module(rows, torch.zeros_like(lengths)), torch.zeros(3, 2, WIDTH))


def test_lstm_gives_torch_s_last_output():
    module, (rows, lengths) = made("lstm"), seen_of()
    for k, p in np.ndindex(*lengths.shape):
        outputs, _ = module.lstm(rows[k, p, : lengths[k, p]].float())
        torch.testing.assert_close(module(rows, lengths)[k, p], outputs[-1], atol=1e-5, rtol=0)


def test_mean_by_hand():
    module, (rows, lengths) = made("mean"), seen_of()
    expected = torch.stack([module.layers(step) for step in rows[1, 1, : lengths[1, 1]].float()]).mean(dim=0)
    torch.testing.assert_close(module(rows, lengths)[1, 1], expected, atol=1e-5, rtol=0)


def test_attention_is_torch_s_of_the_marked_steps():
    module, (rows, lengths) = made("attention"), seen_of()
    length = int(lengths[2, 0])
    marked = module.projected(rows[2, 0, :length].float()) + sinusoids(length, WIDTH)
    expected = module.attention(module.query[None], marked, marked)[0][0]
    torch.testing.assert_close(module(rows, lengths)[2, 0], expected, atol=1e-5, rtol=0)


@pytest.mark.parametrize(("name", "ordered"), [("lstm", True), ("mean", False), ("attention", True)])
def test_only_mean_forgets_the_order_of_steps(name, ordered):
    module, (rows, lengths) = made(name), seen_of()
    lengths[:] = 6
    assert torch.allclose(module(rows, lengths), module(rows.flip(2), lengths), atol=1e-5) != ordered


@pytest.mark.parametrize("name", EMBEDDERS)
def test_dropout_acts_in_training_alone(name):
    module, seen = made(name, dropout=0.5), seen_of()
    assert not torch.equal(module(*seen), module(*seen))
    module.eval()
    assert torch.equal(module(*seen), module(*seen))
