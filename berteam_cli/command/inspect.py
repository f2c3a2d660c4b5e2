"""berteam inspect: the tables of a run in the terminal."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from rich.console import Console
from rich.table import Table

from berteam_cli.errors import InputError
from berteam_cli.folder import read_manifest
from berteam_cli.records import COLUMNS

WHOLE = {"team": str, "blue": str, "red": str, "best_team": str, "opponent": str}  # 3 is a team, not a number


def read_table(folder: Path, name: str) -> pd.DataFrame | None:
    """Returns table ``name`` of the run in ``folder``, None if it has none.

    Raises:
        InputError: the file is no such table.
    """
    path = folder / f"{name}.csv"
    if not path.exists():
        return None
    try:
        table = pd.read_csv(path, dtype=WHOLE)
    except (ValueError, OSError) as error:
        raise InputError(f"{path} cannot be read as a table: {error}.") from error
    absent = [column for column in COLUMNS[name] if column not in table.columns]
    if absent:
        raise InputError(f"{path} is no table of this version: it has no column {absent[0]}.")
    return table


def show(folder: Path, top: int) -> None:
    """Prints what came of the run in ``folder``: figures, strongest teams, most probable teams, members.

    Args:
        folder: of a run, or of a sweep, whose table is printed.
        top: rows of each table.

    Raises:
        InputError: there is no run, or a table cannot be read.
    """
    console = Console(width=None if Console().is_terminal else 120)
    if (folder / "sweep.csv").exists():
        shown = ["job", "overrides", "status", "expected_elo", "best_team", "best_elo", "wall_s"]
        console.print(printed(f"Sweep {folder}", pd.read_csv(folder / "sweep.csv", dtype=WHOLE)[shown]))
        return
    manifest = read_manifest(folder)
    console.print(f"{folder}: {manifest['status']}, started {manifest['started']}", highlight=False)
    tables = {name: read_table(folder, name) for name in ("summary", "elo", "team_distribution", "agents", "pairs")}
    summary, elo, teams, agents = (tables[x] for x in ("summary", "elo", "team_distribution", "agents"))
    if summary is not None and len(summary):
        console.print(printed("Figures", summary.T.reset_index().set_axis(["figure", "value"], axis=1)))
    if elo is not None and len(elo):
        shown = ["rank", "team", "members", "elo", "elo_low", "elo_high", "wins", "draws", "losses", "probability"]
        console.print(printed(f"Strongest of {len(elo)} rated teams", elo[shown].head(top)))
    if teams is not None and len(teams):
        last = teams[teams.epoch == teams.epoch.max()].sort_values("probability", ascending=False, kind="stable")
        console.print(printed(f"Most probable teams after epoch {last.epoch.iloc[0]}", last.iloc[:top, 1:]))
    if agents is not None and len(agents):
        last = agents[agents.epoch == agents.epoch.max()].sort_values("fitness", ascending=False, kind="stable")
        console.print(printed(f"Fittest members after epoch {last.epoch.iloc[0]}", last.iloc[:top, 1:]))
    files = sorted(path.name for path in folder.iterdir() if path.suffix in {".csv", ".json", ".yaml", ".txt"})
    console.print(f"Files in {folder}: {', '.join(files)}", highlight=False)
    console.print(f"See them again with: berteam inspect {folder}", highlight=False)


def printed(title: str, frame: pd.DataFrame) -> Table:
    """Returns ``frame`` as a table for the terminal."""
    table = Table(title=title, title_justify="left")
    for column in frame.columns:
        table.add_column(str(column), justify="left" if column in {"members", "team", "name", "figure"} else "right")
    for row in frame.itertuples(index=False):
        table.add_row(*(text(value) for value in row))
    return table


def text(value: object) -> str:
    """Returns a value as it is read."""
    if isinstance(value, float):
        if pd.isna(value):
            return ""
        return f"{value:.4f}" if abs(value) < 10 else f"{value:,.1f}"
    return str(value)
