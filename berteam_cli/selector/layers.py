"""The layers of torch's ``nn.Transformer``, computed with less work where a team leaves work out.

The modules of torch hold the weights, and what is computed with them equals what they compute themselves (post-norm,
ReLU). Two things are cheaper here. Where attention has a single key, its softmax is 1, so neither queries nor keys are
needed: a network that has seen nothing reads one source token. And dropout takes sixteen random bits for each
number; torch's own takes a whole draw, which costs more than the products of matrices between two dropouts.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

STEPS = 2**16  # chances of dropout are whole multiples of 1 / STEPS


class Dropout(nn.Module):
    """Sets numbers to 0 in training, each with the same chance, and scales the others so that the mean stays.

    Args:
        chance: in [0, 1), rounded to a multiple of 1 / STEPS.
    """

    def __init__(self, chance: float) -> None:
        """Remembers the chance."""
        super().__init__()
        self.chance = chance

    def forward(self, x: Tensor) -> Tensor:
        """Returns ``x``, of any shape, with numbers dropped."""
        return dropped(x, self.chance, self.training)


def dropped(x: Tensor, chance: float, training: bool) -> Tensor:
    """Returns ``x`` with numbers dropped in training, as ``Dropout`` does."""
    return x * kept(x.shape, chance, x) if training and chance else x


def kept(shape: torch.Size | tuple[int, ...], chance: float, like: Tensor) -> Tensor:
    """Returns numbers of ``shape``, of the kind of ``like``: 0 where dropout falls, else what keeps the mean."""
    count, steps = torch.Size(shape).numel(), round(chance * STEPS)
    draws = torch.empty((count + 3) // 4, dtype=torch.int64, device=like.device).random_(-(2**63), None)
    stays = draws.view(torch.int16)[:count].view(shape) >= steps - STEPS // 2
    return stays.to(like.dtype).mul_(STEPS / (STEPS - steps))


def attended(attention: nn.MultiheadAttention, x: Tensor, memory: Tensor, absent: Tensor | None = None) -> Tensor:
    """Returns (K, T, d) what ``attention`` gives for the queries of ``x``.

    Args:
        attention: holds the weights.
        x: (K, T, d).
        memory: (K, M, d), or (1, M, d) for all of K alike; the keys and values.
        absent: (K, M) or (1, M) which of them do not count, not all; None for nobody.
    """
    if memory.shape[1] == 1:
        return single(attention, x, memory)
    heads, width = attention.num_heads, attention.embed_dim
    if memory is x:
        queries, keys, values = functional.linear(x, attention.in_proj_weight, attention.in_proj_bias).chunk(3, dim=-1)
    else:
        weights, biases = attention.in_proj_weight, attention.in_proj_bias
        queries = functional.linear(x, weights[:width], biases[:width])
        keys, values = functional.linear(memory, weights[width:], biases[width:]).chunk(2, dim=-1)
        if len(memory) == 1:
            queries = queries.reshape(1, -1, width)  # all that ask the same memory ask it together
    queries, keys, values = (part.unflatten(-1, (heads, -1)).transpose(1, 2) for part in (queries, keys, values))
    mixed = functional.scaled_dot_product_attention(
        queries,
        keys,
        values,
        attn_mask=None if absent is None else ~absent[:, None, None],
        dropout_p=attention.dropout if attention.training else 0.0,
    )
    return attention.out_proj(mixed.transpose(1, 2).reshape(x.shape))


def single(attention: nn.MultiheadAttention, x: Tensor, memory: Tensor) -> Tensor:
    """Returns what ``attended`` does where ``memory``, (K or 1, 1, d), is one key; (K or 1, 1, d) if nothing drops.

    Dropout of the only weight takes away the whole of a head, for each place by itself.
    """
    width = attention.embed_dim
    values = functional.linear(memory, attention.in_proj_weight[2 * width :], attention.in_proj_bias[2 * width :])
    if attention.training and attention.dropout:
        stays = kept((*x.shape[:2], attention.num_heads, 1), attention.dropout, x)
        values = (values.unflatten(-1, (attention.num_heads, -1)) * stays).flatten(2)
    return attention.out_proj(values)


def encoded(encoder: nn.TransformerEncoder, x: Tensor, absent: Tensor | None = None) -> Tensor:
    """Returns (K, M, d) what ``encoder`` makes of ``x``, (K, M, d), where ``absent``, (K, M), do not count."""
    for layer in encoder.layers:
        x = layer.norm1(x + passed(layer.dropout1, attended(layer.self_attn, x, x, absent)))
        x = layer.norm2(x + passed(layer.dropout2, fed(layer, x)))
    return x if encoder.norm is None else encoder.norm(x)


def decoded(
    decoder: nn.TransformerDecoder,
    x: Tensor,
    memory: Tensor,
    absent: Tensor | None = None,
    memory_absent: Tensor | None = None,
    places: Tensor | None = None,
) -> Tensor:
    """Returns (K, T, d) what ``decoder`` makes of ``x``, (K, T, d), which sees all of itself and of ``memory``.

    Args:
        decoder: holds the weights.
        x: (K, T, d).
        memory: (K, M, d), or (1, M, d) for all alike.
        absent: (K, T) which of ``x`` do not count; what is returned for them means nothing.
        memory_absent: (K, M) or (1, M) which of ``memory`` do not count.
        places: (K,) one place of each row to ask for, which makes the result (K, 1, d); None for all.
    """
    for depth, layer in enumerate(decoder.layers, start=1):
        everything = x
        if places is not None and depth == len(decoder.layers):  # nobody reads the last layer's other places
            x = x[torch.arange(len(x), device=x.device), places][:, None]
        x = layer.norm1(x + passed(layer.dropout1, attended(layer.self_attn, x, everything, absent)))
        x = layer.norm2(x + passed(layer.dropout2, attended(layer.multihead_attn, x, memory, memory_absent)))
        x = layer.norm3(x + passed(layer.dropout3, fed(layer, x)))
    return x if decoder.norm is None else decoder.norm(x)


def fed(layer: nn.TransformerEncoderLayer | nn.TransformerDecoderLayer, x: Tensor) -> Tensor:
    """Returns what the feed-forward part of ``layer`` makes of ``x``."""
    return layer.linear2(passed(layer.dropout, functional.relu(layer.linear1(x))))


def passed(dropout: nn.Dropout, x: Tensor) -> Tensor:
    """Returns ``x`` after torch's ``dropout``."""
    return dropped(x, dropout.p, dropout.training)


def sinusoids(length: int, width: int) -> Tensor:
    """Returns (length, width): columns 2i and 2i + 1 are the sine and cosine of place / 10000^(2i / width)."""
    place = torch.arange(length, dtype=torch.float32)[:, None]
    angle = place * torch.exp(torch.arange(0, width, 2) * (-math.log(10_000.0) / width))
    return torch.stack([torch.sin(angle), torch.cos(angle)], dim=-1).reshape(length, width)
