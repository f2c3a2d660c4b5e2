"""Draws how the runs of docs/results.md went: python docs/results/course.py course.png.

From the tables beside this file: the expected Elo of the choice, and what share of its games it wins, over the games
that the training has played. Looks are noisy, so each point is the mean of those since the point before, and points lie
evenly on the logarithmic axis.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from curves import of_choice

HERE = Path(__file__).parent
POINTS = 8  # for each tenfold of games
BEST_PAIR, NO_WIN_NO_LOSS, PAPER = 1352, 965, 930


class Course(NamedTuple):
    """What is drawn as one line.

    Attributes:
        table: the looks.
        job: of a table that holds several runs; None where it holds one.
        games_per_epoch: of the training.
        color: of the line.
        label: in the legend; lines without one are of the same kind as the labelled one before.
    """

    table: str
    job: int | None
    games_per_epoch: int
    color: str
    label: str | None


COURSES = (
    Course("night/16/evaluation.csv", None, 32, "tab:red", "strong (six seeds)"),
    *(Course(f"strong/{seed}/evaluation.csv", None, 32, "tab:red", None) for seed in (17, 18, 19, 20, 21)),
    Course("hour/6/evaluation.csv", None, 32, "tab:orange", "strong_past: no exploiters (five seeds)"),
    *(Course(f"strong_past/{seed}/evaluation.csv", None, 32, "tab:orange", None) for seed in (7, 8, 9, 10)),
    Course("paper_whole_looks.csv", 0, 25, "black", "paper_coevolution"),
    Course("paper_whole_looks.csv", 3, 16, "tab:blue", "paper_comparison, coevolution, BERTeam"),
    Course("paper_whole_looks.csv", 15, 16, "tab:purple", "the same, BERTeam, nobody cloned"),
    Course("paper_whole_looks.csv", 6, 16, "tab:cyan", "paper_comparison, coevolution, MCAA"),
    Course("paper_whole_looks.csv", 9, 16, "tab:green", "paper_comparison, MAP-Elites, BERTeam"),
    Course("paper_whole_looks.csv", 12, 16, "tab:olive", "paper_comparison, MAP-Elites, MCAA"),
)


def looks(table: pd.DataFrame, job: int | None) -> pd.DataFrame:
    """Returns the looks at the choice of one run, all fixed teams together, by epoch."""
    return of_choice(table if job is None else table[table.job == job])


def smoothed(choice: pd.DataFrame, games_per_epoch: int) -> pd.DataFrame:
    """Returns games, elo and won: means of the looks between points that are even on a logarithmic axis."""
    values = pd.DataFrame(
        {
            "games": choice.index * games_per_epoch,
            "elo": choice.elo.to_numpy(),
            "won": (choice.wins / choice.games).to_numpy(),
        }
    )
    values = values[values.games > 0]  # a logarithm has no place for the start
    return values.groupby(np.floor(POINTS * np.log10(values.games))).mean()


def draw(picture: Path) -> None:
    """Draws all courses, and the strengths to compare them with."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5), layout="constrained")
    for course in COURSES:
        choice = looks(pd.read_csv(HERE / course.table), course.job)
        points = smoothed(choice, course.games_per_epoch)
        for axes, what in ((left, "elo"), (right, "won")):
            axes.plot(points.games, points[what], color=course.color, label=course.label if axes is left else None)
    lines = ((BEST_PAIR, "best scripted pair"), (NO_WIN_NO_LOSS, "all games drawn"), (PAPER, "the paper, whole"))
    for elo, said in lines:
        left.axhline(elo, color="0.6", linestyle=":", linewidth=1)
        left.text(
            1.0, elo, said, transform=left.get_yaxis_transform(), ha="right", va="bottom", fontsize=8, color="0.4"
        )
    for axes in (left, right):
        axes.set(xscale="log", xlabel="games played in training")
    left.set_ylabel("expected Elo of the choice")
    left.set_title("How strong those are that the selector chooses")
    right.set_title("What share of their games against the fixed teams they win")
    figure.legend(loc="outside lower center", fontsize=8, ncols=4, frameon=False)
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
