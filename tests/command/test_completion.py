"""Tab, in the shells themselves."""

import os
import shutil
import subprocess
import sys

import pytest
from hydra import initialize_config_module

from berteam_cli import catalogue
from berteam_cli.compose import CONF, choices, composed, keys, prepare
from berteam_cli.overrides import parsed
from tests.command.conftest import BERTEAM
from tests.command.terminals import Terminal

PATH = f"{BERTEAM.parent}{os.pathsep}{os.environ['PATH']}"


def needs(shell):
    return pytest.mark.skipif(shutil.which(shell) is None, reason=f"{shell} is not installed")


@pytest.fixture
def folder(tmp_path):
    """Two runs below outputs/train/, and a folder that is none."""
    for name in ("one", "two"):
        (tmp_path / "outputs" / "train" / name).mkdir(parents=True)
        (tmp_path / "outputs" / "train" / name / "manifest.json").touch()
    (tmp_path / "other").mkdir()
    return tmp_path


LINES = {
    "berteam tr": {"train"},
    "berteam comp": {"compare", "completion"},
    "berteam train sel": {"selector=", "selector."},
    "berteam train selector=m": {"selector=mcaa"},
    "berteam train -m selector=mcaa,u": {"selector=mcaa,uniform"},
    "berteam train selector=mcaa selector.to": {"selector.top_fraction="},
    "berteam train population=mixed4x3 population.islands.d": {
        "population.islands.dqn64.",
        "population.islands.defenders.",
    },
    "berteam train experiment=unknown_opponent selector.obs": {"selector.observations."},
    "berteam train env=mctf_2025 env.max_s": {"env.max_score=", "env.max_speed="},
    "berteam train --c": {"--cfg", "--config-dir"},
    "berteam train --cfg ": {"all", "hydra", "job"},
    "berteam evaluate out": {"outputs/"},
    "berteam evaluate outputs/train/": {"outputs/train/one", "outputs/train/two"},
    "berteam compare outputs/train/one outputs/train/t": {"outputs/train/two"},
    "berteam tournament run=outputs/train/o": {"run=outputs/train/one"},
    "berteam list l": {"learner", "logger"},
    "berteam completion z": {"zsh"},
    "berteam reproduce paper_f": {"paper_fixed"},
    "berteam nonsense ": set(),
}


def answered(folder, line):
    words = line.split() + ([""] if line.endswith(" ") else [])
    done = subprocess.run([BERTEAM, "--complete", *words[1:]], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return {answer.partition("\t")[0] for answer in done.stdout.splitlines()}


@pytest.mark.parametrize("line", LINES)
def test_answers(line, folder):
    assert answered(folder, line) == LINES[line]


def test_an_answer_imports_nothing_slow():
    program = (
        "import sys; sys.argv = ['berteam', '--complete', 'train', 'selector=mcaa', 'selector.']\n"
        "from berteam_cli.cli import main; main()\n"
        "print(*sorted({'torch', 'hydra', 'omegaconf', 'numpy', 'rich', 'numba'} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr == "\n"
    assert "selector.train_every=" in done.stdout


def test_the_catalogue_is_what_hydra_finds():
    lines = [("train", []), ("train", ["selector=mcaa", "population=mixed4x3", "env=mctf_2025"])]
    lines += [
        ("train", ["experiment=unknown_opponent"]),
        ("train", ["experiment=strong_night"]),
        ("tournament", []),
        ("compare", ["runs=[a]"]),
    ]
    prepare()
    with initialize_config_module(CONF, version_base="1.3"):
        assert [choices(group) for group in catalogue.groups()] == [catalogue.choices(x) for x in catalogue.groups()]
        for command, line in lines:
            mine = catalogue.keys(command, dict(word.split("=") for word in line))
            assert {*mine, *(["population.members", "population.run"] * (command == "train"))} == {
                *keys(composed(command, [], parsed(line)))
            }


BASH = """
eval "$(berteam completion bash)"
compopt() { :; }
COMP_LINE="$1" COMP_POINT=${#1} COMP_CWORD=9
last="${1##*[ =]}"
$(complete -p berteam | sed 's/.*-F \\([^ ]*\\).*/\\1/') berteam "$last" ""
printf '%s\\n' "${COMPREPLY[@]}"
"""


@needs("bash")
@pytest.mark.parametrize("line", ["berteam tr", "berteam train selector=m", "berteam train sel"])
def test_bash_function(line, folder):
    """Its replies are what stands behind the last = of a word, which is what bash replaces."""
    done = subprocess.run(
        ["bash", "-c", BASH, "bash", line],
        cwd=folder,
        env=os.environ | {"PATH": PATH},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    assert set(done.stdout.split()) == {answer.removeprefix("selector=") or answer for answer in LINES[line]}


def shell_at(folder, *command):
    return Terminal(command, folder, columns=150, PATH=PATH, PS1="$ ", HISTFILE="/dev/null")


@needs("bash")
def test_bash_at_the_prompt(folder):
    there = shell_at(folder, "bash", "--norc", "--noprofile")
    try:
        there.type('eval "$(berteam completion bash)"; echo read""y\n')
        there.until("ready")
        there.type("berteam tra\t")
        there.until("berteam train")
        there.type("selector=mc\t")
        there.until("berteam train selector=mcaa")
        there.type("selector.top\t")
        there.until("selector.top_fraction=")
        there.type("1 \x15berteam evaluate outputs/train/o\t")
        there.until("berteam evaluate outputs/train/one")
    finally:
        there.close()


@needs("zsh")
def test_zsh_at_the_prompt(folder):
    there = shell_at(folder, "zsh", "-f", "-i")
    try:
        there.type('autoload -U compinit; compinit -u -D; eval "$(berteam completion zsh)"; echo read""y\n')
        there.until("ready")
        there.type("berteam tra\t")
        there.until("berteam train")
        there.type("selector=mc\t")
        there.until("berteam train selector=mcaa")
        there.type("selector.top\t")
        there.until("selector.top_fraction=")
        there.type("1 \x15berteam list l\t")
        there.until("tensorboard, wandb")
        there.type("\x15berteam evaluate outputs/train/o\t")
        there.until("berteam evaluate outputs/train/one")
    finally:
        there.close()


@needs("fish")
@pytest.mark.parametrize(
    "line", ["berteam tr", "berteam train selector=m", "berteam train sel", "berteam evaluate out"]
)
def test_fish(line, folder):
    program = f"berteam completion fish | source; complete -C {line!r}"
    done = subprocess.run(
        ["fish", "--no-config", "-c", program],
        cwd=folder,
        env=os.environ | {"PATH": PATH, "HOME": str(folder)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert {answer.partition("\t")[0] for answer in done.stdout.splitlines()} == LINES[line]
