"""Compares selectors on the same populations: python docs/results/selection.py FOLDER.

FOLDER is of a sweep whose jobs differ in `selector` and `population.run`, as of selection.yaml. Prints each expected
Elo, and the mean differences over the populations with 95 % intervals by Student's t.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import pandas as pd
from tables import markdown, spoken

from berteam_cli.sweep.folder import Sweep


def expected(folder: Path) -> pd.DataFrame:
    """Returns the expected Elo of each selector (columns) on each population (rows), of the jobs that are done."""
    sweep = Sweep.read(folder)
    rows = []
    for job, words in sweep.jobs.items():
        said = dict(word.split("=", 1) for word in words)
        if sweep.status(job)[0] == "done":
            elo = pd.read_csv(folder / str(job) / "summary.csv").expected_elo.iloc[0]
            rows.append((said["population.run"], said["selector"], elo))
    table = pd.DataFrame(rows, columns=["population", "selector", "elo"])
    return table.pivot(index="population", columns="selector", values="elo")


def compared(elos: pd.DataFrame) -> str:
    """Returns both tables as Markdown."""
    shown = elos.round(0).astype(int).astype(str).reset_index()
    differences = [
        [f"{a} - {b}", str(len(elos)), spoken((elos[a] - elos[b]).to_numpy())]
        for a, b in itertools.combinations(elos.columns, 2)
    ]
    of_pairs = pd.DataFrame(differences, columns=["selectors", "populations", "difference of expected Elo"])
    return f"{markdown(shown)}\n\n{markdown(of_pairs)}\n"


if __name__ == "__main__":
    print(compared(expected(Path(sys.argv[1]))))
