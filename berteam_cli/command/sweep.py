"""berteam sweep and berteam optuna: sweeps from a file, and what is missing of a sweep that was cut short."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from berteam_cli.compose import prepare
from berteam_cli.errors import InputError, RunError
from berteam_cli.overrides import arguments
from berteam_cli.quiet import written
from berteam_cli.sweep import plan
from berteam_cli.sweep.folder import LOCKS, STOP, TABLE, Sweep, working
from berteam_cli.sweep.search import check_search, ends, words_of
from berteam_cli.terminal import berteam

Check = Callable[[str, list[str]], object]
"""Checks the words of a command as Hydra would compose them; raises InputError."""
Launch = Callable[[str, list[str]], None]
"""Runs a multirun of a command with these words."""
LAUNCHER = ("hydra/launcher=", "hydra.launcher.", "hydra.sweeper.max_batch_size=")
"""What is said of how a sweep runs."""
NAMES_CODE = re.compile(r"trust|(reward|target)\W.*:|\$\{|logger\W.*(tracking|mode)")
"""Words that may import code, let a file run some, stand for such words, or send figures elsewhere."""


def asked(word: str, read: Callable[..., Any], check: Check, launch: Launch) -> None:
    """Runs what the words of `berteam sweep` or `berteam optuna` ask for.

    Args:
        word: which of the two.
        read: reads the arguments it is given out of the words, and returns them and the other words.
        check: of a command's words.
        launch: runs a command.

    Raises:
        InputError: there is neither a file nor a folder, or it is wrong.
        RunError: some jobs failed.
    """
    about = "yaml file, see docs/sweeps.md; after it hydra/launcher=NAME and other words for all jobs"
    known: dict[str, dict[str, Any]] = {"file": {"nargs": "?", "help": about}}
    if word == "sweep":
        known["__resume"] = {"type": Path, "metavar": "DIR", "help": "runs what is not done of the sweep in DIR"}
    given, rest = read(**known)
    prepare()
    if folder := getattr(given, "resume", None):
        resumed(folder, [*([given.file] if given.file else []), *rest], check, launch)
    elif given.file is None or "=" in given.file:
        raise InputError(f"berteam {word}: the file must be given first; see berteam {word} --help.")
    elif word == "sweep":
        from_file(Path(given.file), rest, check, launch)
    else:
        searched(Path(given.file), rest, check, launch)


def multirun(command: str, words: list[str], launch: Launch) -> None:
    """Runs all combinations that ``words``, which are checked, ask for: `berteam train -m ...`.

    Raises:
        InputError: the folder is not free.
        RunError: some jobs failed.
    """
    words, folder, ours = plan.planned(command, words)
    plan.begin(command, folder, plan.jobs_of(command, words, [[]]) if ours else {})
    carry_out(folder, words, launch, ours=ours)


def from_file(path: Path, words: list[str], check: Check, launch: Launch) -> None:
    """Runs the jobs that a file lists: `berteam sweep FILE`.

    Args:
        path: of the file.
        words: more of the command line, for all jobs.
        check: of the jobs' words.
        launch: runs them.

    Raises:
        InputError: the file or a job is wrong.
        RunError: some jobs failed.
    """
    held = plan.read_plan("sweep", path)
    shared, variants = plan.sweep_words(path, held)
    behind = arguments(words).overrides
    command, shared = held["command"], [*plan.flags(words), *shared, *behind]
    variants = [[*variant, *behind] for variant in variants]
    for variant in variants:
        check(command, [*shared, *variant])
    shared, folder, _ = plan.planned(command, shared)
    plan.begin(command, folder, plan.jobs_of(command, shared, variants))
    carry_out(folder, shared, launch)


def searched(path: Path, words: list[str], check: Check, launch: Launch) -> None:
    """Runs jobs whose values Optuna chooses: `berteam optuna FILE`.

    Args:
        path: of the file.
        words: more of the command line, for all jobs.
        check: of the jobs' words.
        launch: runs them.

    Raises:
        InputError: the file or a value is wrong.
        RunError: some jobs failed.
    """
    held = plan.read_plan("optuna", path)
    goal = check_search(path, held)
    shared = [*plan.flags(words), *held["overrides"], *arguments(words).overrides]
    check("train", [*shared, *ends(goal["ranges"])])
    shared, folder, _ = plan.planned("train", shared)
    jobs = plan.jobs_of("train", shared, [[]])
    if len(jobs) > 1:
        raise InputError(f"{path}: overrides must give each key one value; what is searched through stands in search.")
    plan.begin("train", folder, {}, goal | {"overrides": jobs[0]})
    carry_out(folder, shared, launch)


def resumed(folder: Path, words: list[str], check: Check, launch: Launch) -> None:
    """Runs what is not done of the sweep in ``folder``: `berteam sweep --resume DIR`.

    Args:
        folder: of the sweep.
        words: how to run them: settings of Hydra's launcher, and flags; nothing of the kind is read from the folder.
        check: of the jobs' words.
        launch: runs them.

    Raises:
        InputError: it is no sweep's, or another process is at work there.
        RunError: some jobs failed.
    """
    sweep = Sweep.read(folder)
    if sweep.command not in plan.SWEPT:
        raise InputError.choice(f"{folder}: command", sweep.command, plan.SWEPT)
    given = arguments(words).overrides
    stored = {word for job in sweep.unfinished() for word in sweep.jobs[job]} | set(words_of(sweep.search))
    for word in given:
        if word not in stored and not word.startswith(LAUNCHER):
            raise InputError(
                f"{word} cannot be said when a sweep goes on, only how it runs, such as {LAUNCHER[0]}NAME."
            )
    for word in sorted(stored - set(given)):
        if plan.of_hydra(word) or NAMES_CODE.search(word):
            raise InputError(
                f"A job of {folder} says {word}, which may run code or send something elsewhere, and what only lies in "
                f"a folder never does; if it is yours, say it too: {going_on(folder, [*words, word])}"
            )
    words = [*plan.flags(words), *(word for word in given if word not in stored)]
    check(sweep.command, words)
    carry_out(folder, [*words, f"hydra.sweep.dir={plan.spelt(str(folder))}"], launch)


def going_on(folder: Path, words: list[str]) -> str:
    """Returns the command line that goes on with the sweep in ``folder``, with these ``words``."""
    return berteam("sweep --resume", [folder], *map(shlex.quote, words))


def carry_out(folder: Path, words: list[str], launch: Launch, *, ours: bool = True) -> None:
    """Runs what is not done of the sweep in ``folder`` and tells how it ended.

    Args:
        folder: of the sweep.
        words: of the multirun.
        launch: runs it.
        ours: whether our own sweeper does, to whom the jobs' words in sweep.json are enough.

    Raises:
        InputError: another process runs this sweep.
        RunError: some jobs are not done.
        KeyboardInterrupt: it was interrupted.
    """
    command, flags = Sweep.read(folder).command, plan.flags(words)
    settings = [word for word in arguments(words).overrides if plan.of_hydra(word)]
    how = [word for word in settings if not word.startswith("hydra.sweep.dir=")]
    again = going_on(folder, [*flags[1:], *how])
    written(folder)
    print(f"{folder}: see {folder / TABLE}", flush=True)
    with working(folder / "sweep"):
        (folder / LOCKS / STOP).unlink(missing_ok=True)
        try:
            launch(command, [*flags, *settings] if ours else words)
        except KeyboardInterrupt:
            print(f"Interrupted. Go on with: {again}", flush=True)
            raise
    conclude(Sweep.read(folder), again)


def conclude(sweep: Sweep, again: str) -> None:
    """Tells how a sweep ended that nobody interrupted in this process.

    Args:
        sweep: as it is now.
        again: the command that goes on with it.

    Raises:
        RunError: some jobs are not done.
        KeyboardInterrupt: a job was interrupted.
    """
    states = Counter(sweep.status(job)[0] for job in sweep.jobs)
    table = sweep.folder / TABLE
    if not (left := sum(states.values()) - states["done"]):
        print(f"All {states['done']} jobs are done: {table}")
        return
    if (sweep.folder / LOCKS / STOP).exists():
        print(f"{left} of {len(sweep.jobs)} jobs are not done. Go on with: {again}", flush=True)
        raise KeyboardInterrupt
    failed = states["failed"] + states["refused"]
    others = f", {left - failed} others are not done" if left > failed else ""
    retry = "" if sweep.search and left == failed else f" Run them again with: {again}"  # a trial is told once
    raise RunError(f"{failed} runs of the sweep failed{others}; {table} says which.{retry}")
