"""Who captains the teams of an epoch, and at which place of the team a captain stands.

Paper, Section 3, "Training along with Coevolution". The scheme "berteam" is the paper's text: captains come from
the network's first choice with noise. The other two choose captains without asking the network, "matching" such
that every member is judged equally often.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from berteam_cli.outcomes import Floats, Ints
from berteam_cli.selector.filling import drawn, towards_uniform

SCHEMES = ("matching", "uniform", "berteam")


def opening(scheme: str, odds: Floats, noise: Floats) -> Floats:
    """Returns (T, N) the chance that the captain stands at a place and is a member; all sum to 1.

    "berteam": the place is uniform, the member comes from the noisy conditional there. Else every member is
    captain equally often, and stands at a place in proportion to the network's chance of the member there.

    Args:
        scheme: one of SCHEMES.
        odds: (T, N) chances of the members at each place of a team nobody stands in yet.
        noise: (N,) in [0, 1].
    """
    if scheme == "berteam":
        return towards_uniform(odds, noise) / len(odds)
    odds = np.maximum(odds, np.finfo(np.float64).tiny)  # a captain unthinkable everywhere still stands somewhere
    return odds / odds.sum(axis=0) / odds.shape[1]


def captains(scheme: str, opening: Floats, games: int, sides: int, rng: Generator) -> Ints:
    """Returns (B, S) the captains of ``games`` games by ``scheme``; ``opening`` as above."""
    members = opening.shape[1]
    if scheme == "matching":
        return dealt(games, sides, members, rng)
    if scheme == "uniform":
        return distinct(games, sides, members, rng)
    chances = np.broadcast_to(opening.sum(axis=0), (games * sides, members))
    return drawn(chances, rng).reshape(games, sides)


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
