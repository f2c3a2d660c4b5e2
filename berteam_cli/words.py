"""The words of the command line: which commands there are, and what those take that Hydra does not compose."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from berteam_cli.errors import InputError

WORDS = {
    "train": "one run: selector x optimizer x env; -m sweeps",
    "resume": "goes on with a run from its last checkpoint",
    "sweep": "runs that a file lists, or what is missing of a sweep",
    "optuna": "runs whose values Optuna searches for",
    "tournament": "every team against every other",
    "replay": "one game as a page for the browser or as a GIF",
    "export": "a member as a file that Stable-Baselines3 loads",
    "evaluate": "the true Elos of a run's teams, and what its selector knows of them",
    "compare": "runs against each other and against the fixed teams",
    "reproduce": "the paper's tables, beside its numbers",
    "report": "runs as one page for the browser",
    "inspect": "the tables of a run in the terminal",
    "list": "what can be chosen",
    "doctor": "whether all is well here: versions, cores, device, kernels, space",
    "completion": "a script for bash, zsh or fish that completes the words of berteam",
}


def reader(word: str, words: list[str], *, known: bool = False, **arguments: dict[str, Any]) -> Any:
    """Returns the arguments of a command that Hydra does not compose; of ``known`` ones only, and then also the rest.

    Raises:
        InputError: they are not of the command's form.
    """
    parser = argparse.ArgumentParser(prog=f"berteam {word}", description=WORDS[word])

    def wrong(message: str) -> None:
        raise InputError(f"berteam {word}: {message}; see berteam {word} --help.")

    parser.error = wrong  # type: ignore[assignment,method-assign]
    for name, settings in arguments.items():
        parser.add_argument(name.replace("__", "--"), **settings)
    return parser.parse_known_args(words) if known else parser.parse_args(words)


def resume(word: str, words: list[str]) -> None:
    """Goes on with a run."""
    given = reader(
        word,
        words,
        run={"type": Path, "help": "folder of the run"},
        overrides={"nargs": "*", "help": "epochs=N, workers=N, checkpoint_every=N, evaluation.games=N, logger=NAME"},
    )
    from berteam_cli.command.resume import resume as go_on  # noqa: PLC0415 (start-up: each command imports what it needs)

    go_on(given.run, given.overrides)


def export(word: str, words: list[str]) -> None:
    """Writes a member of a run as a file of Stable-Baselines3."""
    given = reader(
        word,
        words,
        run={"type": Path, "help": "folder of the run"},
        overrides={"nargs": "*", "help": "agent=N, out=FILE.zip (RUN/agent_N.zip), on_exists=error or overwrite"},
    )
    from berteam_cli.command.export import export as write_member  # noqa: PLC0415

    write_member(given.run, given.overrides)


def inspect(word: str, words: list[str]) -> None:
    """Shows the tables of a run."""
    given = reader(
        word,
        words,
        run={"type": Path, "help": "folder of the run"},
        overrides={"nargs": "*", "help": "trust=MODULE:FUNCTION, code that the run's game may import"},
        __top={"type": int, "default": 10, "help": "rows of each table"},
    )
    if given.top < 1:
        raise InputError(f"--top must be >= 1, but is {given.top}.")
    from berteam_cli.command.inspect import inspect as look  # noqa: PLC0415

    look(given.run, given.top, given.overrides)


def listing(word: str, words: list[str]) -> None:
    """Lists the choices."""
    given = reader(word, words, group={"nargs": "?", "help": "only of this group"})
    from berteam_cli.command.listing import show  # noqa: PLC0415

    show(given.group)


def doctor(word: str, words: list[str]) -> None:
    """Tells whether all is well here."""
    given = reader(word, words, __json={"action": "store_true", "help": "as JSON"})
    from berteam_cli.command.doctor import doctor as examine  # noqa: PLC0415

    examine(as_json=given.json)


def completion(word: str, words: list[str]) -> None:
    """Prints a script that completes the words of berteam."""
    from berteam_cli.completion import SCRIPTS  # noqa: PLC0415

    given = reader(word, words, shell={"help": f"{', '.join(SCRIPTS)}"})
    if given.shell not in SCRIPTS:
        raise InputError.choice("shell", given.shell, SCRIPTS)
    print(SCRIPTS[given.shell])
