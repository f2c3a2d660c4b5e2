"""What the team's members saw of an opponent, as one vector for each of them; paper, Section 3, "Input Embedding".

The published code cuts a sequence wherever a row is masked, so that masking rows in training makes many short ones.
Here a player's observations stay one sequence: whole players are left out, or all of them.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn

from berteam_cli.selector.layers import Dropout, attended, sinusoids


class Embedder(nn.Module):
    """Makes one vector of each player's observations.

    Args:
        width: d, numbers in a vector.
    """

    def __init__(self, width: int) -> None:
        """Remembers the width."""
        super().__init__()
        self.width = width

    def forward(self, rows: Tensor, lengths: Tensor) -> Tensor:
        """Returns (K, P, d) vectors, 0 for players who saw nothing; only those of the others are computed.

        Args:
            rows: (K, P, R, O) what each player saw, of any float type.
            lengths: (K, P) how many of the R rows hold something.
        """
        present = lengths > 0
        vectors = torch.zeros(*present.shape, self.width, device=rows.device)
        if not present.any():
            return vectors
        counts = lengths[present]
        steps = rows[present][:, : int(counts.max())].float()  # (R, L, O)
        steps = steps.masked_fill(beyond(steps, counts)[..., None], 0.0)  # even NaN there would reach gradients
        return vectors.masked_scatter(present[..., None], self.embedded(steps, counts))

    def embedded(self, steps: Tensor, lengths: Tensor) -> Tensor:
        """Returns (R, d) one vector of each row of ``steps``, (R, L, O), whose first ``lengths``, (R,), count."""
        raise NotImplementedError


class Lstm(Embedder):
    """The last output of an LSTM, as in the paper."""

    def __init__(self, numbers: int, width: int, layers: int, dropout: float) -> None:
        """Builds ``layers`` with torch's random weights; dropout acts between them."""
        super().__init__(width)
        self.lstm = nn.LSTM(numbers, width, layers, batch_first=True, dropout=dropout if layers > 1 else 0.0)

    def embedded(self, steps: Tensor, lengths: Tensor) -> Tensor:
        """Returns (R, d) the outputs at the last step that counts; what follows it cannot reach it."""
        # Packing the sequences takes up to twice as long as computing steps that nobody reads.
        outputs, _ = self.lstm(steps)
        return outputs[torch.arange(len(steps), device=steps.device), lengths - 1]


class Mean(Embedder):
    """The mean over the steps of what a two-layer perceptron makes of each, whatever their order."""

    def __init__(self, numbers: int, width: int, dropout: float) -> None:
        """Builds the layers with torch's random weights."""
        super().__init__(width)
        self.layers = nn.Sequential(nn.Linear(numbers, width), nn.ReLU(), Dropout(dropout), nn.Linear(width, width))

    def embedded(self, steps: Tensor, lengths: Tensor) -> Tensor:
        """Returns (R, d) the means over the steps that count."""
        made = self.layers(steps).masked_fill(beyond(steps, lengths)[..., None], 0.0)
        return made.sum(dim=1) / lengths[:, None]


class Attention(Embedder):
    """What a learnt query finds among the steps, each marked with its time by sinusoids."""

    def __init__(self, numbers: int, width: int, heads: int, dropout: float) -> None:
        """Builds the layers with torch's random weights."""
        super().__init__(width)
        self.projected = nn.Linear(numbers, width)
        self.query = nn.Parameter(torch.randn(width))
        self.attention = nn.MultiheadAttention(width, heads, dropout, batch_first=True)

    def embedded(self, steps: Tensor, lengths: Tensor) -> Tensor:
        """Returns (R, d) the answers."""
        marked = self.projected(steps) + sinusoids(steps.shape[1], self.width).to(steps.device)
        return attended(self.attention, self.query.expand(len(steps), 1, -1), marked, beyond(steps, lengths))[:, 0]


EMBEDDERS = ("lstm", "mean", "attention")


def embedder(name: str, numbers: int, width: int, heads: int, lstm_layers: int, dropout: float) -> Embedder:
    """Returns an embedder.

    Args:
        name: one of EMBEDDERS.
        numbers: O, of an observation.
        width: d, of the vector it makes of a player.
        heads: of "attention"; divides ``width``.
        lstm_layers: of "lstm".
        dropout: chance of a unit to be dropped in training.
    """
    made: dict[str, Callable[[], Embedder]] = {
        "lstm": lambda: Lstm(numbers, width, lstm_layers, dropout),
        "mean": lambda: Mean(numbers, width, dropout),
        "attention": lambda: Attention(numbers, width, heads, dropout),
    }
    return made[name]()


def beyond(steps: Tensor, lengths: Tensor) -> Tensor:
    """Returns (R, L) which of ``steps``, (R, L, O), lie beyond ``lengths``, (R,)."""
    return torch.arange(steps.shape[1], device=steps.device) >= lengths[:, None]
