"""Prints how sweeps went, as tables of Markdown: python docs/results/curves.py FOLDER ...

For each quantity a row for each variant, which is all jobs that differ in their seed only, and a column for each look;
of long runs every second look, or third, and so on, so that the columns fit a page. Means over the seeds and their 95 %
intervals by Student's t; of one job alone its figures.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from tables import markdown, spoken, variant_jobs

COLUMNS = 10  # beside the one for the start
OF_CHOICE = "of its choice against the fixed teams"
OF_OWN = "of the training's own games since the look before"
QUANTITIES = {
    f"expected Elo {OF_CHOICE}": 0,
    f"share won {OF_CHOICE}": 2,
    f"share drawn {OF_CHOICE}": 2,
    f"share drawn {OF_OWN}": 3,
    f"grabs a game {OF_OWN}": 2,
}


def of_choice(looks: pd.DataFrame) -> pd.DataFrame:
    """Returns the looks at the selector's choice, all fixed teams together, by epoch."""
    return looks[(looks.opponent == "all") & (looks.who == "choice")].set_index("epoch")


def of_run(folder: Path) -> pd.DataFrame:
    """Returns the quantities of one run, a column each, by the epochs of its looks."""
    choice = of_choice(pd.read_csv(folder / "evaluation.csv"))
    columns = ["epoch", "blue_score", "blue_grabs", "red_grabs"]
    games = pd.read_csv(folder / "games.csv", usecols=columns)
    since = games.groupby(choice.index.to_numpy()[np.searchsorted(choice.index, games.epoch)])
    drawn = since.blue_score.agg(lambda score: (score == 0.5).mean())
    grabs = (since.blue_grabs.sum() + since.red_grabs.sum()) / since.size()
    values = [choice.elo, choice.wins / choice.games, choice.draws / choice.games, drawn, grabs]
    return pd.DataFrame(dict(zip(QUANTITIES, values, strict=True)), index=choice.index)


def shown(epochs: list[int]) -> list[int]:
    """Returns as many of ``epochs`` as fit, evenly and with the last."""
    every = -(-(len(epochs) - 1) // COLUMNS)
    return epochs[:1] + epochs[len(epochs) - 1 : 0 : -every][::-1]


def of_sweep(folder: Path) -> dict[str, pd.DataFrame]:
    """Returns for each quantity its table, of the jobs in ``folder`` that are done."""
    runs = {variant: [of_run(job) for job in jobs] for variant, jobs in variant_jobs(folder).items() if jobs}
    epochs = shown(sorted({epoch for of_variant in runs.values() for run in of_variant for epoch in run.index}))
    tables = {}
    for quantity, digits in QUANTITIES.items():
        rows = []
        for variant, of_variant in runs.items():
            seeds = pd.DataFrame([run[quantity] for run in of_variant]).reindex(columns=epochs)
            values = {str(epoch): spoken(seeds[epoch].to_numpy(), digits) for epoch in epochs}
            rows.append({"variant": f"`{variant}`", "seeds": str(len(seeds))} | values)
        tables[quantity] = pd.DataFrame(rows)
    return tables


if __name__ == "__main__":
    for name in sys.argv[1:]:
        for quantity, table in of_sweep(Path(name)).items():
            print(f"{Path(name).name}: {quantity}\n\n{markdown(table)}\n")
