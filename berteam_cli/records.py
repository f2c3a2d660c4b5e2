"""The tables of a run: their columns, and how they are written.

Columns are a contract with whoever reads them: they are only ever added, at the end. docs/csv.md tells what each means.
"""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from berteam_cli.errors import RunError, shown
from berteam_cli.learner.base import LEARNING_FIGURES
from berteam_cli.outcomes import Ints

COLUMNS: dict[str, tuple[str, ...]] = {
    "elo": (
        *("team", "members", "elo", "elo_low", "elo_high", "games", "wins", "draws", "losses"),
        *("probability", "rank", "predicted_elo", "predicted_rank", "rank_low", "rank_high"),
    ),
    "agents": (
        *("epoch", "agent", "name", "island", "algorithm", "fitness", "age", "games", "captain_games", "parent"),
        *("aggression", "learning_rate", "entropy_coef", "gamma", "reward_factors", "advance", "spread"),
    ),
    "team_distribution": ("epoch", "team", "probability", "error"),
    "side_distribution": ("epoch", "side", "team", "probability", "error"),
    "captain_distribution": ("epoch", "agent", "probability"),
    "island_distribution": ("epoch", "island", "probability"),
    "games": (
        *("epoch", "game", "blue", "red", "blue_captain", "red_captain", "blue_score", "red_score", "steps"),
        *("blue_captures", "red_captures", "blue_grabs", "red_grabs", "blue_tags", "red_tags", "seed"),
        *("blue_wall_hits", "red_wall_hits"),
    ),
    "sides": ("epoch", "game", "side", "team", "captain", "score"),
    "generations": (
        *("epoch", "island", "removed", "parent", "removed_fitness", "parent_fitness", "removed_age", "reason"),
        "second_parent",
    ),
    "learning": ("epoch", "agent", "algorithm", *LEARNING_FIGURES),
    "selector": ("epoch", "loss", "updates", "buffer", "effective_teams", "entropy", "exploitability", "skipped"),
    "timing": (
        *("epoch", "select_s", "play_s", "learn_s", "renew_s", "selector_s", "record_s", "env_steps", "probe_s"),
        "evaluate_s",
    ),
    "summary": (
        *("expected_elo", "expected_elo_low", "expected_elo_high", "best_team", "best_elo"),
        *("games", "env_steps", "wall_s", "peak_rss_mib"),
    ),
    "pairs": (
        *("team", "opponent", "games", "wins", "draws", "losses", "side", "superiority"),
        *("log_ratio", "decision"),
    ),
    "online_elo": ("team", "elo"),
    "crosstable": ("team",),  # and a column for each team
    "cycles": ("cycle", "weakest_score", "weakest_low"),
    "strategies": (
        *("team", "members", "alpha_rank", "alpha_rank_low", "alpha_rank_high", "nash", "nash_low", "nash_high"),
    ),
    "comparison": (
        *("algorithm", "seeds", "expected_elo", "expected_elo_low", "expected_elo_high"),
        *("mixed_elo", "mixed_elo_low", "mixed_elo_high", "epoch_s", "update_s", "iqm", "iqm_low", "iqm_high"),
    ),
    "runs": (
        *("algorithm", "seed", "run", "epochs", "expected_elo", "expected_elo_low", "expected_elo_high"),
        *("mixed_elo", "mixed_elo_low", "mixed_elo_high", "epoch_s", "update_s"),
    ),
    "versus": (
        *("algorithm", "opponent", "games", "wins", "draws", "losses", "score", "score_low", "score_high"),
        *("superiority", "improvement", "improvement_low", "improvement_high"),
    ),
    "paper": ("quantity", "paper", "here", "low", "high", "source"),
    "reference_points": (
        *("epoch", "team", "members", "probability", "fixed_point", "replicator", "nash"),
        *("against_mix", "worst", "most_lost"),
    ),
    "conditioning": ("epoch", "choice", "elo", "elo_low", "elo_high"),
    "encounters": ("epoch", "opponent", "encounters", "score_before", "score_after"),
    "members": (
        *("epoch", "agent", "name", "island", "aggression", "aggression_low", "aggression_high"),
        *("tags", "times_tagged", "captures", "grabs", "wall_hits", "group", "games"),
    ),
    "teams": ("epoch", "team", "aggression", "kind", "games"),
    "composition": ("epoch", "kind", "teams", "probability"),
    "regression": ("epoch", "quantity", "value", "low", "high"),
    "figures": ("epoch", "quantity", "value", "low", "high", "team"),
    "calibration": ("epoch", "decile", "teams", "predicted_elo", "elo", "low", "high"),
    "embeddings": ("epoch", "group", "members", "pairs", "cosine", "above_all"),
    "archive": ("epoch", "island", "cells", "occupied", "coverage", "qd_score", "best_fitness"),
    "archive_cells": ("epoch", "island", "cell", "aggression", "advance", "spread", "member", "fitness"),
    "neighbours": ("epoch", "agent", "name", "rank", "neighbour", "neighbour_name", "cosine"),
    "evaluation": (
        *("epoch", "who", "opponent", "games", "wins", "draws", "losses"),
        *("captures", "grabs", "tags", "wall_hits", "opponent_captures", "opponent_grabs", "opponent_tags", "steps"),
        *("elo", "elo_low", "elo_high", "members"),
    ),
    "opponents": (
        *("epoch", "kind", "opponent", "taken_epoch", "games", "wins", "draws", "losses", "chance", "estimate"),
    ),
}
GROWING = (
    *("agents", "team_distribution", "captain_distribution", "island_distribution"),
    *("games", "generations", "learning", "selector", "timing"),
)
"""Tables that get rows in every epoch, or in every recorded one."""
SIDES_TABLE = "sides"  # grows too, in games of more than two sides, whose row in "games" has no room for all
OPPONENTS_TABLE = "opponents"  # grows too, where others than the population's teams are met
BY_SIDE_TABLE = "side_distribution"  # grows too, where a team's chance depends on the side it plays
WATCHED_TABLE = "evaluation"  # grows too, where the run is looked at while it goes on (evaluate_every)
ARCHIVE_TABLES = ("archive", "archive_cells")  # grow too, where optimizer.archive keeps members apart
EVALUATION = "evaluation"
"""The folder in a run's, where `berteam evaluate` writes."""
SHEETS = ("played", "members", "replayed", "payoffs", "encounters")
"""Files there, without endings, that keep games until the tables are written."""
SHEET_ENDINGS = (".games", ".json")


def team_name(team: Iterable[int]) -> str:
    """Returns a team as the tables write it: its members in ascending order, joined by hyphens."""
    return "-".join(str(member) for member in sorted(int(m) for m in team))


def team_names(teams: Ints) -> list[str]:
    """Returns the names of (K, T) teams."""
    return [team_name(team) for team in teams]


FORMULA = re.compile(r"(?:^|(?<=;))[=+@-]")
"""Where a formula begins: in the first sign of a cell, and for those who split lines at semicolons behind one."""


def cell(value: Any) -> Any:
    """Returns ``value`` as it is written: floats so that they read back equal, nothing where there is no number.

    Text in which a spreadsheet would see a formula gets an apostrophe, which makes it text there, too.
    """
    if isinstance(value, float):  # numpy's floats are floats too
        return "" if math.isnan(value) else repr(float(value))
    if isinstance(value, str):
        return FORMULA.sub(r"'\g<0>", shown(value))
    return value


class Tables:
    """The growing tables of one run folder, open for appending."""

    def __init__(self, folder: Path, sizes: dict[str, int] | None = None, also: Sequence[str] = ()) -> None:
        """Opens the tables.

        Args:
            folder: of the run.
            sizes: bytes of each table to keep, from a checkpoint; None starts them anew.
            also: tables that grow in this run, beside GROWING.

        Raises:
            RunError: a table has fewer bytes than that.
        """
        self.files = {}
        for name in (*GROWING, *also):
            path = folder / f"{name}.csv"
            if sizes is None:
                path.write_text(",".join(COLUMNS[name]) + "\n", encoding="utf-8")
            else:
                if not path.exists() or path.stat().st_size < sizes[name]:
                    raise RunError(f"{path} is shorter than when the last checkpoint was made; the run cannot go on.")
                os.truncate(path, sizes[name])
            self.files[name] = path.open("a", encoding="utf-8", newline="")

    def add(self, name: str, rows: Iterable[Sequence[Any]]) -> None:
        """Appends ``rows`` to table ``name``; they are in the file when this returns."""
        csv.writer(self.files[name], lineterminator="\n").writerows([cell(v) for v in row] for row in rows)
        self.files[name].flush()

    def rows(self, name: str) -> int:
        """Returns how many rows table ``name`` has."""
        with Path(self.files[name].name).open("rb") as file:
            return sum(1 for _ in file) - 1

    def sizes(self) -> dict[str, int]:
        """Returns the bytes of each table, all of which are on the disk then."""
        for file in self.files.values():
            os.fsync(file.fileno())
        return {name: file.tell() for name, file in self.files.items()}

    def close(self) -> None:
        """Closes the files."""
        for file in self.files.values():
            file.close()


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Writes a whole table; there is never half of one under ``path``."""
    part = path.with_suffix(".part")
    with part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([cell(v) for v in row] for row in rows)
    os.replace(part, path)
