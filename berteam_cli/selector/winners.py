"""The teams that won lately, with their weights; paper, Section 3, "Training Procedure", and Appendix D."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from berteam_cli.outcomes import ABSENT, OPEN, Bools, Floats, Ints, Outcomes
from berteam_cli.selector.observations import Seen


@dataclass(frozen=True)
class Examples:
    """Teams to learn from.

    Attributes:
        teams: (K, T) members; ABSENT behind the members of a team smaller than T.
        weights: (K,) outcome times ``inverses``; 0 for a team that lost.
        sides: (K,) the side each team played.
        rows: (K, T, R, O) float16, what each member saw of the opponent before the team was chosen.
        lengths: (K, T) how many of the R rows hold something; 0 where nothing was seen.
        inverses: (K,) of the chance that the team was chosen, as a multiple of that in uniform choice; 1 where wins do
            not weigh by it.
    """

    teams: Ints
    weights: Floats
    sides: Ints
    rows: npt.NDArray[np.float16]
    lengths: Ints
    inverses: Floats

    def __len__(self) -> int:
        return len(self.teams)

    def __getitem__(self, rows: Ints) -> Examples:
        """Returns some of the examples."""
        return Examples(*(getattr(self, x.name)[rows] for x in fields(self)))


@dataclass(frozen=True)
class Winners:
    """A ring: the newest team takes the place of the oldest.

    Attributes:
        held: C examples, each with its weight on the day it won; OPEN and 0 in rows that were never used.
        pushed: teams pushed since the start; the next goes to row ``pushed % C``.
    """

    held: Examples
    pushed: int

    def __len__(self) -> int:
        return min(self.pushed, len(self.held))

    @property
    def ages(self) -> Ints:
        """(len,) teams pushed after each one."""
        return (self.pushed - 1 - np.arange(len(self))) % len(self.held)


def no_winners(capacity: int, team_size: int, rows: int = 0, numbers: int = 0) -> Winners:
    """Returns an empty ring for ``capacity`` teams.

    Args:
        capacity: C.
        team_size: T, of the largest team.
        rows: R, observations kept of each member.
        numbers: O, numbers of an observation.
    """
    return Winners(
        Examples(
            np.full((capacity, team_size), OPEN),
            np.zeros(capacity),
            np.zeros(capacity, dtype=np.int64),
            np.zeros((capacity, team_size, rows, numbers), dtype=np.float16),
            np.zeros((capacity, team_size), dtype=np.int64),
            np.zeros(capacity),
        ),
        0,
    )


def pushed(winners: Winners, new: Examples, members: int) -> Winners:
    """Returns ``winners`` with the examples ``new`` pushed one after the other.

    Raises:
        ValueError: as of ``check``.
    """
    check(new, members)
    if not len(new):
        return winners
    capacity = len(winners.held)
    rows = (winners.pushed + np.arange(len(new)))[-capacity:] % capacity
    columns = []
    for x in fields(Examples):
        column = getattr(winners.held, x.name).copy()
        column[rows] = getattr(new, x.name)[-capacity:]
        columns.append(column)
    return Winners(Examples(*columns), winners.pushed + len(new))


def check(examples: Examples, members: int) -> None:
    """Checks what the network is to learn from.

    Raises:
        ValueError: a member is not in [0, ``members``), one stands behind an ABSENT place, a team has none, or a weight
            is negative or not finite.
    """
    absent = examples.teams == ABSENT
    if absent[:, 0].any() or (absent[:, :-1] & ~absent[:, 1:]).any():
        raise ValueError("a team to learn from must have a member, and ABSENT places behind its members alone.")
    outside = ~absent & ((examples.teams < 0) | (examples.teams >= members))
    if outside.any():
        raise ValueError(f"a team to learn from has member {examples.teams[outside][0]}, but there are {members}.")
    wrong = ~(np.isfinite(examples.weights) & (examples.weights >= 0))
    if wrong.any():
        raise ValueError(f"a weight must be finite and not negative, but one is {examples.weights[wrong][0]}.")


def minibatch(rings: Sequence[Winners], size: int, half_life: float, rng: Generator) -> Examples:
    """Returns ``size`` examples drawn uniformly with replacement, as many of each ring, weights scaled to a mean of 1.

    Where all of them lost, their weights stay 0. ``inverses`` are scaled by the same number.

    Args:
        rings: not all empty; those that are give nothing.
        size: how many to draw.
        half_life: pushed teams after which a team counts half; 0 for never.
        rng: the only source of chance.
    """
    filled = [ring for ring in rings if len(ring)]
    shares = np.bincount(np.arange(size) % len(filled), minlength=len(filled))
    rows = [rng.integers(len(ring), size=share) for ring, share in zip(filled, shares, strict=True)]
    parts = [ring.held[drawn] for ring, drawn in zip(filled, rows, strict=True)]
    examples = Examples(*(np.concatenate([getattr(part, x.name) for part in parts]) for x in fields(Examples)))
    weights, inverses = examples.weights, examples.inverses
    if half_life > 0:
        ages = np.concatenate([ring.ages[drawn] for ring, drawn in zip(filled, rows, strict=True)])
        kept = 0.5 ** ((ages - ages.min()) / half_life)  # only ratios matter; the youngest cannot vanish
        weights, inverses = weights * kept, inverses * kept
    scale = weights.mean() if weights.any() else 1.0
    return replace(examples, weights=weights / scale, inverses=inverses / scale)


def in_parts(examples: Examples, size: int) -> list[tuple[Examples, float]]:
    """Returns ``examples`` in parts of at most ``size``, each with its share of all."""
    starts = range(0, len(examples), size)
    parts = [examples[np.arange(first, min(first + size, len(examples)))] for first in starts]
    return [(part, len(part) / len(examples)) for part in parts]


def harvest(
    outcomes: Outcomes,
    seen: Seen,
    chosen: Bools,
    draw_weight: float,
    weight_cap: float,
    log_uniform: float | None,
    *,
    losers: bool = False,
) -> Examples:
    """Returns the teams to learn from, games in order.

    With inverse probability weighting a team A weighs w = min(U / P(A), cap), U the chance of each team where all are
    equally likely, so that the weighted share of every team is proportional to how often it wins, however often it is
    chosen (Appendix D, which has no cap).

    Args:
        outcomes: of B games.
        seen: what each team knew when it was chosen, (B, S).
        chosen: (B, S) which of the teams were chosen for their game.
        draw_weight: factor for the teams of a draw; 0 leaves them out.
        weight_cap: largest weight before that factor.
        log_uniform: ln U to weight by inverse probability; None to give every team weight 1.
        losers: whether teams of weight 0 are kept too.
    """
    scores, lineups = outcomes.scores, outcomes.lineups
    value = np.where(scores == 1.0, 1.0, np.where(scores > 0.0, draw_weight, 0.0))  # (B, S)
    kept = ((value > 0) | losers) & chosen
    inverses = np.ones(int(kept.sum()))
    if log_uniform is not None:
        chances = lineups.log_chances[kept]
        if np.isnan(chances).any():
            raise ValueError("selector.weighting needs log_chances of every team, but some are NaN.")
        inverses = np.exp(np.minimum(log_uniform - chances, np.log(weight_cap)))
    sides = np.nonzero(kept)[1]
    return Examples(lineups.teams[kept], value[kept] * inverses, sides, seen.rows[kept], seen.lengths[kept], inverses)
