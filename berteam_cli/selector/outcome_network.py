"""A network that foretells a game from its line-ups."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from berteam_cli.outcomes import Floats, Ints

NUMBERS = 2**17  # of the hidden layer at once; bounds the memory of large requests


class OutcomeNetwork(nn.Module):
    """Tells how the sides of a game will share its score.

    A team is the mean of its members' embeddings, so that their order does not matter; a side's logit is a function of
    its team and of the mean of the others, the same for all sides.

    Args:
        members: N.
        width: numbers in an embedding and in each hidden layer.
    """

    def __init__(self, members: int, width: int) -> None:
        """Builds the layers with torch's random weights."""
        super().__init__()
        self.members = nn.Embedding(members, width)
        self.team = nn.Linear(width, width)
        self.ours = nn.Linear(width, width)
        self.theirs = nn.Linear(width, width, bias=False)
        self.head = nn.Linear(width, 1)

    def forward(self, teams: Tensor) -> Tensor:
        """Returns (K, S) logits, whose softmax is each side's expected share of the score, of (K, S, T) teams."""
        code = self.encoded(teams)
        theirs = self.theirs(code)
        others = (theirs.sum(dim=1, keepdim=True) - theirs) / (teams.shape[1] - 1)
        return self.logits(self.ours(code), others)

    def encoded(self, teams: Tensor) -> Tensor:
        """Returns (..., width) of (..., T) teams."""
        return torch.relu(self.team(self.members(teams).mean(dim=-2)))

    def logits(self, ours: Tensor, others: Tensor) -> Tensor:
        """Returns (...,) logits of (..., width) sides against (..., width) others."""
        return self.head(torch.relu(ours + others)).squeeze(-1)


def foretold(network: OutcomeNetwork, teams: Ints, against: Ints, often: Ints) -> Floats:
    """Returns (K,) the score that each of ``teams`` is expected to have, on average over whom it plays.

    Args:
        network: with its weights.
        teams: (K, T).
        against: (C, S - 1, T) the other sides of C games.
        often: (C,) how often each of these games counts.
    """
    games, rivals = against.shape[:2]
    scores = np.empty(len(teams))
    weights = torch.from_numpy(often / often.sum())
    with torch.inference_mode():
        theirs = network.encoded(torch.from_numpy(against))  # (C, S - 1, W)
        seen = network.theirs(theirs)
        total = seen.sum(dim=1)  # (C, W)
        rows = max(1, NUMBERS // (games * (rivals + 1) * theirs.shape[-1]))
        for first in range(0, len(teams), rows):
            code = network.encoded(torch.from_numpy(teams[first : first + rows]))  # (R, W)
            own = network.logits(network.ours(code)[:, None], total[None] / rivals)  # (R, C)
            met = (network.theirs(code)[:, None, None] + total[None, :, None] - seen[None]) / rivals
            other = network.logits(network.ours(theirs)[None], met)  # (R, C, S - 1)
            shares = torch.softmax(torch.cat([own[:, :, None], other], dim=2).double(), dim=2)
            scores[first : first + rows] = (shares[:, :, 0] @ weights).numpy()
    return scores
