"""The real command, in a temporary folder."""

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from berteam_cli import cli

BERTEAM = Path(sys.executable).with_name("berteam")

TINY = ["env.max_time_s=30", "epochs=4", "games_per_epoch=4", "record_every=2", "checkpoint_every=2"]
SMALL_BERTEAM = ["selector.width=16", "selector.layers=1", "selector.heads=2", "selector.train_every=2"]


@pytest.fixture
def berteam(tmp_path, monkeypatch, capsys):
    """Runs ``berteam`` with the given words in this process, which saves its start; returns what it printed.

    It must end with the exit code, or with one of them.
    """
    monkeypatch.chdir(tmp_path)

    def run(*words, code=0):
        monkeypatch.setattr(sys, "argv", ["berteam", *words])
        ended = 0
        try:
            cli.main()
        except SystemExit as stopped:
            ended = stopped.code
        said = capsys.readouterr()
        assert ended in np.atleast_1d(code), f"{words}: exit {ended}\n{said.out}\n{said.err}"
        return SimpleNamespace(stdout=said.out, stderr=said.err)

    return run


@pytest.fixture
def process(tmp_path):
    """Runs ``berteam`` as a process of its own; returns it, finished."""

    def run(*words, code=0):
        done = subprocess.run(
            [str(BERTEAM), *words], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
        )
        assert done.returncode == code, f"{words}: exit {done.returncode}\n{done.stdout}\n{done.stderr}"
        return done

    return run
