"""What a checkpoint costs."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from berteam_cli import checkpoint
from berteam_cli.checkpoint import Saved
from berteam_cli.training import begin, epoch
from tests.bench.timing import Row, parts, seconds

EPOCHS = 20  # after which buffers and rollouts have something in them


def checkpoint_rows() -> Iterator[Row]:
    """Sixty members of the paper's comparison, PPO and DQN, with BERTeam."""
    made = parts("experiment=paper_comparison", "selector=berteam")
    run = begin(made)
    for _ in range(EPOCHS // 2):
        run, _ = epoch(run, made)
    started = time.perf_counter()
    for _ in range(EPOCHS // 2):
        run, _ = epoch(run, made)
    each = (time.perf_counter() - started) / (EPOCHS // 2)
    with tempfile.TemporaryDirectory() as folder:
        taken = seconds(lambda: checkpoint.save(Path(folder), Saved(run, {}, 0.0), made))
        size = sum(path.stat().st_size for path in Path(folder).rglob("*") if path.is_file())
    yield f"a checkpoint of 60 members, {size / 2**20:.0f} MiB, s", f"{taken:.2f}", "0.3"
    every = 50  # the default of checkpoint_every
    yield f"  of a run's time, one in {every} epochs, %", f"{100 * taken / (taken + every * each):.1f}", "2"


ROWS = (checkpoint_rows,)
