"""The examples of docs/extending.md, taken from it and run as it says, in a copy of this tree."""

import os
import shlex
import shutil
import subprocess
import sys

import pandas as pd
import pytest

from tests.docs.pages import ROOT, blocks

PAGE = ROOT / "docs" / "extending.md"
SECTIONS = ("A game", "A selector", "An optimizer")
PROGRAM = """
import shlex, sys
import mctf.cache
import pytest
mctf.cache.forget_stale = lambda *folders: None  # the examples change no compiled function
from berteam_cli import build, cli
assert build.__file__.startswith(sys.argv[1]), build.__file__
for line in sys.argv[2:]:
    words = shlex.split(line)
    if words[0] == "pytest":
        assert pytest.main(["-p", "no:cacheprovider", *words[1:]]) == 0, line
        continue
    sys.argv = words
    try:
        cli.main()
    except SystemExit as ended:
        assert not ended.code, line
"""


def added(text, lines):
    """Returns ``text`` with the lines that begin with + put behind those before them, which must be there once."""
    here = None
    for line in lines:
        if line.startswith("+"):
            text = text[:here] + line[1:] + "\n" + text[here:]
            here += len(line)
        else:
            before = line[1:] + "\n"
            assert text.count(before) == 1, f"{before!r} is there {text.count(before)} times"
            here = text.index(before) + len(before)
    return text


def placed(block, folder):
    """Writes a block of the page to the file that it names, below ``folder``; returns whether it names one."""
    first, *rest = block.lines
    if block.language == "diff":
        path = folder / first.removeprefix("--- ")
        path.write_text(added(path.read_text(), rest))
    elif block.file:
        path = folder / block.file
        assert not path.exists()
        path.write_text("\n".join(rest) + "\n")
    return bool(block.file) or block.language == "diff"


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """A copy of the tree with all examples in it, and where its packages can be imported from, as if installed."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("berteam_cli", "conf", "envs", "tests", "pyproject.toml"):
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    assert sum(placed(block, folder) for block in blocks(PAGE) if block.section != "A game") == 12
    packages = folder / "installed"
    packages.mkdir()
    (packages / "berteam_cli").symlink_to(folder / "berteam_cli")
    (folder / "berteam_cli" / "conf").symlink_to(folder / "conf")
    for game in ("mctf", "rps"):
        (packages / game).symlink_to(folder / "envs" / game)
    return folder


def test_the_examples_are_short():
    for section in SECTIONS:
        files = [b for b in blocks(PAGE) if b.section == section and b.language in ("python", "yaml", "diff")]
        lines = [x for b in files if "# tests/" not in b.lines[0] for x in b.lines[1:] if x.strip() not in ("", "+")]
        assert 0 < len(lines) < 60, (section, len(lines))


def test_the_examples_are_well_formed(clone):
    for command in (["check"], ["format", "--check"]):
        new = ["berteam_cli", "tests/selector/test_recent.py", "tests/optimizer/test_ageing.py"]
        ruff = [sys.executable, "-m", "ruff", *command, "--no-cache", *new]
        done = subprocess.run(ruff, cwd=clone, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout


def trainings(section):
    """Returns the command lines of a section that train."""
    lines = [line for block in blocks(PAGE) if block.section == section for line in block.commands]
    return [line for line in lines if line.startswith("berteam train ")]


def test_the_game_is_played(berteam, tmp_path):
    assert sum(placed(block, tmp_path) for block in blocks(PAGE) if block.section == "A game") == 1
    (line,) = trainings("A game")
    berteam(*shlex.split(line)[1:], "epochs=20", "evaluation.games=0", "out=run")
    assert (pd.read_csv(tmp_path / "run" / "games.csv").steps == 12).all()
    assert (pd.read_csv(tmp_path / "run" / "learning.csv").updates > 0).any()


def test_the_selector_and_the_optimizer_run(clone):
    """With the page's command lines, and with the tests that stand there."""
    lines = [line for section in SECTIONS[1:] for line in trainings(section)]
    lines = [f"{line} evaluation.games=0 out=run{k}" for k, line in enumerate(lines)]
    assert len(lines) == 2
    tests = "pytest tests/selector/test_recent.py tests/optimizer/test_ageing.py"
    environment = {**os.environ, "PYTHONPATH": str(clone / "installed")}
    command = [sys.executable, "-c", PROGRAM, str(clone), tests, *lines]
    done = subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    assert "2 passed" in done.stdout
    assert pd.read_csv(clone / "run0" / "selector.csv").buffer.max() == 50
    assert set(pd.read_csv(clone / "run1" / "generations.csv").reason) == {"age"}
