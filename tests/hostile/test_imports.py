"""Code that a config names, and modules that lie where one stands."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.command.conftest import BERTEAM
from tests.hostile.conftest import FEW, MARK, READERS, RUNS, changed, refused


@pytest.mark.parametrize("command", READERS)
def test_what_a_run_imports_must_be_named_on_the_command_line(command, run, berteam):
    folder = run("sailors")
    run("sailors", "other")
    changed(folder, "reward: custom_rew2", "reward: strange:pay")
    Path("strange.py").write_text(f"open({MARK!r}, 'w')\ndef pay(terms, before, after):\n    return 1.0\n")
    if command == "inspect":  # it needs no more than the tables, unless a selector is to be searched
        with (folder / "team_distribution.csv").open("a") as table:
            table.write("1,other,0.1,\n")
    before = sorted(Path().rglob("*"))
    words = READERS[command](str(folder))
    assert "add trust=strange:pay to the command" in refused(berteam(*words, code=2))
    assert "add trust=strange:pay to the command" in refused(berteam(*words, "trust=other:pay", code=2))
    assert sorted(Path().rglob("*")) == before
    if command in {"resume", "inspect"}:
        berteam(*words, "trust=strange:pay")
        assert Path(MARK).exists()
        sys.modules.pop("strange")


def test_a_report_says_what_it_did_not_import(run, berteam):
    folder = run("learners")
    changed(folder, "name: rps", "name: pettingzoo\n  target: subprocess:getoutput\n  options: {cmd: 'touch it_ran'}")
    changed(folder, "  sides: 2\n", "  teams: {}\n  max_steps: 9\n  score: reward\n")
    berteam("report", str(folder))
    assert "add trust=subprocess:getoutput to the command" in (folder / "report" / "report.html").read_text()
    assert "add trust=" in refused(berteam("evaluate", str(folder), code=2))
    assert "trust must be module:function" in refused(berteam("evaluate", str(folder), "trust=subprocess", code=2))


def test_going_on_with_ones_own_words_needs_no_trust(run, berteam):
    changed(run("sailors"), "reward: custom_rew2", "reward: earned:pay")
    Path("earned.py").write_text("def pay(terms, before, after):\n    return 1.0\n")
    berteam("train", *RUNS["sailors"], "env.reward=earned:pay", "out=run", "on_exists=resume", "epochs=2")


def test_figures_go_to_no_address_that_a_folder_names(run, berteam):
    folder = run("hands")
    changed(folder, "name: csv", "name: mlflow\n  experiment: x\n  tracking: http://203.0.113.1")
    said = refused(berteam("resume", str(folder), "epochs=2", code=2))
    assert "add logger.tracking=http://203.0.113.1 to the command, else logger=csv" in said


def test_modules_in_the_folder_one_stands_in_hide_nothing(run, tmp_path):
    folder = tmp_path / run("hands")
    for name in (
        "wandb",
        "mlflow",
        "sb3_contrib",
        "numexpr",
        "bottleneck",
        "pyarrow",
        "IPython",
        "sitecustomize",
        "rps",
    ):
        (folder / f"{name}.py").write_text(f"open({MARK!r}, 'w')\nraise ImportError\n")
    for name in ("json", "numpy", "mctf"):
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(f"open({MARK!r}, 'w')\n")
    done = subprocess.run([BERTEAM, "evaluate", ".", *FEW], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert not (folder / MARK).exists()
