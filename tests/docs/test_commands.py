"""Every command line and block of Python that the documents show is run, at sizes at which nothing is learnt.

Those of a page run in its order and in one folder: first its blocks, then the lines that stand in sentences. A line is
changed by WORDS and LESS only. What is not run stands in MADE, CHECKED or NAMED, with the reason.
"""

import itertools
import re
import shlex
import shutil
import subprocess

import pytest

from berteam_cli import cli
from berteam_cli.compose import check, prepare
from berteam_cli.overrides import spelt_out
from tests.docs.pages import PAGES, ROOT, blocks, inline_commands

SMALL = ["epochs=2", "games_per_epoch=4", "record_every=2", "evaluation.games=0", "payoff_steps=0"]
LESS = {
    "train": SMALL,
    "resume": ["epochs=4"],
    "tournament": ["games_per_pair=2"],
    "evaluate": ["games_per_pair=1", "aggression_games=1", "replay_games=1", "reference_teams=4", "most=0"],
    "compare": ["games=8", "reference_games=8", "reference_teams=2"],
}
"""What is said behind the line of each command, and so in place of what the line itself says of these keys."""

RATED = r"out=outputs/(mine|first|second)\b"
"""Runs of which later lines want the strongest teams: two are rated."""

WORDS = (
    (r"\bRUN RUN\b", "outputs/of_page outputs/another"),
    (r"\bRUN\b", "outputs/of_page"),
    (r"\bWHAT\b", "paper_fixed"),
    (r"\bexperiment=NAME\b", "experiment=quickstart"),
    (r"\btrain (?!.*((population|experiment|env)=|--cfg)).*", r"\g<0> population=islands4x3"),
    (r"\bDIR/0\b", "outputs/of_page"),
    (r"\boutputs/hands\b", "outputs/of_page"),
    (r"\s(\||>|2>).*", ""),
    (r"(?<!\S)\.\.\.(?!\S)", ""),
)
"""What is said in place of words that stand for something of the reader's, and of the usual population of 60."""

CODE = {"np.arange(1000)": "np.arange(8)"}
"""What is done in place of parts of Python blocks that take long."""

MADE = "make: sets up environments, or runs what takes minutes, these tests among it; `make -n` tells that it could"

CHECKED = {
    r"train .*seed=0,1,2": "a sweep of many runs",
    r"reproduce ": "tests/command/test_reproduce.py runs it at a small scale, and it has no smaller one",
}
"""Lines that are composed and checked as a whole, as the command does before it begins, but not run; and why."""

RUN_ON = {"README.md", "tutorial.md"}
COMPOSED = {"train", "evaluate", "compare", "report", "tournament"}
"""Lines of these commands are run on those pages; on others, where only their values differ, those are checked."""

ALREADY = {r"(sweep|optuna) ": "tests/command/test_sweep.py runs such lines, each of which starts processes"}
"""Lines that are not run here, and why."""

NAMED = "a command's name alone, in a sentence"

ELSEWHERE = {"extending.md": "its lines need its examples, which test_extending.py puts in place and runs"}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two small runs, for lines about runs that a page did not make."""
    folder = tmp_path_factory.mktemp("runs")
    words = ["train", "experiment=quickstart", *SMALL, "evaluation.games=112"]
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        for seed, name in enumerate(("of_page", "another")):
            patched.setattr("sys.argv", ["berteam", *words, f"seed={seed}", f"out={name}"])
            cli.main()
    return folder


def placed(page, folder, runs):
    """Puts into ``folder`` what lines of ``page`` ask for: runs, and files that it shows."""
    for name in ("of_page", "another", "a", "b"):
        shutil.copytree(runs / ("another" if name in ("another", "b") else "of_page"), folder / "outputs" / name)
    for block in blocks(page):
        if block.file and (block.file.startswith("own/") or "/" not in block.file):
            (folder / block.file).parent.mkdir(parents=True, exist_ok=True)
            (folder / block.file).write_text(block.text)


def steps(page):
    """Returns what to do: (kind, text), kind being Python, a line of a block or one of a sentence."""
    found = []
    for block in blocks(page):
        found += [("python", block.text)] if block.language == "python" and not block.file else []
        found += [("block", line) for line in block.commands]
    shown = {line for _, line in found}
    return found + [("sentence", line) for line in dict.fromkeys(inline_commands(page)) if line not in shown]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_what_a_page_shows_runs(page, runs, berteam, tmp_path):
    placed(page, tmp_path, runs)
    names = {}
    for kind, shown in [] if page.name in ELSEWHERE else steps(page):
        if kind == "python":
            code = shown
            for long, short in CODE.items():
                code = code.replace(long, short)
            exec(compile(code, str(page), "exec"), names)
            continue
        line = shown
        for pattern, word in WORDS:
            line = re.sub(pattern, word, line)
        command, *words = shlex.split(line)
        said = " ".join(words)
        if command == "make":
            subprocess.run(["make", "-n", *words], cwd=ROOT, check=True, capture_output=True)
        elif kind == "sentence" and len(words) < 2 and (not words or words[0] in set(cli.WORDS) - {"list", "doctor"}):
            continue  # NAMED
        elif any(re.match(pattern, said) for pattern in ALREADY):
            continue
        elif any(re.match(pattern, said) for pattern in CHECKED) or (words[0] in COMPOSED and page.name not in RUN_ON):
            checked(*words)
            for out in re.findall(r"\bout=(\S+)", said):
                shutil.copytree(runs / "of_page", tmp_path / out)
        else:
            less = [] if {"--help", "--cfg"} & set(words) else LESS.get(words[0], [])
            berteam(*words, *less, *(["evaluation.games=112"] if re.search(RATED, said) and less is SMALL else []))


def checked(word, *words):
    """Does with a line what the command does before it begins."""
    prepare()
    words = list(words)
    if word in cli.LEADING:  # as cli.about says it
        named = list(itertools.takewhile(lambda x: "=" not in x, words))
        value = f"[{','.join(named)}]" if cli.LEADING[word] == "runs" else named[0]
        words = [f"{cli.LEADING[word]}={value}", *words[len(named) :]]
    check(word, spelt_out(words), lambda config, keys: cli.verify(word, config, keys))
