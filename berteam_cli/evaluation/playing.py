"""Plays any number of games: in batches, told of as they go, and kept so that an interrupted evaluation goes on."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.evaluation.sheet import Sheet, named
from berteam_cli.games import Games
from berteam_cli.outcomes import EVENTS, Lineups, Outcomes
from berteam_cli.progress import progress
from berteam_cli.training import key

log = logging.getLogger("berteam")

BATCH = 2_000  # games: some seconds of them, which is what an interruption may lose


def play_all(
    games: Games, policies: Policies, lineups: Lineups, seed: int, title: str, sheet: Path | None = None
) -> Outcomes:
    """Returns the outcomes of all ``lineups``, in order.

    Args:
        games: the game and its threads.
        policies: how the members of the line-ups act.
        lineups: B games.
        seed: of their streams, below 2**63.
        title: what the games are for, as it is told.
        sheet: a file without ending, to which every batch is added when it has been played. If it holds the first
            batches of these very games they are read, and not played again. None keeps nothing.
    """
    record = record_of(games.env.sides)
    done = np.zeros(len(lineups), dtype=record)
    first, kept = 0, None
    if sheet is not None:
        kept = Sheet(sheet, named(games, policies, columns(lineups), seed, BATCH), BATCH)
        first = kept.begun(done)
        if first:
            log.info("%s: going on after %s games.", title, f"{first:,}")
    with progress(title, len(lineups)) as tell:
        tell(first)
        for start in range(first, len(lineups), BATCH):
            part = slice(start, min(start + BATCH, len(lineups)))
            batch = Lineups(*(column[part] for column in columns(lineups)))
            outcomes, _ = games.play(policies, batch, key(np.random.default_rng([seed, start // BATCH])))
            rows = done[part]
            rows["scores"], rows["steps"] = outcomes.scores, outcomes.steps
            rows["events"], rows["seed"] = outcomes.events, outcomes.seeds
            if kept is not None:
                kept.add(rows)
            tell(len(rows))
    return Outcomes(
        lineups,
        done["scores"].astype(np.float64),
        done["steps"].astype(np.int64),
        done["events"].astype(np.int64),
        done["seed"].astype(np.uint64),
    )


def columns(lineups: Lineups) -> tuple[npt.NDArray[Any], ...]:
    """Returns the arrays of ``lineups``."""
    return lineups.teams, lineups.captains, lineups.log_chances


def record_of(sides: int) -> np.dtype:
    """Returns how a game of so many sides is kept."""
    return np.dtype(
        [("scores", "<f8", (sides,)), ("steps", "<u4"), ("events", "<u4", (sides, len(EVENTS))), ("seed", "<u8")]
    )
