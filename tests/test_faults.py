"""A few of each fault, another few with every seed; `make faults` tries many."""

import re
import subprocess
import sys
from pathlib import Path

FAULTS = 11


def test_runs_survive_a_few_of_each_fault():
    words = [sys.executable, "-m", "tests.faults", "short", "seed=1"]
    done = subprocess.run(
        words, cwd=Path(__file__).parents[1], capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.findall(r"survived (\d+) of (\d+)", done.stdout)
    assert len(found) + done.stdout.count("not to be had here") == FAULTS
    assert all(survived == tried != "0" for survived, tried in found)
    assert len(found) >= FAULTS - 1  # a full disk needs the right to mount one
