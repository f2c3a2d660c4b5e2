"""Speed of sweeps: the same jobs one after the other, each on all cores, and side by side, each on its share."""

from __future__ import annotations

import subprocess
import tempfile
import time
from collections.abc import Iterator

from berteam_cli.workers import available_cores
from tests.bench.timing import Row
from tests.bench.training import BERTEAM

JOBS = 8
WORDS = ["experiment=paper_comparison", "epochs=12", "evaluation.games=400", f"seed={','.join(map(str, range(JOBS)))}"]


def sweep_rows() -> Iterator[Row]:
    """Eight jobs that train and are rated."""
    cores, taken = available_cores(), {}
    beside = ["hydra/launcher=joblib", f"hydra.launcher.n_jobs={cores}"]
    with tempfile.TemporaryDirectory() as folder:
        for name, words in (("one after the other", []), ("side by side", beside)):
            command = [BERTEAM, "train", "-m", *WORDS, *words, f"hydra.sweep.dir={folder}/{len(taken)}"]
            started = time.perf_counter()
            subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
            taken[name] = time.perf_counter() - started
            yield f"{JOBS} jobs of a sweep {name}, on {cores} cores, s", f"{taken[name]:.1f}", ""
    ratio = taken["one after the other"] / taken["side by side"]
    yield "  throughput side by side, times that of one after the other", f"{ratio:.2f}", "0.9"


ROWS = (sweep_rows,)
