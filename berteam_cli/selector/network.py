"""The transformer that knows which members go together.

Paper, Section 3, "Model Architecture"; its sizes stand in Appendix E.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor, nn
from torch.func import functional_call

from berteam_cli.outcomes import ABSENT, Floats, Ints
from berteam_cli.selector.embedders import Embedder
from berteam_cli.selector.filling import Odds
from berteam_cli.selector.layers import Dropout, decoded, encoded, sinusoids
from berteam_cli.selector.observations import Seen
from berteam_cli.tensors import below

POSITIONS = ("append", "add", "none")  # how a token learns its place in the team
LONGEST = 512  # T; BERT's

ROWS = 2048  # teams that are worked on at a time; more do not go faster
NUMBERS = 2**23  # that a call may keep at a time, 32 MiB, and twice as many in training; bounds the memory
KEPT_IN_TRAINING = 30  # vectors of each place and layer that wait for the gradient
KEPT_OF_STEPS = 60  # vectors of each observation that do; an LSTM of two layers keeps most
KEPT_IN_USE = 14  # vectors of each place that live at a time: four wide, and what goes into and out of them


class TeamNetwork(nn.Module):
    """Says who could stand at each place of a partly filled team.

    The reader encodes what is known before the game: a learnt token for the side, and what each member saw of the
    opponent. The writer attends to that and to all places of the team in both directions. With position "none" nothing
    tells the places of a team apart.

    Args:
        members: N, one token and one output each; the token MASK has no output.
        team_size: T, places of the largest team, at most LONGEST.
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
        embedder: Embedder | None = None,
    ) -> None:
        """Builds the layers with torch's random weights."""
        super().__init__()
        self.members = members
        stacks = nn.Transformer(width, heads, layers, layers, 4 * width, dropout, batch_first=True)  # and its weights
        self.reader = Reader(sides, width, stacks.encoder, embedder)
        self.writer = Writer(members, team_size, width, stacks.decoder, dropout, position)

    def forward(
        self, teams: Tensor, sides: Tensor, rows: Tensor | None = None, lengths: Tensor | None = None
    ) -> Tensor:
        """Returns (K, T, N) logits of the members at each place of ``teams``; at ABSENT places they mean nothing.

        Args:
            teams: (K, T) members, OPEN places, and ABSENT where a team has no place.
            sides: (K,) side token of each.
            rows: (K, P, R, O) what its players saw; None for nothing.
            lengths: (K, P) rows that hold something; 0 for a player who saw nothing.
        """
        return self.writer(teams, *self.reader(sides, rows, lengths))

    def rows(self, places: int, players: int = 0, steps: int = 0) -> int:
        """Returns how many teams of ``places`` places a call should read at a time, at least 1, to bound its memory.

        In training all layers keep what the gradient needs, among it the attention of each place to each, and ``steps``
        observations of each of ``players``.
        """
        layer = self.writer.decoder.layers[0]
        width, heads, layers = layer.self_attn.embed_dim, layer.self_attn.num_heads, len(self.writer.decoder.layers)
        if self.training:
            each = layers * (KEPT_IN_TRAINING * width * places + 4 * heads * places**2) + 4 * self.members * places
            if steps:  # else the source is one token
                each += players * width * (KEPT_OF_STEPS * steps + KEPT_IN_TRAINING * layers)
            return max(1, 2 * NUMBERS // each)
        return min(ROWS, max(1, NUMBERS // (places * (KEPT_IN_USE * width + 4 * self.members))))


class Reader(nn.Module):
    """Encodes the source: one token for the side and one for each player who saw something."""

    def __init__(self, sides: int, width: int, encoder: nn.TransformerEncoder, embedder: Embedder | None) -> None:
        """Builds the layers; see TeamNetwork."""
        super().__init__()
        self.sides = nn.Embedding(sides, width)
        self.embedder = embedder
        self.encoder = encoder

    def forward(self, sides: Tensor, rows: Tensor | None, lengths: Tensor | None) -> tuple[Tensor, Tensor | None]:
        """Returns (U, 1 + P, width) the memory, and (U, 1 + P) which tokens stand for nobody, None if none does."""
        source = self.sides(sides)[:, None]
        if self.embedder is None or rows is None or lengths is None or not lengths.any():
            return encoded(self.encoder, source), None
        absent = nn.functional.pad(lengths == 0, (1, 0), value=False)
        source = torch.cat([source, self.embedder(rows, lengths)], dim=1)
        return encoded(self.encoder, source, absent), absent


class Writer(nn.Module):
    """Completes teams, attending to the memory that the reader made."""

    places: Tensor

    def __init__(
        self,
        members: int,
        team_size: int,
        width: int,
        decoder: nn.TransformerDecoder,
        dropout: float,
        position: str,
    ) -> None:
        """Builds the layers; see TeamNetwork."""
        super().__init__()
        self.members = members
        self.position = position
        self.tokens = nn.Embedding(members + 1, width)  # N members, MASK
        self.register_buffer("places", sinusoids(team_size, width), persistent=False)
        self.joined = nn.Linear(2 * width, width) if position == "append" else None
        self.dropped = Dropout(dropout)
        self.decoder = decoder
        self.head = nn.Linear(width, members)

    def forward(self, teams: Tensor, memory: Tensor, nobody: Tensor | None, places: Tensor | None = None) -> Tensor:
        """Returns (K, T, N) logits, or (K, N) those at ``places``, (K,).

        Args:
            teams: (K, T) members, OPEN places, and ABSENT where a team has no place.
            memory: (K, M, width), or (1, M, width) for all alike, as the reader returns it.
            nobody: of the same first two axes, as the reader returns it.
            places: (K,) one place of each team to ask for; None for all.
        """
        absent = teams == ABSENT
        tokens = self.placed(self.tokens(torch.where(teams < 0, self.members, teams)))
        hidden = decoded(self.decoder, tokens, memory, absent if absent.any() else None, nobody, places)
        return self.head(hidden if places is None else hidden[:, 0])

    def placed(self, tokens: Tensor) -> Tensor:
        """Returns ``tokens``, (K, T, width), with the place of each written into it."""
        codes = self.places[: tokens.shape[1]]
        if self.joined is not None:
            tokens = self.joined(torch.cat([tokens, codes.expand_as(tokens)], dim=-1))
        elif self.position == "add":
            tokens = tokens + codes
        return self.dropped(tokens)


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
    reading, writing = below(weights, "reader."), below(weights, "writer.")
    network.eval()
    with torch.inference_mode():
        known = (sides, None, None) if seen is None else (sides, seen.rows, seen.lengths)
        inputs = tuple(None if x is None else torch.from_numpy(x).to(device) for x in known)
        memory, absent = functional_call(network.reader, reading, inputs)

    def odds(teams: Ints, known: Ints, places: Ints | None = None) -> Floats:
        if network.training:  # saying so to all modules each time takes as long as they do
            network.eval()
        chances = np.empty((*teams.shape[: 2 if places is None else 1], network.members))
        size = network.rows(teams.shape[1])
        with torch.inference_mode():
            for first in range(0, len(teams), size):
                rows = slice(first, first + size)
                which = torch.from_numpy(known[rows]).to(device) if len(sides) > 1 else slice(None)
                asked = (
                    torch.from_numpy(teams[rows]).to(device),
                    memory[which],
                    None if absent is None else absent[which],
                    None if places is None else torch.from_numpy(places[rows]).to(device),
                )
                logits = functional_call(network.writer, writing, asked)
                # float64 after the network: products over many fill orders must still sum to 1.
                chances[rows] = torch.softmax(logits.double(), dim=-1).cpu().numpy()
        return chances

    return odds


def by_owner(own: Sequence[Odds], owner: Ints) -> Odds:
    """Returns the odds of several networks as one: what is known as number u is known to network ``owner[u]``."""

    def odds(teams: Ints, known: Ints, places: Ints | None = None) -> Floats:
        chances: Floats | None = None
        for k, ask in enumerate(own):
            mine = owner[known] == k
            if mine.any():
                answer = ask(teams[mine], known[mine], None if places is None else places[mine])
                chances = np.empty((len(teams), *answer.shape[1:])) if chances is None else chances
                chances[mine] = answer
        assert chances is not None  # nobody asks about no team
        return chances

    return odds
