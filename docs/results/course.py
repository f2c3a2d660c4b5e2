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
BEST_PAIR, NO_WIN_NO_LOSS, PAPER = 1352, 993, 930


class Course(NamedTuple):
    """What is drawn as one line.

    Attributes:
        table: the looks.
        variant: of a table that holds several, of which each seed is a line; None where it holds one run.
        games_per_epoch: of the training.
        color: of the line.
        label: in the legend; lines without one are of the same kind as the labelled one before.
    """

    table: str
    variant: str | None
    games_per_epoch: int
    color: str
    label: str | None


OF_THE_PAPER = (
    ("paper_coevolution selector=berteam optimizer=coevolution", 25, "black", "paper_coevolution"),
    ("paper_comparison selector=berteam optimizer=coevolution", 16, "tab:blue", "comparison, BERTeam, coevolution"),
    (
        "paper_comparison selector=berteam optimizer=coevolution optimizer.replacements=0",
        *(16, "tab:purple", "comparison, BERTeam, nobody cloned"),
    ),
    ("paper_comparison selector=mcaa optimizer=coevolution", 16, "tab:cyan", "comparison, MCAA, coevolution"),
    ("paper_comparison selector=berteam optimizer=mapelites", 16, "tab:green", "comparison, BERTeam, MAP-Elites"),
    ("paper_comparison selector=mcaa optimizer=mapelites", 16, "tab:olive", "comparison, MCAA, MAP-Elites"),
)
COURSES = (
    Course("night/16/evaluation.csv", None, 32, "tab:red", "strong (eleven seeds)"),
    *(Course(f"strong/{seed}/evaluation.csv", None, 32, "tab:red", None) for seed in range(17, 27)),
    Course("hour/6/evaluation.csv", None, 32, "tab:orange", "strong_past: no exploiters (five seeds)"),
    *(Course(f"strong_past/{seed}/evaluation.csv", None, 32, "tab:orange", None) for seed in (7, 8, 9, 10)),
    *(Course("paper_whole_looks.csv", f"experiment={words}", *drawn) for words, *drawn in OF_THE_PAPER),
)


def lines(table: pd.DataFrame, variant: str | None) -> list[pd.DataFrame]:
    """Returns for each run of a variant the looks at its choice, all fixed teams together, by epoch."""
    if variant is None:
        return [of_choice(table)]
    return [of_choice(run) for _, run in table[table.variant == variant].groupby("seed")]


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
        for seed, choice in enumerate(lines(pd.read_csv(HERE / course.table), course.variant)):
            points, label = smoothed(choice, course.games_per_epoch), None if seed else course.label
            left.plot(points.games, points.elo, color=course.color, label=label)
            right.plot(points.games, points.won, color=course.color)
    strengths = (
        (BEST_PAIR, "best scripted pair"),
        (NO_WIN_NO_LOSS, "all games drawn"),
        (PAPER, "the paper, whole (on its scale)"),
    )
    for elo, said in strengths:
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
