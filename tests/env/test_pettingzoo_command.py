"""The real command with environments of the user's own: what it writes, refuses and leaves behind."""

import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

from berteam_cli import cli
from tests.command.test_train import UNTIMED, read
from tests.env import games_for_tests

BERTEAM = Path(sys.executable).with_name("berteam")


@pytest.fixture
def berteam(tmp_path, monkeypatch, capsys):
    """Runs ``berteam train env=pettingzoo`` or another command where own.py lies; returns its exit code and errors."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(games_for_tests.__file__, tmp_path / "own.py")

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["berteam", *words])
        code = 0
        try:
            cli.main()
        except SystemExit as stopped:
            code = stopped.code
        return code, capsys.readouterr().err

    return run


RUN = ["train", "env=pettingzoo", "env.target=own:Contest", "env.options.team_size=2", "env.options.lives.left_0=3"]
SMALL = ["population=ppo6", "games_per_epoch=4", "evaluation.games=8", "epochs=2", "record_every=1", "on_exists=resume"]
PPO = ["learner.n_steps=16", "learner.minibatch_size=8", "selector=uniform"]
DQN = ["learner=dqn", "learner.learning_starts=4", "selector=mcaa", "optimizer=mapelites", "optimizer.opponents=[]"]


def test_train_resume_and_tournament(berteam, tmp_path):
    for workers in (1, 2):
        assert berteam(*RUN, *SMALL, *PPO, f"workers={workers}", f"out=w{workers}")[0] == 0
    assert berteam(*RUN, *SMALL, *PPO, "out=parts", "epochs=1")[0] == 0
    assert berteam("resume", "parts", "epochs=2", "trust=own:Contest")[0] == 0
    for name in UNTIMED:
        whole = (tmp_path / "w1" / f"{name}.csv").read_bytes()
        assert whole == (tmp_path / "w2" / f"{name}.csv").read_bytes(), name
        assert whole == (tmp_path / "parts" / f"{name}.csv").read_bytes(), name
    learning, games = (read(tmp_path / "w1", name) for name in ("learning", "games"))
    assert (games.steps == 6).all()
    assert learning.steps.sum() == 8 * (3 + 3 * 6)  # one of four dies after three steps
    assert (learning.updates > 0).any()
    assert len(read(tmp_path / "w1", "elo")) > 0
    assert berteam("tournament", "run=w1", "trust=own:Contest", "out=t", "top=3", "games_per_pair=2")[0] == 0
    assert len(pd.read_csv(tmp_path / "t" / "games.csv")) == 6


def test_the_other_learner_and_the_other_methods(berteam, tmp_path):
    assert berteam(*RUN, *SMALL, *DQN, "optimizer.protect_new=0", "out=run")[0] == 0
    learning = read(tmp_path / "run", "learning")
    assert (learning.algorithm == "dqn").all()
    assert learning.steps.sum() == 8 * (3 + 3 * 6)
    assert (learning.updates > 0).any()
    assert (read(tmp_path / "run", "agents").query("epoch == 2").aggression.dropna() == 1).all()  # no events


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "env.target must be the MODULE:FUNCTION of an environment, such as mctf:parallel_env, but is null"),
        (["env.target=own"], "env.target must be the MODULE:FUNCTION.*but is own"),
        (
            ["env.target=owm:Contest"],
            "env.target=owm:Contest: module owm cannot be imported, .* included: Mod",
        ),
        (["env.target=own:contest"], "module own has no function 'contest'. Did you mean Contest?"),
        (["env.target=own:Contest", "env.options.size=1"], r"fails with env.options={'size': 1}: TypeError: Contest"),
        (["env.target=own:nothing"], "env.target must return a ParallelEnv, but own:nothing returns SimpleNamespace"),
        (["env.target=own:InTurn"], "returns InTurn. pettingzoo.utils.aec_to_parallel makes one of it"),
        (["env.target=own:Contest"], "env.target has teams of 1, but team_size is 2; say team_size=1"),
        (["env.target=own:Contest", "env.score=goals"], "env.score must be reward, or info:KEY .* but is 'goals'"),
        (["env.target=own:Contest", "env.teams.blue=[left_0]"], "env.teams must be {blue: "),
    ],
)
def test_what_is_refused_before_anything_is_written(words, said, berteam, tmp_path):
    code, error = berteam("train", "env=pettingzoo", "population=ppo6", *words, "out=run")
    assert code == 2
    assert error.count("\n") == 1
    assert re.search(said, error), error
    assert not (tmp_path / "run").exists()


def test_a_run_whose_environment_fails_says_where(berteam, tmp_path):
    words = ["train", "env=pettingzoo", "env.target=own:Faulty", "env.options.fault=raise", "team_size=1"]
    code, error = berteam(*words, *SMALL, "out=run")
    assert code == 3
    assert "game 0, of seed" in error
    assert "KeyError: 'the ball is gone' (own.py, line" in error
    assert "Traceback" in (tmp_path / "run" / "log.txt").read_text()


def begun(tmp_path, *words):
    """Returns a run in a process of its own, whose group is its own as in a terminal."""
    shutil.copy(games_for_tests.__file__, tmp_path / "own.py")
    command = [BERTEAM, *RUN[:2], *SMALL, "team_size=1", "out=run", *words]
    return subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True, start_new_session=True)


def interrupt(run):
    """Does what Ctrl-C in a terminal does."""
    os.killpg(run.pid, signal.SIGINT)


def test_ctrl_c_ends_a_run_after_its_epoch(tmp_path):
    run = begun(tmp_path, "env.target=own:Contest", "epochs=1000000", "workers=2")
    table = tmp_path / "run" / "games.csv"
    while not (table.exists() and table.stat().st_size > 500):
        assert run.poll() is None
        time.sleep(0.05)
    interrupt(run)
    said, _ = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "Interrupted. Go on with: berteam resume run" in said
    assert len(read(tmp_path / "run", "games")) % 4 == 0


@pytest.mark.parametrize(("workers", "ending"), [(1, signal.SIGINT), (2, signal.SIGINT), (2, signal.SIGKILL)])
def test_no_process_is_left_behind(workers, ending, tmp_path):
    """Ctrl-C twice, or a killed run: in the midst of a step without end, in which a process of its own waits."""
    mark = tmp_path / "mark"
    words = ["env.target=own:Faulty", "env.options.fault=sleep", f"env.options.mark={mark}", f"workers={workers}"]
    run = begun(tmp_path, *words)
    while not mark.exists() or mark.read_text().count("made") <= workers:  # the first one only looked at it
        assert run.poll() is None
        time.sleep(0.05)
    time.sleep(1)
    if ending == signal.SIGKILL:
        run.kill()
    else:
        interrupt(run)
        time.sleep(1)
        interrupt(run)
    assert run.wait(60) == (130 if ending == signal.SIGINT else -signal.SIGKILL)
    run.communicate(timeout=60)  # its output ends when nobody can write to it any more
    with mark.open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # granted as all of them are gone
