import numpy as np
import pytest
import torch
from torch import nn

from berteam_cli.selector.layers import Dropout, attended, decoded, encoded, kept, sinusoids

torch.set_num_threads(1)
WIDTH, HEADS, LAYERS = 16, 4, 3


def made(dropout=0.0, seed=0):
    torch.manual_seed(seed)
    theirs = nn.Transformer(WIDTH, HEADS, LAYERS, LAYERS, 4 * WIDTH, dropout, batch_first=True)
    for name, weight in theirs.named_parameters():
        if "norm" in name or "bias" in name:  # torch starts these at 0 and 1, which would hide a swap
            nn.init.normal_(weight, mean=float("norm" in name), std=0.3)
    return theirs


def ours(theirs, source, team, source_absent=None, absent=None):
    memory = encoded(theirs.encoder, source, source_absent)
    return decoded(theirs.decoder, team, memory, absent, source_absent)


def pictures(sources, places, rows=5, seed=1):
    rng = torch.Generator().manual_seed(seed)
    source, team = torch.randn(rows, sources, WIDTH, generator=rng), torch.randn(rows, places, WIDTH, generator=rng)
    source_absent, absent = (
        torch.rand(rows, sources, generator=rng) < 0.4,
        torch.rand(rows, places, generator=rng) < 0.4,
    )
    source_absent[:, 0] = absent[:, -1] = False
    return source, team, source_absent, absent


@pytest.mark.parametrize("masked", [False, True])
@pytest.mark.parametrize(("sources", "places"), [(1, 1), (1, 3), (3, 1), (3, 4)])
def test_layers_are_those_of_torch_s_transformer(sources, places, masked):
    theirs, (source, team, source_absent, absent) = made(), pictures(sources, places)
    if not masked:
        source_absent = absent = None
    masks = dict(zip(("src", "memory", "tgt"), (source_absent, source_absent, absent), strict=True))
    expected = theirs(source, team, **{f"{name}_key_padding_mask": mask for name, mask in masks.items()})
    found = ours(theirs, source, team, source_absent, absent)
    counts = torch.ones_like(found[..., 0], dtype=torch.bool) if absent is None else ~absent
    torch.testing.assert_close(found[counts], expected[counts], atol=1e-5, rtol=0)

    slope = torch.randn(expected[counts].shape, generator=torch.Generator().manual_seed(3))
    for result, keep in ((expected, True), (found, False)):
        theirs.zero_grad()
        (result[counts] * slope).sum().backward()
        if keep:
            gradients = {name: weight.grad.clone() for name, weight in theirs.named_parameters()}
    for name, weight in theirs.named_parameters():
        torch.testing.assert_close(weight.grad, gradients[name], atol=1e-4, rtol=1e-4, msg=name)


@pytest.mark.parametrize("sources", [1, 3])
def test_one_memory_serves_all_rows(sources):
    theirs, (source, team, source_absent, absent) = made(), pictures(sources, 4)
    memory, unseen = encoded(theirs.encoder, source[:1], source_absent[:1]), source_absent[:1]
    shared = decoded(theirs.decoder, team, memory, absent, unseen)
    alone = decoded(theirs.decoder, team, memory.expand(5, -1, -1), absent, unseen.expand(5, -1))
    torch.testing.assert_close(shared, alone, atol=1e-5, rtol=0)


def test_one_place_of_each_row_is_as_among_all():
    theirs, (source, team, source_absent, absent) = made(), pictures(3, 4)
    memory, places = encoded(theirs.encoder, source, source_absent), torch.tensor([3, 0, 2, 1, 3])
    everywhere = decoded(theirs.decoder, team, memory, absent, source_absent)
    one = decoded(theirs.decoder, team, memory, absent, source_absent, places)
    torch.testing.assert_close(one[:, 0], everywhere[torch.arange(5), places], atol=1e-5, rtol=0)


@pytest.mark.parametrize("sources", [1, 2])
def test_dropout_of_attention_has_torch_s_mean_and_spread(sources):
    torch.manual_seed(4)
    theirs = nn.MultiheadAttention(WIDTH, HEADS, 0.3, batch_first=True)
    x, memory = torch.randn(1, 2, WIDTH).expand(20_000, -1, -1), torch.randn(1, sources, WIDTH).expand(20_000, -1, -1)
    with torch.no_grad():
        one, other = attended(theirs, x, memory), theirs(x, memory, memory)[0]
    error = other.std(dim=0) / 20_000**0.5
    assert torch.all((one.mean(dim=0) - other.mean(dim=0)).abs() < 6 * 1.5 * error)
    np.testing.assert_allclose(one.std(dim=0).numpy(), other.std(dim=0).numpy(), rtol=0.05)
    both = [torch.corrcoef(result[:, :, 0].T)[0, 1].item() for result in (one, other)]  # places drop by themselves
    assert abs(both[0]) < 0.05
    assert abs(both[1]) < 0.05


def test_dropout_keeps_the_mean_and_drops_each_number_by_itself():
    torch.manual_seed(5)
    numbers = kept((100_000, 3), 0.1, torch.ones(1))
    values, counts = numbers.unique(return_counts=True)
    np.testing.assert_allclose(values.numpy(), [0, 1 / 0.9], rtol=1e-5)
    assert abs(counts[0].item() / 300_000 - 0.1) < 5 * (0.09 / 300_000) ** 0.5
    dropped = numbers.numpy() == 0
    assert abs(np.mean(dropped[:, 0] & dropped[:, 1]) - 0.01) < 5 * (0.01 / 100_000) ** 0.5
    assert abs(np.mean(dropped[1:, 2] & dropped[:-1, 2]) - 0.01) < 5 * (0.01 / 100_000) ** 0.5


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_dropout_of_any_number_of_numbers(count):
    x, dropout = torch.ones(count), Dropout(0.5)
    seen = torch.stack([dropout(x) for _ in range(200)])
    assert torch.all((seen == 0) | (seen == 2))
    assert torch.all((seen == 0).any(dim=0) & (seen == 2).any(dim=0))
    assert torch.equal(dropout.eval()(x), x)


def test_sinusoids_by_hand():
    code = sinusoids(3, 4).numpy()
    np.testing.assert_allclose(code[0], [0, 1, 0, 1])
    np.testing.assert_allclose(code[2], [np.sin(2), np.cos(2), np.sin(0.02), np.cos(0.02)], rtol=1e-6)
