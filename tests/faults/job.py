"""The run that all faults befall, and whether it came through."""

from __future__ import annotations

import contextlib
import io
import shutil
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from berteam_cli import cli
from berteam_cli.folder import MANIFEST
from tests.faults.forking import finished

WORDS = (
    *("train", "population=islands4x3", "optimizer=mapelites", "selector=berteam", "out=run", "workers=1"),
    *("env.max_time_s=20", "epochs=9", "games_per_epoch=4", "record_every=2", "checkpoint_every=2"),
    *("selector.width=16", "selector.layers=1", "selector.heads=2", "selector.train_every=2"),
    *("optimizer.protect_new=1", "evaluation.games=30", "evaluation.reference_teams=3", "payoff_steps=0"),
    *(f"population.islands.{name}.learner.n_steps=64" for name in ("ppo64", "ppo96")),
)
GO_ON = (*WORDS, "on_exists=resume")
TIMED = ("timing.csv", "summary.csv")
"""Tables whose numbers say how long something took."""


@dataclass(frozen=True)
class Whole:
    """A run that nothing befell.

    Attributes:
        tables: bytes of its tables by name, those left out that tell times.
        seconds: it took.
    """

    tables: dict[str, bytes]
    seconds: float


def whole(place: Path) -> Whole:
    """Runs the job without a fault, in this process, which has everything loaded then, and in one of its own."""
    fresh(place)
    with contextlib.chdir(place), contextlib.redirect_stdout(io.StringIO()):
        sys.argv = ["berteam", *WORDS]
        cli.main()
    here = tables(place / "run")
    fresh(place)
    began = time.monotonic()
    code, said = finished(place, *WORDS)
    assert code == 0, said
    assert tables(place / "run") == here
    return Whole(here, time.monotonic() - began)


def fresh(place: Path) -> None:
    """Makes ``place`` an empty folder."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)


def tables(run: Path) -> dict[str, bytes]:
    """Returns the tables of a run that do not tell times."""
    return {path.name: path.read_bytes() for path in sorted(run.glob("*.csv")) if path.name not in TIMED}


def wrong_now(place: Path) -> str:
    """Returns what is wrong with the run as it lies there, broken off: nothing, if its tables read."""
    if not (place / "run" / MANIFEST).exists():
        return ""
    code, said = finished(place, "inspect", "run")
    return "" if code == 0 else f"inspect: exit {code}: {said}"


def wrong_at_last(place: Path, known: Whole) -> str:
    """Goes on with the run to its end; returns what differs from the whole one: nothing, if it came through.

    With the command that a user is told, where there is a checkpoint; else with the one that began.
    """
    there = any((place / "run" / "checkpoint").glob("epoch_*"))
    code, said = finished(place, *(("resume", "run") if there else GO_ON))
    if code:
        return f"exit {code}: {said}"
    found = tables(place / "run")
    differ = sorted(name for name in found.keys() | known.tables.keys() if found.get(name) != known.tables.get(name))
    if differ:
        return f"other bytes in {', '.join(differ)}"
    for name in TIMED:
        pd.read_csv(place / "run" / name)
    left = [path.name for path in (place / "run").rglob("*part")]
    return f"left behind: {left}" if left else ""


def one_sentence(said: str) -> str:
    """Returns what is wrong with a refusal: nothing, if it is one sentence without a traceback."""
    return f"traceback: {said}" if "Traceback" in said or "Logging error" in said or "berteam: " not in said else ""


def moments(seconds: float, count: int, seed: int) -> np.ndarray:
    """Returns (count,) random moments of a run that takes so many ``seconds``."""
    return np.sort(np.random.default_rng(seed).uniform(0, seconds, count))
