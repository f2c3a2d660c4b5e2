"""The transformer that knows which members go together.

Paper, Section 3, "Model Architecture"; its sizes stand in Appendix E.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn
from torch.func import functional_call

from berteam_cli.outcomes import OPEN, Floats, Ints
from berteam_cli.selector.filling import Odds
from berteam_cli.selector.observations import Seen

POSITIONS = ("append", "add", "none")  # how a token learns its place in the team

ROWS = 2048  # teams of one forward pass; bounds the memory of large requests


class TeamNetwork(nn.Module):
    """Says who could stand at each place of a partly filled team.

    The reader encodes what is known before the game: a learnt token for the side, and what each member saw of the
    opponent. The writer attends to that and to all places of the team in both directions. With position "none" nothing
    tells the places of a team apart.

    Args:
        members: N, one token and one output each; the token MASK has no output.
        team_size: T.
        layers: of the encoder, and as many of the decoder.
        width: numbers in a token, even and a multiple of ``heads``; the feed-forward layers are four times as wide.
        heads: of each attention.
        dropout: chance of a unit to be dropped in training.
        position: one of POSITIONS.
        sides: side tokens; 1 where all sides are alike.
        embedder: turns what a member saw into one token; None where nothing is ever seen.
    """

    def __init__(
        self,
        members: int,
        team_size: int,
        layers: int,
        width: int,
        heads: int,
        dropout: float,
        position: str,
        sides: int = 1,
        embedder: nn.Module | None = None,
    ) -> None:
        """Builds the layers with torch's random weights."""
        super().__init__()
        self.members = members
        self.reader = Reader(layers, width, heads, dropout, sides, embedder)
        self.writer = Writer(members, team_size, layers, width, heads, dropout, position)
        for stack in (self.reader.encoder, self.writer.decoder):  # as torch.nn.Transformer does
            for weight in stack.parameters():
                if weight.dim() > 1:
                    nn.init.xavier_uniform_(weight)

    def forward(
        self, teams: Tensor, sides: Tensor, rows: Tensor | None = None, lengths: Tensor | None = None
    ) -> Tensor:
        """Returns (K, T, N) logits of the members at each place of ``teams``, (K, T) with OPEN places.

        Args:
            teams: the partial teams.
            sides: (K,) side token of each.
            rows: (K, P, R, O) what its players saw; None for nothing.
            lengths: (K, P) rows that hold something; 0 for a player who saw nothing.
        """
        return self.writer(teams, *self.reader(sides, rows, lengths))


class Reader(nn.Module):
    """Encodes the source: one token for the side and one for each player who saw something."""

    def __init__(
        self, layers: int, width: int, heads: int, dropout: float, sides: int, embedder: nn.Module | None
    ) -> None:
        """Builds the layers; see TeamNetwork."""
        super().__init__()
        self.sides = nn.Embedding(sides, width)
        self.embedder = embedder
        layer = nn.TransformerEncoderLayer(width, heads, 4 * width, dropout, batch_first=True)
        self.encoder = nn.TransformerEncoder(layer, layers, nn.LayerNorm(width), enable_nested_tensor=False)

    def forward(self, sides: Tensor, rows: Tensor | None, lengths: Tensor | None) -> tuple[Tensor, Tensor | None]:
        """Returns (U, 1 + P, width) the memory, and (U, 1 + P) which tokens stand for nobody, None if none does."""
        source = self.sides(sides)[:, None]
        if self.embedder is None or rows is None or lengths is None:
            return self.encoder(source), None
        absent = torch.cat([torch.zeros_like(sides, dtype=torch.bool)[:, None], lengths == 0], dim=1)
        source = torch.cat([source, self.embedder(rows.to(source.dtype), lengths)], dim=1)
        return self.encoder(source, src_key_padding_mask=absent), absent


class Writer(nn.Module):
    """Completes teams, attending to the memory that the reader made."""

    def __init__(
        self, members: int, team_size: int, layers: int, width: int, heads: int, dropout: float, position: str
    ) -> None:
        """Builds the layers; see TeamNetwork."""
        super().__init__()
        self.members = members
        self.position = position
        self.tokens = nn.Embedding(members + 1, width)  # N members, MASK
        self.register_buffer("places", sinusoids(team_size, width), persistent=False)
        self.joined = nn.Linear(2 * width, width) if position == "append" else None
        self.dropped = nn.Dropout(dropout)
        layer = nn.TransformerDecoderLayer(width, heads, 4 * width, dropout, batch_first=True)
        self.decoder = nn.TransformerDecoder(layer, layers, nn.LayerNorm(width))
        self.head = nn.Linear(width, members)

    def forward(self, teams: Tensor, memory: Tensor, absent: Tensor | None) -> Tensor:
        """Returns (K, T, N) logits; ``memory``, (K, M, width), and ``absent``, (K, M), as the reader returns them."""
        hidden = self.placed(self.tokens(torch.where(teams == OPEN, self.members, teams)))
        return self.head(self.decoder(hidden, memory, memory_key_padding_mask=absent))

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


def odds_of(network: TeamNetwork, weights: dict[str, Tensor], sides: Ints, seen: Seen | None = None) -> Odds:
    """Returns the odds that ``network`` gives with ``weights``, in float64, without dropout.

    Args:
        network: holds the architecture; its own weights do not matter.
        weights: by parameter name.
        sides: (U,) side token of each thing that can be known.
        seen: (U,) what the members saw; None for nothing.
    """
    device = next(iter(weights.values())).device
    reading, writing = part_of(weights, "reader."), part_of(weights, "writer.")
    network.eval()
    with torch.inference_mode():
        known = (sides, None, None) if seen is None else (sides, seen.rows, seen.lengths)
        inputs = tuple(None if x is None else torch.from_numpy(x).to(device) for x in known)
        memory, absent = functional_call(network.reader, reading, inputs)

    def odds(teams: Ints, known: Ints) -> Floats:
        network.eval()
        chances = np.empty((*teams.shape, network.members))
        with torch.inference_mode():
            for first in range(0, len(teams), ROWS):
                rows = slice(first, first + ROWS)
                which = torch.from_numpy(known[rows]).to(device)
                hidden = None if absent is None else absent[which]
                asked = (torch.from_numpy(teams[rows]).to(device), memory[which], hidden)
                logits = functional_call(network.writer, writing, asked)
                # float64 after the network: products over many fill orders must still sum to 1.
                chances[rows] = torch.softmax(logits.double(), dim=-1).cpu().numpy()
        return chances

    return odds


def by_owner(own: Sequence[Odds], owner: Ints) -> Odds:
    """Returns the odds of several networks as one: what is known as number u is known to network ``owner[u]``."""

    def odds(teams: Ints, known: Ints) -> Floats:
        chances: Floats | None = None
        for k, ask in enumerate(own):
            mine = owner[known] == k
            if mine.any():
                answer = ask(teams[mine], known[mine])
                chances = np.empty((len(teams), *answer.shape[1:])) if chances is None else chances
                chances[mine] = answer
        assert chances is not None  # nobody asks about no team
        return chances

    return odds


def part_of(weights: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """Returns the weights whose names begin with ``prefix``, without it."""
    return {name.removeprefix(prefix): value for name, value in weights.items() if name.startswith(prefix)}
