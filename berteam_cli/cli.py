"""The command: a word, and what follows it. Besides config.py and compose.py only this module knows Hydra.

Exit codes: 0 done, 2 the input is wrong, 3 the run failed, 130 interrupted.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from berteam_cli import __version__
from berteam_cli.errors import InputError, RunError, did_you_mean

if TYPE_CHECKING:
    from omegaconf import DictConfig

INTERRUPTED = 130

WORDS = {
    "train": "one run: selector x optimizer x env; -m sweeps",
    "resume": "goes on with a run from its last checkpoint",
    "tournament": "every team against every other",
    "replay": "one game as a page for the browser or as a GIF",
    "export": "a member as a file that Stable-Baselines3 loads",
    "evaluate": "where choosing among a run's teams ends in theory, and who is alike",
    "report": "runs as one page to read, with a picture of each plot",
    "inspect": "the tables of a run in the terminal",
    "list": "what can be chosen",
}

HELP = f"""berteam {__version__}: chooses which learning agents should play together.

  berteam train selector=mcaa optimizer=mapelites
  berteam train -m selector=berteam,mcaa optimizer=coevolution,mapelites seed=0,1,2
  berteam inspect outputs/train/...

Commands (each has --help):
{chr(10).join(f"  {word:<11} {does}" for word, does in WORDS.items())}
"""


def main() -> None:
    """Runs the command line and exits with its code."""
    words = sys.argv[1:]
    if not words or words[0] in {"-h", "--help"}:
        print(HELP)
        sys.exit(0)
    if words[0] == "--version":
        print(__version__)
        sys.exit(0)
    try:
        run(words[0], words[1:])
    except (InputError, RunError) as error:
        refuse(error)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except BrokenPipeError:  # whoever read our output has seen enough, as head does
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 (python flushes it at exit)
        sys.exit(0)


def run(word: str, words: list[str]) -> None:
    """Runs one sub-command.

    Raises:
        InputError: there is no such command, or its arguments are wrong.
    """
    if word not in WORDS:
        raise InputError(f"{word!r} is no command; there are {', '.join(WORDS)}.{did_you_mean(word, WORDS)}")
    commands = {"train": composed, "tournament": composed, "replay": replay}
    commands |= {
        "resume": resume,
        "inspect": inspect,
        "export": export,
        "list": listing,
        "evaluate": evaluate,
        "report": report,
    }
    commands[word](word, words)


def composed(word: str, words: list[str]) -> None:
    """Runs a command whose config Hydra composes."""
    import hydra  # noqa: PLC0415 (start-up: each command imports what it needs)

    from berteam_cli.compose import arguments, check, help_text, prepare, spelt_out  # noqa: PLC0415

    prepare()
    words = spelt_out(words)
    Sweeps.failed, Sweeps.table = 0, None
    given = arguments(words)
    if given.help:
        print(help_text(word))
        return
    if not (given.hydra_help or given.shell_completion):
        check(word, words, lambda config, keys: None if given.cfg or given.info else verify(word, config, keys))
    sys.argv = [f"berteam {word}", *words]
    task = {"train": train_task, "tournament": tournament_task, "replay": replay_task, "report": report_task}[word]
    hydra.main(version_base="1.3", config_path="pkg://berteam_cli.conf", config_name=word)(task)()
    if given.multirun and Sweeps.failed:
        raise RunError(f"{Sweeps.failed} runs of the sweep failed; {Sweeps.table} says which.")


def verify(word: str, config: Any, keys: list[str]) -> None:
    """Checks that the parts of a config go together, and that the overridden ``keys`` have an effect.

    Raises:
        InputError: they do not.
    """
    from berteam_cli import build  # noqa: PLC0415

    if word == "train":
        from berteam_cli.logger.opening import check_logger  # noqa: PLC0415
        from berteam_cli.stored import goes_on  # noqa: PLC0415

        check_logger(config.logger)
        build.parts(config, stored=goes_on(config, Path(config.out) if config.out else None))
    elif word == "tournament":
        from berteam_cli.command import tournament  # noqa: PLC0415

        tournament.players(config, keys)
    elif word == "report":
        from berteam_cli.command import report  # noqa: PLC0415

        report.read(config)
    else:
        from berteam_cli.command import replay  # noqa: PLC0415

        replay.players(config, keys)


class Sweeps:
    """What became of the runs of a sweep in this process."""

    failed = 0
    table: Path | None = None


def train_task(cfg: DictConfig) -> float:
    """Trains; what Hydra calls for each run. Returns the expected Elo, for sweepers that look for the best."""
    from berteam_cli.command.train import train  # noqa: PLC0415

    return perform(train, cfg)


def tournament_task(cfg: DictConfig) -> float:
    """Plays a tournament; what Hydra calls. Returns NaN: a tournament has no figure to look for the best of."""
    from berteam_cli.command.tournament import play  # noqa: PLC0415

    return perform(play, cfg)


def replay_task(cfg: DictConfig) -> float:
    """Films a game; what Hydra calls. Returns NaN as ``tournament_task``."""
    from berteam_cli.command.replay import replay as film  # noqa: PLC0415

    return perform(lambda config, _, out: film(config, out), cfg)


def report_task(cfg: DictConfig) -> float:
    """Writes a report; what Hydra calls. Returns NaN as ``tournament_task``."""
    from berteam_cli.command.report import report as tell  # noqa: PLC0415

    return perform(lambda config, _, out: tell(config, out), cfg)


def perform(command: Callable[[Any, str, Path | None], float], cfg: DictConfig) -> float:
    """Runs ``command`` with the config, its yaml and its folder, as the job of a sweep if it is one.

    Returns what the command returns; NaN for a job that failed.
    """
    from hydra.core.hydra_config import HydraConfig  # noqa: PLC0415
    from hydra.types import RunMode  # noqa: PLC0415
    from omegaconf import OmegaConf  # noqa: PLC0415

    from berteam_cli.command.sweep import TABLE, swept  # noqa: PLC0415
    from berteam_cli.config import checked  # noqa: PLC0415

    config, text = checked(cfg), OmegaConf.to_yaml(cfg, resolve=True)
    if HydraConfig.get().mode != RunMode.MULTIRUN:
        try:
            return command(config, text, Path(config.out) if config.out else None)
        except (InputError, RunError) as error:  # past Hydra, which would print a traceback
            refuse(error)
    folder = Path(HydraConfig.get().runtime.output_dir)
    Sweeps.table = folder.parent / TABLE
    figure, ok = swept(lambda: command(config, text, folder), folder, list(HydraConfig.get().overrides.task))
    Sweeps.failed += not ok
    return figure


def refuse(error: InputError | RunError) -> NoReturn:
    """Says what is wrong and exits with the error's code."""
    print(f"berteam: {error}", file=sys.stderr)
    raise SystemExit(error.code) from None


def reader(word: str, words: list[str], **arguments: dict[str, Any]) -> argparse.Namespace:
    """Returns the arguments of a command that Hydra does not compose.

    Raises:
        InputError: they are not of the command's form.
    """
    parser = argparse.ArgumentParser(prog=f"berteam {word}", description=WORDS[word])

    def wrong(message: str) -> None:
        raise InputError(f"berteam {word}: {message}; see berteam {word} --help.")

    parser.error = wrong  # type: ignore[assignment,method-assign]
    for name, settings in arguments.items():
        parser.add_argument(name.replace("__", "--"), **settings)
    return parser.parse_args(words)


def resume(word: str, words: list[str]) -> None:
    """Goes on with a run."""
    given = reader(
        word,
        words,
        run={"type": Path, "help": "folder of the run"},
        overrides={"nargs": "*", "help": "epochs=N, workers=N, checkpoint_every=N, evaluation.games=N"},
    )
    from berteam_cli.command.resume import resume as go_on  # noqa: PLC0415

    go_on(given.run, given.overrides)


def replay(word: str, words: list[str]) -> None:
    """Films a game; a first word that is no override and no flag is the folder of a run.

    Raises:
        InputError: the run is named twice, or several games are asked for.
    """
    if words and not words[0].startswith("-") and ("=" not in words[0] or Path(words[0]).is_dir()):
        if any(other.startswith("run=") for other in words[1:]):
            raise InputError(f"The run is named twice: {words[0]} and run=.")
        quoted = words[0].replace("'", "\\'")
        words = [f"run='{quoted}'", *words[1:]]
    if {"-m", "--multirun"} & set(words):
        raise InputError("replay films one game, so it takes no --multirun.")
    composed(word, words)


def report(word: str, words: list[str]) -> None:
    """Reports runs; the words that are no override and no flag are their folders.

    Raises:
        InputError: runs are named in two ways, or several reports are asked for.
    """
    folders = [x for x in words if not x.startswith("-") and ("=" not in x or Path(x).is_dir())]
    rest = [x for x in words if x not in folders]
    if folders and any(x.startswith("runs=") for x in rest):
        raise InputError(f"The runs are named twice: {folders[0]} and runs=.")
    if {"-m", "--multirun"} & set(words):
        raise InputError("report takes several runs at once, so it takes no --multirun.")
    quoted = ",".join("'{}'".format(x.replace("'", "\\'")) for x in folders)
    composed(word, [f"runs=[{quoted}]", *rest] if folders else rest)


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
        __top={"type": int, "default": 10, "help": "rows of each table"},
    )
    if given.top < 1:
        raise InputError(f"--top must be >= 1, but is {given.top}.")
    from berteam_cli.command.inspect import inspect as look  # noqa: PLC0415

    look(given.run, given.top)


def evaluate(word: str, words: list[str]) -> None:
    """Compares a run with where choosing among its teams ends in theory, and members with each other."""
    given = reader(
        word,
        words,
        run={"type": Path, "help": "folder of the run"},
        __top={"type": int, "default": 10, "help": "rows of each table (10)"},
        __most={"type": int, "default": 300, "help": "so many teams at most play each other (300)"},
        __games={"type": int, "default": 8, "help": "games of each two teams (8: all orders of teams of two)"},
    )
    for name, least in (("top", 1), ("most", 0), ("games", 1)):
        if getattr(given, name) < least:
            raise InputError(f"--{name} must be >= {least}, but is {getattr(given, name)}.")
    from berteam_cli.command.evaluate import evaluate as compare  # noqa: PLC0415

    compare(given.run, given.top, given.most, given.games)


def listing(word: str, words: list[str]) -> None:
    """Lists the choices."""
    given = reader(word, words, group={"nargs": "?", "help": "only of this group"})
    from berteam_cli.command.listing import show  # noqa: PLC0415

    show(given.group)
