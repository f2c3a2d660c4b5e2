"""The paper's numbers beside ours: what it reports of each experiment, and where ours stand in the tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from berteam_cli.command.inspect import read_table
from berteam_cli.rating.bootstrap import Interval
from berteam_cli.records import EVALUATION, cell


@dataclass(frozen=True)
class Reproduced:
    """Folders of an experiment that was run again.

    Attributes:
        runs: of each algorithm, (optimizer, selector), one folder a seed.
        tournament: of the fixed teams, where there is one.
        comparison: of the algorithms, where there is one.
    """

    runs: dict[tuple[str, str], list[Path]]
    tournament: Path
    comparison: Path


def rows(experiment: str, found: Reproduced) -> list[tuple[Any, ...]]:
    """Returns the rows of paper.csv: quantity, the paper's number, ours, its 95 % interval, where the paper has it.

    Args:
        experiment: paper_fixed, paper_coevolution or paper_comparison.
        found: where ours are.
    """
    text = files("berteam_cli.evaluation").joinpath("paper.csv").read_text(encoding="utf-8")
    lines = [line.split(",") for line in text.splitlines()[1:]]
    measure = {"paper_fixed": fixed, "paper_coevolution": coevolved, "paper_comparison": compared}[experiment]
    of = {name: (float(number), source) for x, name, number, source in lines if x == experiment}
    return [(name, number, *measure(name, found), source) for name, (number, source) in of.items()]


def over_seeds(runs: list[Path], value: Callable[[Path], Interval]) -> Interval:
    """Returns the mean of a figure of ``runs`` and its 95 % interval by Student's t; of a single one, what it has."""
    each = [value(run) for run in runs]
    if len(each) == 1:
        return each[0]
    values = np.array([x[0] for x in each])
    width = stdtrit(len(values) - 1, 0.975) * values.std(ddof=1) / math.sqrt(len(values))
    return float(values.mean()), float(values.mean() - width), float(values.mean() + width)


def fixed(quantity: str, found: Reproduced) -> Interval:
    """Returns a figure of the first experiment: Elos of the tournament, shares as BERTeam learnt them."""
    kind, _, name = quantity.partition(" of ")
    runs = next(iter(found.runs.values()))
    elos = table(found.tournament, "elo").set_index("team")
    if kind == "Elo":
        return interval_of(cast("pd.Series[Any]", elos.loc[name]), ("elo", "elo_low", "elo_high"))
    teams = list(elos.index[:7]) if name == "the seven best teams" else [name]
    return over_seeds(runs, lambda run: (float(chances(run).reindex(teams).sum()), math.nan, math.nan))


def chances(run: Path) -> pd.Series:
    """Returns the chance of each team that a run learnt, by name."""
    learned = table(run, "team_distribution")
    return learned[learned.epoch == learned.epoch.max()].set_index("team").probability


def coevolved(quantity: str, found: Reproduced) -> Interval:
    """Returns a figure of the second experiment, from the runs' evaluations."""
    runs = next(iter(found.runs.values()))
    head, _, name = quantity.partition(" of ")
    if quantity.endswith("members"):
        group = quantity.removesuffix(" members")
        return over_seeds(runs, lambda run: exact((table(run / EVALUATION, "members").group == group).sum()))
    if head == "share":
        kind = name.removesuffix(" teams")
        return over_seeds(runs, lambda run: exact(entry(run, "composition", "kind", kind).probability))
    if head == "cosine":
        return over_seeds(runs, lambda run: exact(entry(run, "embeddings", "group", name).cosine))
    place, key = {
        "best Elo": ("figures", "best_elo_replayed"),
        "expected Elo": ("figures", "expected_elo"),
        "R^2 of probability on Elo": ("regression", "r_squared"),
    }[quantity]
    return over_seeds(runs, lambda run: interval_of(entry(run, place, "quantity", key), ("value", "low", "high")))


def compared(quantity: str, found: Reproduced) -> Interval:
    """Returns a figure of the third experiment, from the comparison."""
    kind, _, pair = quantity.partition(" of ")
    optimizer, selector = pair.split(" and ")
    ours = table(found.comparison, "comparison").set_index("algorithm")
    of = table(found.comparison, "runs").set_index("run").algorithm
    row = ours.loc[of[cell(str(found.runs[optimizer, selector][0]))]]
    if kind == "Elo":
        return interval_of(row, ("mixed_elo", "mixed_elo_low", "mixed_elo_high"))
    return exact(row.epoch_s if kind == "seconds an epoch" else row.update_s)


def interval_of(row: pd.Series, columns: tuple[str, str, str]) -> Interval:
    """Returns three columns of a table's row."""
    value, low, high = (float(row[column]) for column in columns)
    return value, low, high


def exact(value: float) -> Interval:
    """Returns a figure that comes without an interval."""
    return float(value), math.nan, math.nan


def table(folder: Path, name: str) -> pd.DataFrame:
    """Returns a table that must be there."""
    found = read_table(folder, name)
    assert found is not None, f"{folder} has no {name}.csv"
    return found


def entry(run: Path, name: str, column: str, value: str) -> pd.Series:
    """Returns the row of an evaluation's table in which ``column`` is ``value``; nothing but NaN without such a row."""
    found = table(run / EVALUATION, name).set_index(column)
    row = found.loc[value] if value in found.index else pd.Series(math.nan, index=found.columns)
    return cast("pd.Series[Any]", row)
