"""The table of a sweep: one row a run, written again whenever a run has ended."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from berteam_cli.errors import InputError, RunError, shown
from berteam_cli.folder import MANIFEST, Manifest, read_manifest
from berteam_cli.records import COLUMNS, cell

TABLE = "sweep.csv"


def swept(task: Callable[[], float], folder: Path, overrides: list[str]) -> tuple[float, bool]:
    """Runs one job of a sweep; an error ends the job and not the sweep, an interrupt ends both.

    Args:
        task: the job; returns the expected Elo.
        folder: of the job, in the sweep's folder.
        overrides: what tells this job from the others.

    Returns:
        The expected Elo, NaN if the job failed, and whether it did not.
    """
    error = ""
    try:
        return task(), True
    except (InputError, RunError) as refused:
        error = str(refused)
        print(shown(f"berteam: job {folder.name} ({' '.join(overrides)}): {error}"), flush=True)
        return math.nan, False
    finally:
        manifest = Manifest.of(folder) if (folder / MANIFEST).exists() else Manifest.begun(folder, status="refused")
        manifest.add(overrides=overrides, error=error)
        write(folder.parent)


def write(sweep: Path) -> None:
    """Writes the table from the run folders below ``sweep``; there is never half of it."""
    rows = []
    for path in sorted((p for p in sweep.iterdir() if p.name.isdigit()), key=lambda p: int(p.name)):
        if not (path / MANIFEST).exists():
            continue
        facts = read_manifest(path)
        row: dict[Any, Any] = {
            "job": int(path.name),
            "overrides": " ".join(facts.get("overrides", [])),
            "status": facts["status"],
        }
        if (path / "summary.csv").exists():
            row |= pd.read_csv(path / "summary.csv", dtype={"best_team": str}).iloc[0].to_dict()
        rows.append(row | {"error": facts.get("error", "")})
    columns = ["job", "overrides", "status", *COLUMNS["summary"], "error"]
    part = sweep / f"{TABLE}.{os.getpid()}.part"
    pd.DataFrame(rows, columns=columns).map(cell).to_csv(part, index=False, lineterminator="\n")
    os.replace(part, sweep / TABLE)
