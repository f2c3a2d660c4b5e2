"""Speed: figures beside targets, and ratios taken in the same run. `make bench` prints the table.

Nothing here is asserted: the machines are shared, and a test that fails when somebody else compiles is no test.
"""

from __future__ import annotations

import platform

import torch
from rich.console import Console
from rich.table import Table

from berteam_cli.workers import available_cores
from tests.bench import (
    cluster,
    evaluating,
    games,
    keeping,
    learning,
    reporting,
    selecting,
    starting,
    sweeping,
    training,
)


def main() -> None:
    table = Table(
        title=f"{platform.processor() or platform.machine()}, {available_cores()} cores; torch {torch.__version__}"
    )
    for column in ("what", "here", "target"):
        table.add_column(column, justify="left" if column == "what" else "right")
    torch.set_num_threads(1)
    measured = (starting, games, evaluating, cluster, learning, selecting, training, keeping, sweeping, reporting)
    for rows in (rows for module in measured for rows in module.ROWS):
        for row in rows():
            table.add_row(*row)
            print(*row, sep=" | ", flush=True)
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
