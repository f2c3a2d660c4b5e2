"""Speed and memory of the selector; team_network.py tells of what."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import torch

from berteam_cli.selector.embedders import EMBEDDERS
from berteam_cli.training import begin
from tests.bench.team_network import TASKS, sampling, total, update
from tests.bench.timing import Row, parts, seconds


def selector_rows() -> Iterator[Row]:
    """On one thread, as in a run, whose Workers give torch no more."""
    torch.set_num_threads(1)
    batched = seconds(update(60, 2))
    yield "BERTeam update, 512 teams in minibatches of 64, 60 members, s", f"{batched:.2f}", "0.3"
    yield "  times as long one team at a time", f"{seconds(update(60, 2, one_by_one=True), 1) / batched:.0f}", ""
    for name in EMBEDDERS:
        yield f"  with observations of 420 steps, {name}, s", f"{seconds(update(60, 2, name)):.2f}", "2"
    yield "BERTeam update, 500 members, teams of 10, s", f"{seconds(update(500, 10)):.2f}", "3"
    yield "  100 of its teams, s", f"{seconds(sampling(500, 10, 100)):.2f}", "0.3"

    chosen = parts("experiment=paper_comparison")
    run, rng = begin(chosen), np.random.default_rng(0)
    ages = np.zeros(60, dtype=np.int64)
    games = seconds(lambda: chosen.selector.select(run.selection, 25, ages, rng), 9)
    yield "BERTeam, teams of 25 games, ms", f"{1000 * games:.0f}", "20"
    yield "BERTeam, total distribution, 60 members, teams of 2, ms", f"{1000 * seconds(total(60, 2), 9):.0f}", "50"
    yield "  50 members, teams of 3, s", f"{seconds(total(50, 3)):.2f}", "3"


def memory_rows() -> Iterator[Row]:
    """Each of the tasks above in a process of its own."""
    for name in TASKS:
        words = [sys.executable, "-m", "tests.bench.team_network", name]
        used = subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
        yield f"BERTeam, memory of a process that does {name}, MiB", used, "500"


ROWS = (selector_rows, memory_rows)
