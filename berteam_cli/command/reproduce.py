"""berteam reproduce: one of the paper's experiments, from its trainings to its numbers beside ours."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from berteam_cli.command.compare import compare
from berteam_cli.command.evaluate import evaluate
from berteam_cli.command.inspect import narrow, printed
from berteam_cli.command.report import report
from berteam_cli.command.tournament import tournament
from berteam_cli.command.train import train
from berteam_cli.compose import config_of
from berteam_cli.config_commands import ReproduceConfig
from berteam_cli.errors import InputError
from berteam_cli.evaluation.paper import Reproduced, rows
from berteam_cli.folder import CONFIG, MANIFEST, newest, read_manifest
from berteam_cli.quiet import written
from berteam_cli.records import COLUMNS, EVALUATION, write_table
from berteam_cli.report.drawing import check_matplotlib
from berteam_cli.stored import plain_config, write_config
from berteam_cli.terminal import console, end, say

GAMES_PER_PAIR, BETWEEN, AGAINST = 8, 10_000, 1_000  # of an evaluation and of a comparison, at scale 1


@dataclass(frozen=True)
class Experiment:
    """One of the paper's experiments.

    Attributes:
        epochs: of each training, at scale 1.
        algorithms: (optimizer, selector) of each.
        scaled: overrides that grow with the scale, beside the epochs: key and value at scale 1.
    """

    epochs: int
    algorithms: tuple[tuple[str, str], ...]
    scaled: tuple[tuple[str, int], ...] = ()


EXPERIMENTS = {
    "paper_fixed": Experiment(3000, (("fixed", "berteam"),)),
    "paper_coevolution": Experiment(8000, (("coevolution", "berteam"),), (("optimizer.protect_new", 500),)),
    "paper_comparison": Experiment(
        4000, tuple((o, s) for o in ("coevolution", "mapelites") for s in ("berteam", "mcaa"))
    ),
}


def reproduce(config: ReproduceConfig, text: str, folder: Path | None = None) -> float:
    """Trains, evaluates, compares and reports as configured; what is done is not done again. Returns NaN.

    Args:
        config: checked.
        text: the same as yaml, for the folder.
        folder: None has outputs/reproduce/<what>_<scale>.

    Raises:
        InputError: the folder holds something else, the seeds are none, or matplotlib is missing.
        RunError: a part failed.
        KeyboardInterrupt: it was interrupted; the same command goes on.
    """
    folder = folder or Path("outputs", "reproduce", f"{config.what}_{config.scale:g}")
    seeds = list(config.seeds)
    if not seeds or len(set(seeds)) < len(seeds) or not all(0 <= seed < 2**63 for seed in seeds):
        raise InputError(f"seeds must be different whole numbers >= 0 and < 2**63, one at least, but is {seeds}.")
    check_matplotlib()  # which the report needs at the very end
    begin(folder, config, text)
    written(folder)
    say(str(folder))
    work = Work(config, folder)
    runs = {
        algorithm: [work.trained(algorithm, seed) for seed in config.seeds] for algorithm in work.experiment.algorithms
    }
    every = [run for several in runs.values() for run in several]
    if config.what == "paper_comparison":
        work.compared(every)
    else:
        for run in every:
            work.evaluated(run)
    if config.what == "paper_fixed":
        work.played()
    work.reported(every)
    found = Reproduced(runs, folder / "tournament", folder / "comparison")
    write_table(folder / "paper.csv", COLUMNS["paper"], rows(config.what, found))
    show(folder, config)
    return math.nan


def begin(folder: Path, config: ReproduceConfig, text: str) -> None:
    """Makes ``folder`` ready.

    Raises:
        InputError: it holds another experiment, or cannot be written.
    """
    if (folder / CONFIG).exists():
        old = plain_config(folder)
        for key in ("what", "scale"):
            if old.get(key) != getattr(config, key):
                raise InputError(
                    f"out={folder} was begun with {key}={old.get(key)}, but {key} is {getattr(config, key)}; "
                    "choose another folder."
                )
    elif (folder / MANIFEST).exists():
        raise InputError(f"out={folder} holds a run; choose another folder.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_config(folder, text)
    except OSError as error:
        raise InputError(f"out={folder} cannot be written: {error.strerror or error}.") from error


@dataclass(frozen=True)
class Work:
    """The parts of an experiment, each in a folder of its own, each skipped where it is done.

    Attributes:
        config: of the command.
        folder: of the experiment.
    """

    config: ReproduceConfig
    folder: Path

    @property
    def experiment(self) -> Experiment:
        """What is reproduced."""
        return EXPERIMENTS[self.config.what]

    def scaled(self, number: int, least: int) -> int:
        """Returns the share of ``number`` that the scale tells, ``least`` at least."""
        return max(least, round(number * self.config.scale))

    def trained(self, algorithm: tuple[str, str], seed: int) -> Path:
        """Trains an algorithm with a seed; returns the folder of the run."""
        optimizer, selector = algorithm
        place = self.folder / "train" / f"{optimizer}_{selector}_seed{seed}"
        if not done(place):
            there = newest(place) >= 0
            words = [
                *(f"experiment={self.config.what}", f"selector={selector}", f"optimizer={optimizer}", f"seed={seed}"),
                *(f"epochs={self.scaled(self.experiment.epochs, 2)}", f"workers={self.config.workers}"),
                *(f"{key}={self.scaled(value, 1)}" for key, value in self.experiment.scaled),
                *("evaluation.games=0", f"on_exists={'resume' if there else 'overwrite'}"),
            ]
            train(*config_of("train", words), place)
        return place

    def evaluated(self, run: Path) -> None:
        """Evaluates a run."""
        if not done(run / EVALUATION):
            words = [f"workers={self.config.workers}", f"games_per_pair={self.scaled(GAMES_PER_PAIR, 2)}"]
            evaluate(*config_of("evaluate", [f"run={quoted(run)}", *words]), None)

    def played(self) -> None:
        """Lets the teams of fixed policies play for their Elos."""
        place = self.folder / "tournament"
        if not done(place):
            words = [f"games_per_pair={self.scaled(GAMES_PER_PAIR, 8)}", f"workers={self.config.workers}"]
            tournament(*config_of("tournament", [*words, going_on(place)]), place)

    def compared(self, runs: list[Path]) -> None:
        """Compares all ``runs``, anew where others were compared before."""
        place = self.folder / "comparison"
        same = (place / CONFIG).exists() and list(plain_config(place).runs) == [str(run) for run in runs]
        if not (same and done(place)):
            words = [
                *(f"runs=[{','.join(map(quoted, runs))}]", f"workers={self.config.workers}"),
                *(f"games={self.scaled(BETWEEN, 20)}", f"reference_games={self.scaled(AGAINST, 10)}"),
                going_on(place) if same else "on_exists=overwrite",
            ]
            compare(*config_of("compare", words), place)

    def reported(self, runs: list[Path]) -> None:
        """Writes the report of ``runs``."""
        words = [f"runs=[{','.join(map(quoted, runs))}]", "on_exists=overwrite"]
        if self.config.what == "paper_comparison":
            words.append(f"compare={quoted(self.folder / 'comparison')}")
        report(*config_of("report", words), self.folder / "report")


def done(folder: Path) -> bool:
    """Returns whether what goes into ``folder`` has been done, and of a run's evaluation, of its last epoch."""
    if not (folder / MANIFEST).exists():
        return False
    manifest = read_manifest(folder)
    if manifest["status"] != "done" or folder.name != EVALUATION:
        return manifest["status"] == "done"
    return bool(manifest["epoch"] == plain_config(folder.parent).epochs)


def going_on(folder: Path) -> str:
    """Returns the override that goes on with what was cut in ``folder``, or begins it."""
    return "on_exists=resume" if (folder / CONFIG).exists() else "on_exists=error"


def quoted(folder: Path) -> str:
    """Returns a path as an override takes it."""
    return "'" + str(folder).replace("'", "\\'") + "'"


def show(folder: Path, config: ReproduceConfig) -> None:
    """Prints the paper's numbers beside ours, and what lies where."""
    table = pd.read_csv(folder / "paper.csv").rename(columns={"low": "here_low", "high": "here_high"})
    title = f"{config.what}, scale {config.scale:g}, seeds {json.dumps(list(config.seeds))}"
    console().print(printed(title, narrow(table)))
    if config.scale < 1:
        say("A smaller scale than 1 trains for less than the paper; its numbers are not the paper's.")
    page = Path("report", "report.html")
    end(folder, ["paper.csv", str(page)], f"open {folder / page} in a browser")
