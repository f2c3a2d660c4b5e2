"""Plays the games of a table of outcomes between teams of fixed policies, and finds those that end otherwise."""

import csv
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.kernel import TIME_OUT, finished
from mctf.play import play_scripted
from mctf.recording import TraceError
from mctf.replaying import FORESEEN
from mctf.rules import Rules, make_rules
from mctf.scripted import NAMES
from mctf.state import CAPTURES, GRABS, TAGS
from mctf.words import did_you_mean

OUTCOMES = (
    "blue_captures",
    "red_captures",
    "blue_grabs",
    "red_grabs",
    "blue_tags",
    "red_tags",
    "steps",
    "truncated",
)
"""Columns behind those of the policies, which are blue_0, blue_1, ... and red_0, red_1, ..."""


class Table(NamedTuple):
    """Recorded outcomes: the line of each game in its file, (G, V) policies as places in ``NAMES``, (G, 8) numbers."""

    lines: list[int]
    policies: NDArray[np.int64]
    recorded: NDArray[np.int64]
    rules: Rules


class Outcomes(NamedTuple):
    """The games of a table, and the (G, 8) numbers that the kernel gives them."""

    table: Table
    computed: NDArray[np.int64]

    @property
    def same(self) -> NDArray[np.bool_]:
        """Whether each game ends as recorded in every number, (G,)."""
        return (self.table.recorded == self.computed).all(axis=1)


def check_table(path: Path) -> Outcomes:
    """Plays every game of a csv file by the standard rules.

    Raises:
        TraceError: the file cannot be read as a table of outcomes.
    """
    table = read_table(path)
    state = play_scripted(table.policies, np.zeros(len(table.policies), np.uint64), table.rules)
    totals = [state.score[:, team, kind] for kind in (CAPTURES, GRABS, TAGS) for team in range(2)]
    timed_out = [finished(state, b, table.rules) == TIME_OUT for b in range(len(table.policies))]
    return Outcomes(table, np.column_stack([*totals, state.steps, np.array(timed_out, np.int64)]))


def read_table(path: Path) -> Table:
    """Returns the games of a csv file.

    Raises:
        TraceError: it is not a whole table of outcomes; the message says why in one sentence.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.reader(file, strict=True)
            header = next(reader, None)
            rows = [(reader.line_num, row) for row in reader if row]
    except OSError as error:
        raise TraceError(f"cannot be read ({error.strerror or error}); it must be a csv table of outcomes.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise TraceError(f"is no csv text ({error}); it must be a csv table of outcomes.") from error
    if header is None:
        raise TraceError("is empty; it must be a csv table of outcomes.")
    sizes = [sum(re.fullmatch(rf"{team}_\d+", name) is not None for name in header) for team in ("blue", "red")]
    places = [f"{team}_{i}" for team, size in zip(("blue", "red"), sizes, strict=True) for i in range(max(size, 1))]
    wanted = [*places, *OUTCOMES]
    if header != wanted:
        raise TraceError(f"has the columns {','.join(header)[:200]!r}; they must be {','.join(wanted)!r}.")
    if not rows:
        raise TraceError("has no games below its columns; it must be a whole csv table of outcomes.")
    for line, row in rows:
        _check_row(line, row, wanted)
    policies = np.array([[NAMES.index(name) for name in row[: len(places)]] for _, row in rows], np.int64)
    recorded = np.array([[int(number) for number in row[len(places) :]] for _, row in rows], np.int64)
    return Table([line for line, _ in rows], policies, recorded, make_rules(team_size=sizes))


def _check_row(line: int, row: list[str], columns: list[str]) -> None:
    if len(row) != len(columns):
        raise TraceError(f"has {len(row)} values in line {line}; there must be {len(columns)}, one for each column.")
    for column, value in zip(columns, row, strict=True):
        if column in OUTCOMES:
            if not re.fullmatch(r"[0-9]{1,9}", value):
                raise TraceError(f"has {value!r} as {column} in line {line}; it must be a whole number >= 0.")
        elif value not in FORESEEN:
            meant = did_you_mean(value, FORESEEN)
            known = ", ".join(FORESEEN)
            raise TraceError(f"has {value!r} as {column} in line {line}; it must be one of {known}.{meant}")
