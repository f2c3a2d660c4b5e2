"""What a report of a long run takes."""

from __future__ import annotations

import contextlib
import io
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from tests.long_run import long_run

EPOCHS = 8000


def long_report():
    from berteam_cli.cli import run  # noqa: PLC0415

    with TemporaryDirectory() as place:
        folder = Path(place) / "run"
        long_run(folder, EPOCHS)
        started = time.perf_counter()
        with contextlib.redirect_stdout(io.StringIO()), patch("sys.argv", ["berteam", "report", str(folder)]):
            run("report", [str(folder)])
        seconds = time.perf_counter() - started
        size = (folder / "report" / "report.html").stat().st_size / 1e6
    yield (f"report of {EPOCHS} epochs, 1,275 teams, 50 members", f"{seconds:.1f} s, {size:.1f} MB", "15 s, 8 MB")


ROWS = (long_report,)
