"""Learning by masking: hide members of winning teams and let the network guess them.

Paper, Section 3, "Training Procedure"; the masks are those of BERT.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import ABSENT, OPEN, Bools, Ints
from berteam_cli.selector.winners import Examples

SHOWN_AS_MASK = 0.8  # of the hidden places; BERT's shares
SHOWN_AS_ANYONE = 0.1  # the rest is shown as it is


def masked(teams: Ints, members: int, rng: Generator) -> tuple[Ints, Bools]:
    """Returns (K, T) teams as the network sees them and (K, T) which places it must guess.

    Each team draws a share q from {0, 1/T, ..., 1}, T being the number of its own places, each of them is hidden with
    chance q, and one, chosen uniformly, in any case. So every number of hidden places, as it comes about in filling, is
    trained. (The published code draws the shares of all teams of a minibatch from those of its first team.)

    Args:
        teams: (K, T) members, ABSENT where a team has no place; no place OPEN.
        members: N.
        rng: the only source of chance.
    """
    own = teams != ABSENT
    sizes = own.sum(axis=1)
    share = rng.integers(sizes + 1) / sizes
    hidden = rng.random(teams.shape) < share[:, np.newaxis]
    forced = (np.cumsum(own, axis=1) > rng.integers(sizes)[:, np.newaxis]).argmax(axis=1)
    hidden[np.arange(len(teams)), forced] = True
    hidden &= own

    kind = rng.random(teams.shape)
    anyone = rng.integers(members, size=teams.shape)
    shown = np.where(kind < SHOWN_AS_MASK + SHOWN_AS_ANYONE, anyone, teams)
    shown = np.where(kind < SHOWN_AS_MASK, OPEN, shown)
    return np.where(hidden, shown, teams), hidden


def guessing_loss(logits: Tensor, teams: Tensor, hidden: Tensor, weights: Tensor) -> Tensor:
    """Returns the mean over teams of weight times the mean cross-entropy of the hidden places, in nats.

    Args:
        logits: (K, T, N).
        teams: (K, T) the true members, ABSENT where a team has no place.
        hidden: (K, T) bool, at least one in each row, none of them ABSENT.
        weights: (K,), mean 1.
    """
    chosen = teams.clamp(min=0)[..., None]
    surprise = -torch.log_softmax(logits, dim=-1).gather(-1, chosen)[..., 0]  # (K, T)
    per_team = (surprise * hidden).sum(dim=1) / hidden.sum(dim=1)
    return (weights * per_team).mean()


def forgotten(lengths: Ints, drop_input: float, drop_player: float, rng: Generator) -> Ints:
    """Returns ``lengths``, (K, T) rows that each member saw, 0 for those who are taken to have seen nothing.

    All members of a team with chance ``drop_input``, else each with chance ``drop_player``. What a member saw is kept
    or dropped whole, so that in training it looks as it does when a team is chosen.
    """
    whole = rng.random((len(lengths), 1)) < drop_input
    return np.where(whole | (rng.random(lengths.shape) < drop_player), 0, lengths)


def masking_loss(
    network: Callable[..., Tensor],
    examples: Examples,
    members: int,
    drop_input: float,
    drop_player: float,
    rng: Generator,
) -> Tensor:
    """Returns the loss of guessing hidden members of a minibatch, in nats.

    Args:
        network: from its inputs to logits.
        examples: weights with mean 1.
        members: N.
        drop_input: as of ``forgotten``.
        drop_player: as there.
        rng: the only source of chance.
    """
    shown, hidden = masked(examples.teams, members, rng)
    seen: tuple[npt.NDArray[Any] | None, npt.NDArray[Any] | None] = (None, None)
    if examples.rows.shape[2]:
        seen = (examples.rows, forgotten(examples.lengths, drop_input, drop_player, rng))
    logits = network(shown, examples.sides, *seen)
    teams, asked, weights = (torch.from_numpy(x).to(logits.device) for x in (examples.teams, hidden, examples.weights))
    return guessing_loss(logits, teams, asked, weights.float())
