"""The real command, in a temporary folder."""

import subprocess
import sys
from pathlib import Path

import pytest

BERTEAM = Path(sys.executable).with_name("berteam")

TINY = ["env.max_time_s=30", "epochs=4", "games_per_epoch=4", "record_every=2", "checkpoint_every=2"]
SMALL_BERTEAM = ["selector.width=16", "selector.layers=1", "selector.heads=2", "selector.train_every=2"]


@pytest.fixture
def berteam(tmp_path):
    """Runs ``berteam`` with the given words; returns the finished process."""

    def run(*words, code=0, folder=tmp_path):
        done = subprocess.run(
            [str(BERTEAM), *words], cwd=folder, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == code, f"{words}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done

    return run
