"""The tables of a report: headline figures of a run, several runs side by side, and a comparison of them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from berteam_cli.command.inspect import narrow, read_table
from berteam_cli.report.source import Source

COMPARISON = "comparison"
COMPARED = {COMPARISON: "Algorithms compared", "versus": "Algorithm against algorithm", "runs": "The runs compared"}
"""Tables of `berteam compare`, and what stands above them."""
EVALUATED = {
    "regression": "Probability on Elo, over all rated teams",
    "composition": "Which kind of team is chosen",
    "calibration": "Tenths of the teams, the most probable first",
    "embeddings": "Cosine between members' embeddings, by group",
}
"""Tables of `berteam evaluate` that are shown as they are, and what stands above them."""
MOST_ROWS = 60


def headline(source: Source) -> dict[str, str]:
    """Returns the figures that sum up a run, by name."""
    facts: dict[str, str] = {"Status": str(source.manifest["status"])}
    if against := source.manifest.get("trained_against"):
        facts["Trained against"] = str(against)
    if source.manifest.get("members_of"):
        facts["Members of"] = str(source.manifest["members_of"])
    summary, timing = source.table("summary"), source.table("timing")
    if summary is not None and not math.isnan(summary.expected_elo[0]):
        row = summary.iloc[0]
        facts["Expected Elo"] = spread(row.expected_elo, row.expected_elo_low, row.expected_elo_high)
    figures = source.evaluated("figures")
    if figures is not None:
        figure: Any  # a row, whose fields are the columns
        for figure in figures.itertuples():
            low, high = getattr(figure, "low", math.nan), getattr(figure, "high", math.nan)
            named = str(figure.quantity).replace("_", " ").capitalize().replace("elo", "Elo")
            facts[named] = spread(figure.value, low, high)
    if source.elo is not None:
        best = source.elo.iloc[0]
        facts["Best team"] = f"{best.team} ({best.members})"
        facts["Its Elo"] = spread(best.elo, best.elo_low, best.elo_high)
    if timing is not None:
        facts["Epochs"] = f"{timing.epoch.max():,}"
    if summary is not None:
        facts |= {"Games": f"{summary.games[0]:,}", "Time": duration(summary.wall_s[0])}
    return facts


def row_of(source: Source) -> dict[str, str]:
    """Returns a run's row in the table of several."""
    chosen = plain(source)
    facts = {"Run": str(source.folder)}
    facts |= {name: str(chosen.get(name.lower(), {}).get("name", "")) for name in ("Selector", "Optimizer", "Env")}
    facts["Seed"] = str(source.manifest.get("seed", ""))
    figures = headline(source)
    facts["Trained against"] = figures.get("Trained against", "its population")
    return facts | {x: figures.get(x, "") for x in ("Status", "Epochs", "Expected Elo", "Best team", "Its Elo", "Time")}


def plain(source: Source) -> dict[str, Any]:
    """Returns the run's config, as far as it can be read."""
    try:
        read = yaml.safe_load(source.config or "")
    except yaml.YAMLError:
        return {}
    return {key: value for key, value in read.items() if isinstance(value, dict)} if isinstance(read, dict) else {}


def is_comparison(folder: Path) -> bool:
    """Returns whether ``folder`` was written by `berteam compare`."""
    return (folder / f"{COMPARISON}.csv").exists()


def compared(folder: Path) -> dict[str, pd.DataFrame]:
    """Returns the tables of a comparison by what stands above them.

    Raises:
        InputError: one cannot be read.
    """
    tables = {said: read_table(folder, name, columns=()) for name, said in COMPARED.items()}
    return {said: narrow(table.head(MOST_ROWS), spread) for said, table in tables.items() if table is not None}


def evaluated(source: Source) -> dict[str, pd.DataFrame]:
    """Returns the tables of a run's evaluation by what stands above them."""
    tables = {said: source.evaluated(name) for name, said in EVALUATED.items()}
    return {said: narrow(x.drop(columns="epoch"), spread) for said, x in tables.items() if x is not None and len(x)}


def spread(value: float, low: float, high: float) -> str:
    """Returns a figure and its interval as they are read."""
    if not isinstance(value, int | float) or math.isnan(value):
        return "unknown" if not isinstance(value, str) else value
    form = ",.0f" if abs(value) >= 100 else ",.3f" if abs(value) >= 0.01 or value == 0 else ".2g"
    if math.isnan(low) or math.isnan(high):
        return f"{value:{form}}"
    return f"{value:{form}} ({low:{form}} to {high:{form}})"


def duration(seconds: float) -> str:
    """Returns a time as it is said."""
    if seconds < 120:
        return f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"


def written(value: Any) -> str:
    """Returns a cell of a table as it is read."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:,.4g}" if abs(value) < 1000 else f"{value:,.0f}"
    return str(value)
