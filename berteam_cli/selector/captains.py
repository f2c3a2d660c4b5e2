"""Who captains the teams of an epoch, and at which place of the team a captain stands.

Paper, Section 3, "Training along with Coevolution". The scheme "berteam" is the paper's text: captains come from
the network's first choice with noise. The other two choose captains without asking the network, "matching" such
that every member is judged equally often.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Bools, Floats, Ints
from berteam_cli.selector.filling import drawn, towards_uniform, within

SCHEMES = ("matching", "uniform", "berteam")


def opening(scheme: str, odds: Floats, noise: Floats, allowed: Bools) -> Floats:
    """Returns (..., T, N) the chance that the captain stands at a place and is a member; all sum to 1.

    "berteam": the place is uniform, the member comes from the noisy conditional there. Else every member who may
    stand anywhere is captain equally often, and stands at one of its places in proportion to the network's chance of
    the member there.

    Args:
        scheme: one of SCHEMES.
        odds: (..., T, N) the network's chances of the members at each place of a team nobody stands in yet.
        noise: (N,) in [0, 1].
        allowed: (T, N) who may stand at each place.
    """
    if scheme == "berteam":
        return within(towards_uniform(odds, noise), allowed) / len(allowed)
    # A captain unthinkable everywhere still stands somewhere.
    odds = np.where(allowed, np.maximum(within(odds, allowed), np.finfo(np.float64).tiny), 0.0)
    anywhere = odds.sum(axis=-2, keepdims=True)
    share = np.divide(odds, anywhere, out=np.zeros_like(odds), where=anywhere > 0)
    return share / allowed.any(axis=0).sum()


def captains(scheme: str, chances: Floats, rng: Generator) -> Ints:
    """Returns (B, S) the captains of B games by ``scheme``.

    Args:
        scheme: one of SCHEMES.
        chances: (B, S, N) of each member to be the captain of each team, where the network decides; a member that may
            not stand in a team has none.
        rng: the only source of chance.
    """
    games, sides, members = chances.shape
    if scheme == "berteam":
        return drawn(chances.reshape(-1, members), rng).reshape(games, sides)
    deal = dealt if scheme == "matching" else distinct
    eligible = np.flatnonzero(chances[0, 0] > 0)
    return eligible[deal(games, sides, len(eligible), rng)]


def distinct(games: int, sides: int, members: int, rng: Generator) -> Ints:
    """Returns (B, S) members, uniform, nobody twice in a game unless there are fewer members than sides."""
    decks = -(-sides // members)
    deck = np.tile(np.arange(members), (games * decks, 1))
    return rng.permuted(deck, axis=1).reshape(games, -1)[:, :sides]


def dealt(games: int, sides: int, members: int, rng: Generator) -> Ints:
    """Returns (B, S) members dealt from shuffled decks: nobody comes a second time before all came once.

    A game that begins with the end of one deck and ends with the start of the next still has distinct captains,
    unless there are fewer members than sides: the new deck brings members of the old end later.
    """
    decks: list[Ints] = []
    while len(decks) * members < games * sides:
        deck = rng.permutation(members)
        begun = len(decks) * members % sides  # captains the game at the boundary already has
        if begun and members >= sides:
            free = np.flatnonzero(~np.isin(deck, decks[-1][-begun:]))[: sides - begun]
            deck = np.concatenate([deck[free], np.delete(deck, free)])
        decks.append(deck)
    return np.concatenate(decks)[: games * sides].reshape(games, sides)
