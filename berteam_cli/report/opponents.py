"""Plots of the games against opponents beyond the population."""

from __future__ import annotations

import numpy as np
import pandas as pd

from berteam_cli.outcomes import Floats
from berteam_cli.report.drawing import SERIES, Plot, drawn, panels
from berteam_cli.report.source import Source

AGES = 8
"""Most ages that are told apart."""


def past(source: Source) -> Plot | None:
    """Returns how the population fared against its past, by how long ago that was; None where it met none."""
    table = source.table("opponents")
    if table is None or not (table.kind == "past").any():
        return None
    name, title = "past", "Against its own past"
    ages = by_age(table[table.kind == "past"])
    score, error = ages.score.to_numpy(float), ages.error.to_numpy(float)
    figure, (plot,) = panels(height_in=3.0)
    plot.errorbar(ages.age, score, 1.96 * error, fmt="o-", color=SERIES[0], capsize=3, linewidth=1.3)
    plot.axhline(0.5, color=SERIES[1], linewidth=1, linestyle=":")
    plot.set(xlabel="age of the past members (epochs)", ylabel="score of the population", ylim=(0, 1))
    says = (
        f"{ages.games.sum():,.0f} games of chosen teams against frozen members, over the whole run; bars are 95 % "
        "intervals as if games were alike. Who learns and forgets nothing scores more the older they are; a score that "
        "falls with age is of a population that goes in circles. Which of them are met may depend on how hard they are."
    )
    ends = f"{score[0]:.2f} against the youngest and {score[-1]:.2f} against the oldest"
    return drawn(figure, name, title, says, f"Score by age of {len(ages)} groups: {ends}.")


def by_age(table: pd.DataFrame) -> pd.DataFrame:
    """Returns games against the past in at most AGES groups of alike many rows, by age in epochs.

    The columns are age (mean over games), games, score (a draw counts half) and error (its standard error).
    """
    ages = (table.epoch - table.taken_epoch).to_numpy(float)
    groups = np.searchsorted(edges(ages), ages, side="right")
    sums = (
        pd.DataFrame(
            {
                "games": table.games,
                "aged": ages * table.games,
                "points": table.wins + table.draws / 2,
                "squares": table.wins + table.draws / 4,
            }
        )
        .groupby(groups)
        .sum()
    )
    score = sums.points / sums.games
    spread = np.sqrt((sums.squares / sums.games - score**2).clip(lower=0) / sums.games)
    return pd.DataFrame({"age": sums.aged / sums.games, "games": sums.games, "score": score, "error": spread})


def edges(ages: Floats) -> Floats:
    """Returns the ages at which groups begin, from the second on."""
    return np.unique(np.quantile(ages, np.arange(1, AGES) / AGES))
