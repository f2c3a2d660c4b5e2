"""Speed of training: whole runs by the real command, and how soon a run starts."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from tests.bench.timing import Row, seconds

BERTEAM = str(Path(sys.executable).with_name("berteam"))
WARM = 6  # epochs before the rollouts of 2,048 steps are full for the first time, and kernels are loaded
PARTS = ("select", "play", "learn", "probe", "renew", "selector", "record")
TIMED = ["evaluation.games=0", "on_exists=overwrite"]


def trained(folder: str, *words: str) -> tuple[pd.DataFrame, float]:
    """Runs ``berteam train``; returns timing.csv after the warm-up, and the process's peak of memory in MiB."""
    subprocess.run([BERTEAM, "train", *words, *TIMED, f"out={folder}"], stdout=subprocess.DEVNULL, check=True)
    timing = pd.read_csv(f"{folder}/timing.csv").query(f"epoch > {WARM}")
    return timing, float(pd.read_csv(f"{folder}/summary.csv").peak_rss_mib[0])


def total(timing: pd.DataFrame) -> float:
    return float(timing[[f"{part}_s" for part in PARTS]].sum(axis=1).mean())


def epoch_rows() -> Iterator[Row]:
    """Epochs of the paper's experiments, in the mean of 20 with two selector updates among them."""
    mapelites = ["experiment=paper_comparison", "optimizer=mapelites", "optimizer.protect_new=1"]
    many = ["experiment=paper_coevolution", "population.islands.main.size=500", "games_per_epoch=250"]
    with tempfile.TemporaryDirectory() as folder:
        for name, words, target in (
            ("paper_coevolution", ["experiment=paper_coevolution"], "1.0"),
            ("paper_comparison", ["experiment=paper_comparison"], "0.7"),
            ("paper_comparison with MAP-Elites projecting in every epoch", mapelites, "1.0"),
        ):
            timing, memory = trained(f"{folder}/run", *words, f"epochs={WARM + 20}")
            split = ", ".join(f"{part} {timing[f'{part}_s'].mean():.3f}" for part in PARTS)
            yield f"epoch of {name}, s ({split})", f"{total(timing):.2f}", target
            if name == "paper_coevolution":
                fifty = total(timing)
                yield "  its memory, MiB", f"{memory:.0f}", "1,536"
        timing, memory = trained(f"{folder}/run", *many, f"epochs={WARM + 10}", "record_every=100")
        yield "epoch of 500 members and 250 games, s", f"{total(timing):.2f}", ""
        yield "  times that of 50 members and 25 games", f"{total(timing) / fifty:.1f}", "10"
        yield "  its memory, MiB", f"{memory:.0f}", "6,144"


def side_by_side_rows() -> Iterator[Row]:
    """Two runs at once, each with its default of workers, against one after the other."""
    words = ["experiment=paper_comparison", "epochs=20", *TIMED]
    with tempfile.TemporaryDirectory() as folder:

        def commands() -> list[list[str]]:
            return [[BERTEAM, "train", *words, f"out={folder}/{k}"] for k in range(2)]

        started = time.perf_counter()
        for command in commands():
            subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
        alone = time.perf_counter() - started
        started = time.perf_counter()
        both = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for command in commands()]
        for process in both:
            process.wait()
        together = time.perf_counter() - started
    yield "two runs side by side, times one after the other", f"{together / alone:.2f}", "1.1"


def start_rows() -> Iterator[Row]:
    def quiet(*words: str) -> None:
        subprocess.run([BERTEAM, *words], stdout=subprocess.DEVNULL, check=True)

    yield "berteam --help, s", f"{seconds(lambda: quiet('--help')):.2f}", "0.5"
    with tempfile.TemporaryDirectory() as folder:
        words = ["train", "epochs=0", *TIMED, f"out={folder}/run"]
        yield "berteam train until the first game, s", f"{seconds(lambda: quiet(*words), 3):.1f}", "5"


ROWS = (epoch_rows, side_by_side_rows, start_rows)
