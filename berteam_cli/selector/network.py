"""The transformer that knows which members go together.

Paper, Section 3, "Model Architecture"; its sizes stand in Appendix E.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn
from torch.func import functional_call

from berteam_cli.outcomes import OPEN, Floats, Ints

POSITIONS = ("append", "add", "none")  # how a token learns its place in the team

ROWS = 2048  # teams of one forward pass; bounds the memory of large requests

Odds = Callable[[Ints], Floats]
"""Maps partial teams (K, T), OPEN where nobody stands yet, to (K, T, N) chances of each member at each place."""


class TeamNetwork(nn.Module):
    """Says who could stand at each place of a partly filled team.

    The encoder reads the source, the decoder reads the team and attends to all of its places in both directions.
    The source is one learnt token: whatever is known of the opponent before the game would become more of them.
    With position "none" nothing tells the places of a team apart.

    Args:
        members: N, one token and one output each; the tokens MASK and source have no output.
        team_size: T.
        layers: of the encoder, and as many of the decoder.
        width: numbers in a token, even and a multiple of ``heads``; the feed-forward layers are four times as wide.
        heads: of each attention.
        dropout: chance of a unit to be dropped in training.
        position: one of POSITIONS.
    """

    def __init__(
        self, members: int, team_size: int, layers: int, width: int, heads: int, dropout: float, position: str
    ) -> None:
        """Builds the layers with torch's random weights."""
        super().__init__()
        self.members = members
        self.position = position
        self.tokens = nn.Embedding(members + 2, width)  # N members, MASK, source
        self.register_buffer("places", sinusoids(team_size, width), persistent=False)
        self.joined = nn.Linear(2 * width, width) if position == "append" else None
        self.dropped = nn.Dropout(dropout)
        self.transformer = nn.Transformer(width, heads, layers, layers, 4 * width, dropout, batch_first=True)
        self.head = nn.Linear(width, members)

    def forward(self, teams: Tensor) -> Tensor:
        """Returns (K, T, N) logits of the members at each place of ``teams``, (K, T) with OPEN places."""
        mask, source = self.members, self.members + 1
        # Dropout makes every team see the source differently; without it all see the same.
        sources = len(teams) if self.training else 1
        memory = self.transformer.encoder(self.tokens.weight[source].expand(sources, 1, -1))
        hidden = self.placed(self.tokens(torch.where(teams == OPEN, mask, teams)))
        return self.head(self.transformer.decoder(hidden, memory.expand(len(teams), -1, -1)))

    def placed(self, tokens: Tensor) -> Tensor:
        """Returns ``tokens``, (K, T, width), with the place of each written into it."""
        if self.joined is not None:
            tokens = self.joined(torch.cat([tokens, self.places.expand_as(tokens)], dim=-1))
        elif self.position == "add":
            tokens = tokens + self.places
        return self.dropped(tokens)


def sinusoids(length: int, width: int) -> Tensor:
    """Returns (length, width): columns 2i and 2i + 1 are the sine and cosine of place / 10000^(2i / width)."""
    place = torch.arange(length, dtype=torch.float32)[:, None]
    angle = place * torch.exp(torch.arange(0, width, 2) * (-math.log(10_000.0) / width))
    return torch.stack([torch.sin(angle), torch.cos(angle)], dim=-1).reshape(length, width)


@contextmanager
def seeded(rng: Generator, device: torch.device) -> Iterator[None]:
    """Lets torch draw from a stream that ``rng`` starts, and puts torch's own streams back afterwards.

    Initial weights and dropout cannot be given a generator: torch draws both from the stream of the device.
    """
    seed = int(rng.integers(2**63))
    cuda = [device] if device.type == "cuda" else []
    with torch.random.fork_rng(devices=cuda):
        torch.default_generator.manual_seed(seed)  # unlike torch.manual_seed, leaves other devices alone
        if cuda:
            with torch.cuda.device(device):
                torch.cuda.manual_seed(seed)
        yield


def odds_of(network: TeamNetwork, weights: dict[str, Tensor]) -> Odds:
    """Returns the odds that ``network`` gives with ``weights``, in float64, without dropout."""
    device = next(iter(weights.values())).device

    def odds(teams: Ints) -> Floats:
        network.eval()
        chances = np.empty((*teams.shape, network.members))
        with torch.inference_mode():
            for first in range(0, len(teams), ROWS):
                rows = slice(first, first + ROWS)
                logits = functional_call(network, weights, torch.from_numpy(teams[rows]).to(device))
                # float64 after the network: products over many fill orders must still sum to 1.
                chances[rows] = torch.softmax(logits.double(), dim=-1).cpu().numpy()
        return chances

    return odds
