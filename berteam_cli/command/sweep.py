"""The table of a sweep: one row a run, written again whenever a run has ended."""

from __future__ import annotations

import json
import logging
import math
import os
from collections.abc import Callable
from pathlib import Path

import pandas as pd

from berteam_cli.errors import InputError, RunError
from berteam_cli.folder import MANIFEST, Manifest
from berteam_cli.records import COLUMNS

log = logging.getLogger("berteam")


def swept(task: Callable[[], float], folder: Path, overrides: list[str]) -> tuple[float, bool]:
    """Runs one job of a sweep; an error ends the job and not the sweep.

    Args:
        task: the job; returns the expected Elo.
        folder: of the job, in the sweep's folder.
        overrides: what tells this job from the others.

    Returns:
        The expected Elo, NaN if the job failed, and whether it did not.
    """
    error = ""
    try:
        expected = task()
    except (InputError, RunError) as refused:
        expected, error = math.nan, str(refused)
        print(f"berteam: job {folder.name} ({' '.join(overrides)}): {refused}", flush=True)
    manifest = folder / MANIFEST
    if not manifest.exists():
        Manifest(folder).end("refused")
    facts = json.loads(manifest.read_text(encoding="utf-8")) | {"overrides": overrides, "error": error}
    manifest.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    write(folder.parent)
    return expected, not error


def write(sweep: Path) -> None:
    """Writes sweep.csv from the run folders below ``sweep``."""
    rows = []
    for path in sorted((p for p in sweep.iterdir() if p.name.isdigit()), key=lambda p: int(p.name)):
        if not (path / MANIFEST).exists():
            continue
        facts = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
        row = {"job": int(path.name), "overrides": " ".join(facts.get("overrides", [])), "status": facts["status"]}
        if (path / "summary.csv").exists():
            row |= pd.read_csv(path / "summary.csv", dtype={"best_team": str}).iloc[0].to_dict()
        rows.append(row | {"error": facts.get("error", "")})
    columns = ["job", "overrides", "status", *COLUMNS["summary"], "error"]
    part = sweep / "sweep.part"
    pd.DataFrame(rows, columns=columns).to_csv(part, index=False, lineterminator="\n")
    os.replace(part, sweep / "sweep.csv")
