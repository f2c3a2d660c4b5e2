"""Keeps what games came to while more are played, so that interrupted work goes on where it was."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.games import Games
from berteam_cli.records import SHEET_ENDINGS


@dataclass(frozen=True)
class Sheet:
    """Rows of one kind, in a file that grows by batches.

    Attributes:
        path: without ending; beside the rows lies a file that says of which work they are.
        name: that only the same work has; see ``named``.
        batch: rows that are added at once.
    """

    path: Path
    name: str
    batch: int

    def begun(self, done: npt.NDArray[Any]) -> int:
        """Reads the rows kept into ``done`` and returns how many they are, whole batches only.

        A sheet of other work is begun anew.
        """
        about, kept = self.path.with_suffix(".json"), self.path.with_suffix(".games")
        size = done.dtype.itemsize
        try:
            same = json.loads(about.read_text(encoding="utf-8")).get("games") == self.name
            data = kept.read_bytes() if same else b""
        except (OSError, ValueError, AttributeError):
            data = b""
        whole = min(len(data) // size, len(done))
        if whole < len(done):
            whole -= whole % self.batch
        done[:whole] = np.frombuffer(data[: whole * size], dtype=done.dtype)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(data[: whole * size])
        about.write_text(json.dumps({"games": self.name}), encoding="utf-8")
        return whole

    def add(self, rows: npt.NDArray[Any]) -> None:
        """Adds a batch of ``rows``."""
        with self.path.with_suffix(".games").open("ab") as file:
            file.write(rows.tobytes())


def named(games: Games, policies: Policies, arrays: Iterable[npt.NDArray[Any]], seed: int, batch: int) -> str:
    """Returns a name that only the same games of the same players have, whom ``arrays`` list."""
    digest = hashlib.sha256(json.dumps([games.env.fingerprint(), seed, batch], sort_keys=True).encode())
    for array in (*policies, *arrays):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def forget(path: Path) -> None:
    """Removes what was kept under ``path``: its tables are written."""
    for ending in SHEET_ENDINGS:
        path.with_suffix(ending).unlink(missing_ok=True)
