"""What somebody in front of a terminal sees, and what a pipe gets."""

import json
import os
import re
import signal
import subprocess

import pytest

from tests.command.conftest import BERTEAM
from tests.command.terminals import berteam_on

RPS = ["train", "env=rps", "population=ppo6", "selector=mcaa", "learner.n_steps=16", "learner.minibatch_size=8"]
RPS += [
    "optimizer.protect_new=2",
    "optimizer.fitness=elo",
    "optimizer.member_k=1",
    "record_every=2",
    "evaluation.games=100",
    "workers=1",
]
PLAIN = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "evaluation.games=100"]
COLOR = re.compile(rb"\x1b\[(?:\d+;)*[34]\d(?:;\d+)*m")
NAMES = ["epoch", "games", "time left", "best Elo", "effective teams", "favourite team", "replacements"]


@pytest.fixture
def terminal(tmp_path):
    """Starts berteam on a terminal."""
    started = []

    def start(*words, **settings):
        started.append(berteam_on(tmp_path, *words, **settings))
        return started[-1]

    yield start
    for one in started:
        one.close()


def test_a_live_view_that_leaves_no_trace_and_changes_nothing(terminal, process, tmp_path):
    there = terminal(*RPS, "epochs=60", "out=shown")
    assert there.end() == 0, there.text
    views = [sight for sight in there.seen if all(name in sight for name in NAMES)]
    assert "epoch  0 of 60" in views[0]
    assert re.search(r"time left +-\n", re.sub(" +\n", "\n", views[0]))
    assert any(re.search(r"epoch +[1-9]\d* of 60", view) for view in views)
    known = views[-1]
    assert re.search(r"best Elo +-?[\d,]+ \(main\.\d\)", known)
    assert re.search(r"effective teams +\d+\.\d \(epoch \d+\)", known)
    assert re.search(r"favourite team +\d-\d \(0\.\d{3}\)", known)
    assert re.search(r"replacements +[1-9]", known)
    # Log lines stand above it, each once, and no pace, which the view shows
    lines = there.lines
    assert lines[0] == "shown"
    assert there.text.count("Memory: ") == 1
    assert "epochs of 16 games: about" not in there.text
    # At the end nothing of it is there, and the cursor is back
    assert not any(line.startswith(("epoch  ", "time left", "favourite team")) for line in lines)
    assert not there.screen.cursor.hidden
    assert COLOR.search(there.written)
    assert there.text.endswith("Next: berteam evaluate shown")

    # In a pipe: plain lines, and the same bytes in the tables
    done = process(*RPS, "epochs=60", "out=piped")
    assert "\x1b" not in done.stdout + done.stderr
    assert done.stdout.splitlines()[0] == "piped"
    assert "60 epochs of 16 games: about" in done.stdout
    for table in (tmp_path / "piped").glob("*.csv"):
        if table.stem not in {"timing", "summary"}:
            assert table.read_bytes() == (tmp_path / "shown" / table.name).read_bytes(), table.name
    log = (tmp_path / "shown" / "log.txt").read_text()
    assert "60 epochs of 16 games: about" in log
    assert "\x1b" not in log


@pytest.mark.parametrize("columns", [40, 200])
def test_narrow_and_wide_and_without_colors(columns, terminal):
    there = terminal(*RPS, "epochs=4", f"out=w{columns}", columns=columns, NO_COLOR="1")
    assert there.end() == 0, there.text
    view = next(sight for sight in there.seen if all(name in sight for name in NAMES))
    rows = [line for line in view.splitlines() if any(f"{name}  " in line for name in NAMES[1:])]
    assert len(rows) == (6 if columns == 40 else 3)
    assert not COLOR.search(there.written)
    assert not any(line.startswith(("time left", "replacements")) for line in there.lines)
    assert not there.screen.cursor.hidden


def test_a_terminal_that_cannot_go_back_gets_lines(terminal):
    there = terminal(*PLAIN, "epochs=4", "out=run", TERM="dumb")
    assert there.end() == 0, there.text
    assert b"\x1b" not in there.written
    assert "epoch 4 of 4" in there.text
    assert "effective teams" not in there.text


def test_ctrl_c_leaves_a_clean_terminal(terminal, tmp_path):
    there = terminal(*RPS, "epochs=100000", "out=run")
    there.until("replacements")
    there.type("\x03")
    assert there.end() == 130
    assert "Stopping after this epoch" in there.text
    assert "Interrupted. Go on with: berteam resume run" in there.text
    assert not there.screen.cursor.hidden
    assert "favourite team" not in there.text
    assert json.loads((tmp_path / "run" / "manifest.json").read_text())["status"] == "interrupted"


def test_a_run_under_nohup_outlives_its_terminal(tmp_path):
    there = berteam_on(tmp_path, *PLAIN, "epochs=300", "out=run", ignored=[signal.SIGHUP])
    there.until("replacements")
    os.close(there.master)
    assert there.process.wait(timeout=120) == 0
    assert json.loads((tmp_path / "run" / "manifest.json").read_text())["status"] == "done"
    assert (tmp_path / "run" / "summary.csv").exists()


def test_a_run_outlives_the_reader_of_its_pipe(tmp_path):
    command = [BERTEAM, *PLAIN, "epochs=20", "out=run"]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert run.stdout.readline() == "run\n"
    run.stdout.close()
    assert run.stderr.read() == ""
    assert run.wait(timeout=60) == 0
    assert json.loads((tmp_path / "run" / "manifest.json").read_text())["status"] == "done"


def test_quiet(process, tmp_path):
    assert process("-q", *PLAIN, "epochs=2", "out=run").stdout == "run\n"
    assert (tmp_path / "run" / "elo.csv").exists()
    refused = process("train", "--quiet", "env=rsp", code=2)
    assert refused.stdout == ""
    assert refused.stderr.startswith("berteam: env must be one of")
    assert process("list", "-q").stdout == ""
    assert process("train", "-q", "--help").stdout.startswith("berteam train: one run")
