"""The command: a word, and what follows it. Only it, overrides.py, compose.py, config.py and sweep/plan.py know Hydra.

Exit codes: 0 done, 2 the input is wrong, 3 the run failed, 130 interrupted.
"""

from __future__ import annotations

import errno
import functools
import importlib
import io
import itertools
import os
import signal
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from berteam_cli import __version__, quiet
from berteam_cli.errors import InputError, RunError, did_you_mean, sentence
from berteam_cli.words import WORDS, completion, doctor, export, inspect, listing, reader, resume

if TYPE_CHECKING:
    from omegaconf import DictConfig

INTERRUPTED = 130

HELP = f"""berteam {__version__}: chooses which learning agents should play together.

  berteam train selector=mcaa optimizer=mapelites
  berteam train -m selector=berteam,mcaa optimizer=coevolution,mapelites seed=0,1,2
  berteam inspect outputs/train/...

Commands (each has --help; with -q nothing but errors, and at last the folder):
{chr(10).join(f"  {word:<11} {does}" for word, does in WORDS.items())}
"""


def main() -> None:
    """Runs the command line and exits with its code."""
    if sys.argv[1:2] == ["--complete"]:
        from berteam_cli.completion import answer  # noqa: PLC0415 (start-up: each command imports what it needs)

        answer(sys.argv[2:], WORDS)
        return
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # a name that the terminal cannot show ends no run
    words = [word for word in sys.argv[1:] if word not in quiet.WORDS]
    silent = len(words) < len(sys.argv[1:]) and not {"-h", "--help"} & set(words)
    if not words or words[0] in {"-h", "--help"}:
        print(HELP)
        sys.exit(0)
    if words[0] == "--version":
        print(__version__)
        sys.exit(0)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a batch system's way to say Ctrl-C
    try:
        with quiet.hushed() if silent else nullcontext():
            run(words[0], words[1:])
    except (InputError, RunError) as error:
        refuse(error)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except BrokenPipeError:  # whoever read our output has seen enough, as head does
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (python flushes it at exit)
        sys.exit(0)
    except OSError as error:
        if error.errno != errno.ENAMETOOLONG:
            raise
        refuse(InputError(f"{error.filename} cannot be used: its name is too long."))


def run(word: str, words: list[str]) -> None:
    """Runs one sub-command.

    Raises:
        InputError: there is no such command, or its arguments are wrong.
    """
    if word not in WORDS:
        raise InputError(f"{word!r} is no command; there are {', '.join(WORDS)}.{did_you_mean(word, WORDS)}")
    commands = {"train": training, "tournament": composed}
    commands |= {"resume": resume, "inspect": inspect, "export": export, "list": listing}
    commands |= {"doctor": doctor, "completion": completion, "sweep": sweep, "optuna": sweep}
    commands.get(word, about)(word, words)


def training(word: str, words: list[str]) -> None:
    """Trains; with resume=RUN among the words as `berteam resume` does.

    Raises:
        InputError: a run is to go on in a sweep, or two at once.
    """
    going_on = [x.partition("=")[2] for x in words if x.startswith("resume=")]
    if not going_on:
        composed(word, words)
        return
    if len(going_on) > 1 or {"-m", "--multirun"} & set(words):
        raise InputError("resume=RUN goes on with one run; berteam sweep --resume DIR goes on with a sweep.")
    resume("resume", [*going_on, *(x for x in words if not x.startswith("resume="))])


def composed(word: str, words: list[str]) -> None:
    """Runs a command whose config Hydra composes."""
    if {"-h", "--help"} & set(words):
        from berteam_cli.catalogue import help_text  # noqa: PLC0415 (start-up: each command imports what it needs)

        print(help_text(word))
        return
    from berteam_cli.compose import prepare  # noqa: PLC0415
    from berteam_cli.overrides import arguments, spelt_out  # noqa: PLC0415

    prepare()
    words = spelt_out(words)
    given = arguments(words)
    if given.hydra_help or given.shell_completion:
        launch(word, words)
        return
    config = checked_words(word, words)
    if given.cfg or given.info or (not given.multirun and any("hydra" in x for x in given.overrides)):
        launch(word, words)
    elif given.multirun:
        from berteam_cli.command.sweep import multirun  # noqa: PLC0415

        multirun(word, words, launch)
    else:  # Hydra would compose the same again, twice, which takes a second
        sys.argv = [f"berteam {word}", *words]
        alone(word, config)


def checked_words(word: str, words: list[str]) -> DictConfig:
    """Checks the words of a command that Hydra composes, and of each job where they are a sweep's.

    Returns the config, of a sweep that of its last job.

    Raises:
        InputError: they are wrong.
    """
    from berteam_cli.compose import check  # noqa: PLC0415
    from berteam_cli.overrides import arguments  # noqa: PLC0415
    from berteam_cli.sweep.plan import check_launcher  # noqa: PLC0415

    given = arguments(words)
    check_launcher(given.overrides)
    return check(word, words, lambda config, keys: None if given.cfg or given.info else verify(word, config, keys))


def launch(word: str, words: list[str]) -> None:
    """Lets Hydra run a command with words that are checked."""
    import hydra  # noqa: PLC0415

    sys.argv = [f"berteam {word}", *words]
    task = functools.partial(perform, word)  # importable by name, as processes elsewhere must
    hydra.main(version_base="1.3", config_path="pkg://berteam_cli.conf", config_name=word)(task)()


def verify(word: str, config: Any, keys: list[str]) -> None:
    """Checks that the parts of a config go together, and that the overridden ``keys`` have an effect.

    Raises:
        InputError: they do not.
    """
    from berteam_cli import build  # noqa: PLC0415

    if word == "train":
        from berteam_cli.logger.opening import check_logger  # noqa: PLC0415
        from berteam_cli.stored import checkpointed  # noqa: PLC0415

        check_logger(config.logger)
        build.parts(config, stored=checkpointed(config, Path(config.out) if config.out else None))
    elif word == "tournament":
        from berteam_cli.command import entrants  # noqa: PLC0415

        entrants.players(config, keys)
    elif word == "replay":
        from berteam_cli.command import replay  # noqa: PLC0415

        replay.players(config, keys)
    elif word == "report":
        from berteam_cli.command import report  # noqa: PLC0415

        report.read(config)


def command_of(word: str) -> Callable[[Any, str, Path | None], float]:
    """Returns the function of a command that Hydra composes: it takes a config, its yaml and ``out``.

    It returns the figure that a sweeper looks for the best of, NaN where there is none.
    """
    module = importlib.import_module(f"berteam_cli.command.{word}")
    return getattr(module, word)


def perform(word: str, cfg: DictConfig) -> float:
    """Runs a command with the config, its yaml and its folder, as the job of a sweep if it is one.

    Returns what the command returns; NaN for a job that failed.
    """
    from hydra.core.hydra_config import HydraConfig  # noqa: PLC0415
    from hydra.types import RunMode  # noqa: PLC0415

    if HydraConfig.get().mode == RunMode.MULTIRUN:
        from berteam_cli.sweep.process import perform_job  # noqa: PLC0415

        return perform_job(word, cfg, HydraConfig.get(), command_of)
    try:
        return alone(word, cfg)
    except (InputError, RunError) as error:  # past Hydra, which would print a traceback
        refuse(error)


def alone(word: str, cfg: DictConfig) -> float:
    """Runs a command that is no job of a sweep with its config; returns what it returns."""
    from omegaconf import OmegaConf  # noqa: PLC0415

    from berteam_cli.config import checked  # noqa: PLC0415

    if word == "train":
        from berteam_cli.stored import as_begun  # noqa: PLC0415

        cfg = as_begun(cfg)
    config, text = checked(cfg), OmegaConf.to_yaml(cfg, resolve=True)
    out = getattr(config, "out", None)
    return command_of(word)(config, text, Path(out) if out else None)


def refuse(error: InputError | RunError) -> NoReturn:
    """Says what is wrong and exits with the error's code."""
    print(f"berteam: {sentence(error)}", file=sys.stderr)
    raise SystemExit(error.code) from None


def sweep(word: str, words: list[str]) -> None:
    """Runs the sweep that a file describes, or what is missing of one."""
    from berteam_cli.command.sweep import asked  # noqa: PLC0415

    asked(word, functools.partial(reader, word, words, known=True), checked_words, launch)


LEADING = {"replay": "run", "evaluate": "run", "compare": "runs", "report": "runs", "reproduce": "what"}
"""The key that the first words of a command stand for: folders of runs, and what is reproduced."""


def about(word: str, words: list[str]) -> None:
    """Runs a command whose first words, which are no overrides and no flags, say what it is about.

    Raises:
        InputError: that is said twice, or missing, or a sweep is asked for.
    """
    key, several = LEADING[word], LEADING[word] == "runs"
    named = list(itertools.takewhile(lambda x: not x.startswith("-") and ("=" not in x or os.path.isdir(x)), words))
    named = named if several else named[:1]
    rest = words[len(named) :]
    if named and any(other.startswith(f"{key}=") for other in rest):
        raise InputError(f"{'The run is' if key == 'run' else 'This is'} named twice: {named[0]} and {key}=.")
    if {"-m", "--multirun"} & set(words):
        raise InputError(f"{word} does one thing at a time, so it takes no --multirun.")
    asked = any(x.startswith(f"{key}=") for x in rest) or {"-h", "--help", "--cfg", "-c", "--info", "-i"} & set(rest)
    if not (named or asked or word == "replay"):
        raise InputError(f"berteam {word}: {key} must be given first; see berteam {word} --help.")
    quoted = ["'" + x.replace("'", "\\'").replace("${", "\\${") + "'" for x in named]  # a name is no interpolation
    if quoted:
        rest = [f"{key}=[{','.join(quoted)}]" if several else f"{key}={quoted[0]}", *rest]
    composed(word, rest)
