"""Prints what sweeps came to, as tables of Markdown: python docs/results/tables.py FOLDER ...

A row for each variant, which is all jobs that differ in their seed only: means over the seeds and their 95 % intervals
by Student's t; of one job alone its figures. Results are of the selector's choice against the fixed teams. The best
team's Elo is that of fresh games, by `berteam evaluate` of the last epoch. Where not all seeds have a figure, it is
told how many do.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd
from scipy.stats import t as student

from berteam_cli.sweep.folder import Sweep

LAST = 0.2  # of the epochs: what "at the end" means for games of the training
HEAD = (
    *("variant", "seeds", "expected Elo", "best team", "best member", "highest expected on the way"),
    *("won", "drawn", "lost", "own games decided", "first capture"),
)
AS_IT_IS = "as it is"  # the variant that says nothing of its own
SHARES = ("won", "drawn", "lost", "own games decided")


def spoken(values: npt.NDArray[np.float64], digits: int = 0) -> str:
    """Returns mean and 95 % half width of one value of each seed."""
    values = values[np.isfinite(values)]
    if len(values) == 0:
        return ""
    if len(values) == 1:
        return f"{values[0]:.{digits}f}"
    width = float(student.ppf(0.975, len(values) - 1)) * values.std(ddof=1) / math.sqrt(len(values))
    return f"{values.mean():.{digits}f} ± {width:.{digits}f}"


def of_job(folder: Path) -> dict[str, float]:
    """Returns the figures of one run."""
    looks = pd.read_csv(folder / "evaluation.csv")
    totals = looks[looks.opponent == "all"].set_index(["who", "epoch"])
    choice, last = totals.loc["choice"], int(looks.epoch.max())
    games = pd.read_csv(folder / "games.csv", usecols=["epoch", "blue_score", "blue_captures", "red_captures"])
    late = games[games.epoch > (1 - LAST) * games.epoch.max()]
    captured = games.epoch[(games.blue_captures + games.red_captures) > 0]
    summary = pd.read_csv(folder / "summary.csv").iloc[0]
    end = choice.loc[last]
    return {
        "expected Elo": end.elo if math.isnan(summary.expected_elo) else summary.expected_elo,
        "best team": replayed(folder, last),
        "best member": totals.loc[("best_member", last), "elo"],
        "highest expected on the way": choice.elo.max(),
        "won": end.wins / end.games,
        "drawn": end.draws / end.games,
        "lost": end.losses / end.games,
        "own games decided": float((late.blue_score != 0.5).mean()),
        "first capture": float(captured.min()) if len(captured) else math.nan,
    }


def replayed(folder: Path, epoch: int) -> float:
    """Returns the Elo of the best rated team from games that did not choose it; NaN if not after ``epoch``."""
    path = folder / "evaluation" / "figures.csv"
    if not path.exists():
        return math.nan
    figure = pd.read_csv(path).set_index("quantity").loc["best_elo_replayed"]
    return float(figure.value) if figure.epoch == epoch else math.nan


def variant_jobs(folder: Path) -> dict[str, list[Path]]:
    """Returns for each variant the folders of its jobs that are done.

    A variant is named by what it says that most jobs do not; by all that it says where another has that name.
    """
    sweep = Sweep.read(folder)
    said = Counter(word for words in sweep.jobs.values() for word in words)
    names: dict[tuple[str, ...], str] = {}
    found: dict[str, list[Path]] = {}
    for job, words in sweep.jobs.items():
        variant = tuple(x for x in words if not x.startswith("seed="))
        if variant not in names:
            name = " ".join(x for x in variant if said[x] <= len(sweep.jobs) / 2) or AS_IT_IS
            names[variant] = (" ".join(variant) or "nothing said") if name in found else name
        of_variant = found.setdefault(names[variant], [])
        if sweep.status(job)[0] == "done":
            of_variant.append(folder / str(job))
    return found


def variants(folder: Path) -> dict[str, pd.DataFrame]:
    """Returns for each variant the figures of its jobs that are done."""
    figures = {variant: [of_job(job) for job in jobs] for variant, jobs in variant_jobs(folder).items()}
    return {variant: pd.DataFrame(rows, columns=list(HEAD[2:]), dtype=float) for variant, rows in figures.items()}


def of_sweep(folder: Path) -> pd.DataFrame:
    """Returns one row a variant of all jobs in ``folder`` that are done."""
    rows = []
    for variant, figures in variants(folder).items():
        said = [spoken(figures[x].to_numpy(), 2 if x in SHARES else 0) for x in figures]
        have = figures.notna().sum()
        said = [f"{x} ({n} of {len(figures)})" if 0 < n < len(figures) else x for x, n in zip(said, have, strict=True)]
        rows.append([f"`{variant}`", str(len(figures)), *said])
    return pd.DataFrame(rows, columns=list(HEAD))


def markdown(table: pd.DataFrame) -> str:
    """Returns a table as Markdown, whose cells hold no bars."""
    lines = [list(table.columns), ["---"] * len(table.columns), *table.to_numpy().tolist()]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(f"{Path(name).name}\n\n{markdown(of_sweep(Path(name)))}\n")
