"""What those who work on the package rely on: ``make help`` tells of every target, and commits are checked."""

import re
import subprocess
import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).parent.parent


def test_make_help_tells_what_every_target_does():
    rules = (ROOT / "Makefile").read_text()
    targets = re.findall(r"^([\w-]+):(?!=)", rules, re.M)
    (listed,) = re.findall(r"^\.PHONY: (.*)$", rules, re.M)
    assert sorted(targets) == sorted(listed.split())

    told = subprocess.run(
        ["make", "--no-print-directory", "help"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    lines = dict(line.split(maxsplit=1) for line in told.stdout.splitlines())
    assert list(lines) == targets


def test_make_help_knows_digits_and_hyphens(tmp_path):
    rules = (ROOT / "Makefile").read_text()
    (tmp_path / "Makefile").write_text(rules + "\nbench-2v2: setup ## games of two against two\n")
    told = subprocess.run(["make", "help"], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert re.search(r"^bench-2v2 +games of two against two$", told, re.M)


def test_the_hooks_of_commits_are_what_make_lint_runs():
    config = ROOT / ".pre-commit-config.yaml"
    subprocess.run([sys.executable, "-m", "pre_commit", "validate-config", config], check=True)
    (lint,) = re.findall(r"^lint:.*\n((?:\t.*\n)+)", (ROOT / "Makefile").read_text(), re.M)
    made = re.findall(r"^\t\$\(BIN\)/(\w+(?: check| format)?)", lint, re.M)
    hooks = [hook for repo in yaml.safe_load(config.read_text())["repos"] for hook in repo["hooks"]]
    assert {hook["language"] for hook in hooks} == {"system"}  # others would be fetched
    assert [hook["entry"].removeprefix(".venv/bin/").removesuffix(" --force-exclude") for hook in hooks] == made
