"""Plays any number of games: in batches, told of as they go, and kept so that an interrupted evaluation goes on."""

from __future__ import annotations

import hashlib
import json
import logging
from pathlib import Path

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.games import Games
from berteam_cli.outcomes import EVENTS, Lineups, Outcomes
from berteam_cli.progress import progress
from berteam_cli.records import SHEET_ENDINGS
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
    first = 0
    if sheet is not None:
        first = begun(sheet, done, named(games, policies, lineups, seed))
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
            if sheet is not None:
                with sheet.with_suffix(".games").open("ab") as file:
                    file.write(rows.tobytes())
            tell(len(rows))
    return Outcomes(
        lineups,
        done["scores"].astype(np.float64),
        done["steps"].astype(np.int64),
        done["events"].astype(np.int64),
        done["seed"].astype(np.uint64),
    )


def forget(sheet: Path) -> None:
    """Removes what ``play_all`` kept: its tables are written."""
    for ending in SHEET_ENDINGS:
        sheet.with_suffix(ending).unlink(missing_ok=True)


def columns(lineups: Lineups) -> tuple[npt.NDArray, ...]:
    """Returns the arrays of ``lineups``."""
    return lineups.teams, lineups.captains, lineups.log_chances


def record_of(sides: int) -> np.dtype:
    """Returns how a game of so many sides is kept."""
    return np.dtype(
        [("scores", "<f8", (sides,)), ("steps", "<u4"), ("events", "<u4", (sides, len(EVENTS))), ("seed", "<u8")]
    )


def named(games: Games, policies: Policies, lineups: Lineups, seed: int) -> str:
    """Returns a name that only the same games of the same players have."""
    digest = hashlib.sha256(json.dumps([games.env.fingerprint(), seed, BATCH], sort_keys=True).encode())
    for array in (*policies, *columns(lineups)):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def begun(sheet: Path, done: npt.NDArray, name: str) -> int:
    """Reads the games kept in ``sheet`` into ``done`` and returns how many they are, whole batches only.

    A sheet of other games is begun anew.
    """
    about, kept = sheet.with_suffix(".json"), sheet.with_suffix(".games")
    size = done.dtype.itemsize
    try:
        same = json.loads(about.read_text(encoding="utf-8")).get("games") == name
        data = kept.read_bytes() if same else b""
    except (OSError, ValueError, AttributeError):
        data = b""
    whole = min(len(data) // size, len(done))
    if whole < len(done):
        whole -= whole % BATCH
    rows = np.frombuffer(data[: whole * size], dtype=done.dtype)
    done[:whole] = rows
    sheet.parent.mkdir(parents=True, exist_ok=True)
    kept.write_bytes(data[: whole * size])
    about.write_text(json.dumps({"games": name}), encoding="utf-8")
    return whole
