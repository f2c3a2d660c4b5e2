"""berteam inspect: the tables of a run in the terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
from pandas.api.types import is_numeric_dtype
from rich.markup import escape
from rich.table import Table

from berteam_cli.errors import InputError, shown
from berteam_cli.folder import evaluated_at, newest, read_manifest
from berteam_cli.holding import in_use
from berteam_cli.records import COLUMNS
from berteam_cli.terminal import berteam, console, end, say
from berteam_cli.trust import told

WHOLE = {"team": str, "blue": str, "red": str, "best_team": str, "opponent": str}  # 3 is a team, not a number
TEXT = {
    *(*WHOLE, "members", "name", "island", "algorithm", "side", "reason", "cycle", "decision", "run", "quantity"),
    *("source", "choice", "kind", "group", "neighbour_name", "who", "reward_factors"),
}
"""Columns of words; all others are numbers."""


def read_table(
    folder: Path, name: str, columns: Sequence[str] | None = None, *, whole: bool = True
) -> pd.DataFrame | None:
    """Returns table ``name`` of the run in ``folder``, None if it has none.

    Args:
        folder: of the run.
        name: of the table.
        columns: that it must have; None: all that this version writes.
        whole: whether a last line that is cut off is an error; else it is left away, as while a run goes on.

    Raises:
        InputError: the file is no such table, or is cut off.
    """
    path = folder / f"{name}.csv"
    if not path.exists():
        return None
    try:
        text = path.read_bytes()
        end = whole_lines(text)
        if end < len(text) and whole:
            line = text.count(b"\n", 0, end) + 1
            raise InputError(f"{path} is cut off in the middle of line {line}; have it written anew.")
        if not end and not whole:  # not even its columns are there yet
            return None
        table = pd.read_csv(io.BytesIO(text[:end]), dtype=WHOLE)
    except (ValueError, OSError) as error:
        raise InputError(f"{path} cannot be read as a table: {error}.") from error
    absent = [column for column in (COLUMNS[name] if columns is None else columns) if column not in table.columns]
    if absent:
        raise InputError(f"{path} is no table of this version: it has no column {absent[0]}.")
    for column in (x for x in COLUMNS[name] if x in table.columns and x not in TEXT and len(table)):
        if not is_numeric_dtype(table[column]):
            raise InputError(f"{path} is no table of this version: in its column {column} are not only numbers.")
    return table


def whole_lines(text: bytes) -> int:
    """Returns how many bytes of a table are whole lines: its last must have an end and as many cells as its first."""
    if not text.endswith(b"\n"):
        return text.rfind(b"\n") + 1
    begin = text.rfind(b"\n", 0, len(text) - 1) + 1
    first, last = (
        next(csv.reader([line.decode(errors="replace")]), []) for line in (text.partition(b"\n")[0], text[begin:])
    )
    return begin if len(last) < len(first) and b'"' not in text[begin:] else len(text)


def inspect(folder: Path, top: int, overrides: Sequence[str] = ()) -> None:
    """Prints the tables of a run, and where its distribution over teams is only sampled, what a search finds.

    Args:
        folder: of a run, or of a sweep, whose table is printed.
        top: rows of each table.
        overrides: ``trust=module:function``.

    Raises:
        InputError: there is no run, or a table cannot be read.
        RunError: it has no whole checkpoint to search.
    """
    trust, others = told(overrides)
    if others:
        raise InputError(f"{others[0]} is no key of berteam inspect; there is trust=module:function, and --top.")
    show(folder, top)
    teams = read_table(folder, "team_distribution", whole=False)  # show has told if it must be
    if teams is not None and (teams.team == "other").any() and (folder / "checkpoint").exists():
        console().print(searched(folder, top, trust))


def searched(folder: Path, top: int, trust: Sequence[str]) -> Table:
    """Returns the most probable teams that a search in the last checkpoint of a run finds.

    Raises:
        InputError: the run is of another version.
        RunError: it has no whole checkpoint.
    """
    from berteam_cli import build, checkpoint  # noqa: PLC0415 (torch is not needed for tables)
    from berteam_cli.config import checked  # noqa: PLC0415
    from berteam_cli.records import team_names  # noqa: PLC0415
    from berteam_cli.stored import stored_config  # noqa: PLC0415
    from berteam_cli.training import RECORDS, generator  # noqa: PLC0415

    parts = build.parts_to_read(checked(stored_config(folder, trust)), folder)
    run = checkpoint.load(folder, parts).run
    found = parts.selector.likeliest(run.selection, top, generator(parts.seed, RECORDS, run.epoch))
    errors = [0.0] * len(found.teams) if found.error is None else found.error
    columns = {"team": team_names(found.teams), "probability": found.probability, "error": errors}
    frame = pd.DataFrame(columns).sort_values("probability", ascending=False, kind="stable")
    return printed(f"Most probable teams that a beam search finds after epoch {run.epoch}", frame)


def show(folder: Path, top: int) -> None:
    """Prints what came of the run in ``folder``: figures, strongest teams, most probable teams, members.

    Args:
        folder: of a run, or of a sweep, whose table is printed.
        top: rows of each table.

    Raises:
        InputError: there is no run, or a table cannot be read.
    """
    out = console()
    if (folder / "sweep.csv").exists():
        columns = ["job", "overrides", "status", "expected_elo", "best_team", "best_elo", "wall_s"]
        try:
            table = pd.read_csv(folder / "sweep.csv", dtype=WHOLE)[columns]
        except (OSError, ValueError, KeyError) as error:
            raise InputError(f"{folder / 'sweep.csv'} cannot be read as the table of a sweep: {error}.") from error
        out.print(printed(f"Sweep {folder}", table))
        end(folder, ["sweep.csv"], f"{berteam('compare', [folder])}/*/")
        return
    manifest = read_manifest(folder)
    status = "broken off" if manifest["status"] == "running" and not in_use(folder) else manifest["status"]
    say(f"{folder}: {status}, started {manifest['started']}")
    names = ("summary", "elo", "team_distribution", "agents", "pairs")
    tables = {name: read_table(folder, name, whole=manifest["status"] == "done") for name in names}
    summary, elo, teams, agents = (tables[x] for x in ("summary", "elo", "team_distribution", "agents"))
    if summary is not None and len(summary):
        out.print(printed("Figures", summary.T.reset_index().set_axis(["figure", "value"], axis=1)))
    if elo is not None and len(elo):
        ranked = ["rank", "team", "members", "elo", "elo_low", "elo_high", "wins", "draws", "losses", "probability"]
        out.print(printed(f"Strongest of {len(elo)} rated teams", elo[ranked].head(top)))
    if teams is not None and len(teams):
        last = teams[teams.epoch == teams.epoch.max()].sort_values("probability", ascending=False, kind="stable")
        out.print(printed(f"Most probable teams after epoch {last.epoch.iloc[0]}", last.iloc[:top, 1:]))
    if agents is not None and len(agents):
        last = agents[agents.epoch == agents.epoch.max()].sort_values("fitness", ascending=False, kind="stable")
        members = last.loc[:, "agent":"aggression"].head(top)
        out.print(printed(f"Fittest members after epoch {last.epoch.iloc[0]}", members))
    files = sorted(path.name for path in folder.iterdir() if path.suffix in {".csv", ".json", ".yaml", ".txt"})
    end(folder, files, *next_commands(folder, manifest["status"]))


def next_commands(folder: Path, status: str) -> list[str]:
    """Returns what to do next with a folder of that ``status``."""
    epoch = newest(folder)
    if status == "done":
        return [berteam("report" if epoch in {-1, evaluated_at(folder)} else "evaluate", [folder])]
    return [berteam("inspect" if epoch < 0 or in_use(folder) else "resume", [folder])]


def printed(title: str, frame: pd.DataFrame) -> Table:
    """Returns ``frame`` as a table for the terminal."""
    table = Table(title=plain(title), title_justify="left")
    for column in frame.columns:
        table.add_column(plain(column), justify="left" if column in {"members", "team", "name", "figure"} else "right")
    for row in frame.itertuples(index=False):
        table.add_row(*(plain(text(value)) for value in row))
    return table


def plain(value: object) -> str:
    """Returns a text from a file or a name so that the terminal and rich show it and obey nothing in it."""
    return escape(shown(str(value)))


def text(value: object) -> str:
    """Returns a value as it is read."""
    if isinstance(value, float):
        if pd.isna(value):
            return ""
        return (
            f"{value:,.1f}"
            if abs(value) >= 10
            else f"{value:.4f}"
            if abs(value) >= 1e-3 or not value
            else f"{value:.2e}"
        )
    return str(value)


def spoken(value: float, low: float, high: float) -> str:
    """Returns a figure with its interval, as far as they are known."""
    if math.isnan(value):
        return ""
    digits = 0 if abs(value) >= 100 else 3
    known = "" if math.isnan(low) else f" [{low:.{digits}f}, {high:.{digits}f}]"
    return f"{value:.{digits}f}{known}"


def narrow(table: pd.DataFrame, told: Callable[[float, float, float], str] = spoken) -> pd.DataFrame:
    """Returns ``table`` with each figure and its interval in one column, as ``told`` says them.

    An interval without a name is of the column ``value``, or where there is none of ``elo``.
    """
    narrowed = table.copy()
    for low in [x for x in table.columns if x == "low" or x.endswith("_low")]:
        name = low.removesuffix("_low") if low != "low" else "value" if "value" in table.columns else "elo"
        ends = [name, low, low.removesuffix("low") + "high"]
        if not set(ends) <= set(table.columns):  # another version's
            continue
        narrowed[name] = [told(*row) for row in table[ends].astype(float).itertuples(index=False)]
        narrowed = narrowed.drop(columns=ends[1:])
    return narrowed
