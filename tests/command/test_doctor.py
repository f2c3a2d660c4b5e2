"""berteam doctor, where all is well and where much is not."""

import json
import os
import subprocess
import sys

import pytest

from berteam_cli.health import machine
from tests.command.conftest import BERTEAM

SUBJECTS = [
    "python",
    "packages",
    "extras",
    "cores",
    "threads",
    "device",
    "kernels",
    "memory",
    "disk",
    "outputs",
    "text",
]


def test_all_is_well(berteam, tmp_path):
    lines = berteam("doctor").stdout.splitlines()
    assert [subject for subject in SUBJECTS if any(line.split()[1] == subject for line in lines)] == SUBJECTS
    assert {line.split()[0] for line in lines} <= {"ok", "note"}
    assert any(line.startswith("ok       packages  torch ") for line in lines)
    assert any(" steps in " in line and " ms" in line for line in lines)
    found = json.loads(berteam("doctor", "--json").stdout)
    assert [(x["status"], x["subject"]) for x in found] == [tuple(line.split()[:2]) for line in lines]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="nobody can write into /proc, but it is on Linux alone")
def test_what_is_wrong_is_told_with_what_to_do(tmp_path):
    made = tmp_path / "omegaconf-2.4.0.dist-info"
    made.mkdir()
    (made / "METADATA").write_text("Metadata-Version: 2.1\nName: omegaconf\nVersion: 2.4.0\n")
    (tmp_path / "pettingzoo.py").write_text("raise RuntimeError('built for another machine')\n")
    wrong = {"PYTHONPATH": str(tmp_path), "OMP_NUM_THREADS": "many", "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [BERTEAM, "doctor"],
        cwd="/proc",
        env=os.environ | wrong | {"PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3, done.stdout + done.stderr
    said = {" ".join(line.split()) for line in done.stdout.splitlines()}
    assert "problem packages omegaconf is 2.4.0, but must be <2.4,>=2.3; pip install 'omegaconf<2.4,>=2.3'" in said
    assert any(x.startswith("problem packages pettingzoo cannot be imported: RuntimeError: built for an") for x in said)
    assert "note threads OMP_NUM_THREADS=many is no number of threads; unset it" in said
    assert "problem kernels NUMBA_DISABLE_JIT makes games hundreds of times slower; unset it" in said
    assert any(x.startswith("problem outputs /proc cannot be written: ") for x in said)
    assert any(x.startswith("note text ascii") for x in said)
    assert done.stderr.endswith("berteam: Not all is well: packages, kernels, disk, outputs.\n")


@pytest.mark.parametrize(
    ("text", "cores"), [("150000 100000\n", 1.5), ("max 100000\n", float("inf")), ("", float("inf"))]
)
def test_the_limit_of_a_container(text, cores, tmp_path, monkeypatch):
    (tmp_path / "cpu.max").write_text(text)
    monkeypatch.setattr(machine, "QUOTA", tmp_path / "cpu.max")
    assert machine.quota() == cores
    finding = next(machine.cores())
    assert ("say workers=1" in str(finding)) == (cores < 2)


@pytest.mark.parametrize("word", ["train", "compare", "replay", "inspect"])
def test_help_needs_nothing_slow(word):
    program = (
        f"import sys; sys.argv = ['berteam', {word!r}, '--help']\n"
        "from berteam_cli.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "print(*sorted({'torch', 'hydra', 'omegaconf', 'numpy', 'rich', 'numba'} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr == "\n"
    assert f"berteam {word}" in done.stdout
