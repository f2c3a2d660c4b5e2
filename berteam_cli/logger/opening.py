"""From a checked config to a logger, and from an epoch to the figures that it takes."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from berteam_cli.config_groups import LoggerConfig
from berteam_cli.errors import InputError
from berteam_cli.evaluation.sight import Sight
from berteam_cli.logger.base import FAILED, FINISHED, KILLED, Logger, Once
from berteam_cli.logger.csv import Nowhere
from berteam_cli.training import Parts, Report, Run

EXTRAS = ("wandb", "mlflow")


def check_logger(config: LoggerConfig) -> None:
    """Checks that what the logger needs is installed.

    Raises:
        InputError: it is not.
    """
    if config.name in EXTRAS and find_spec(config.name) is None:
        raise InputError(
            f"logger={config.name} needs the package {config.name}, which is not installed: "
            f"pip install 'berteam-cli[{config.name}]'."
        )


@contextmanager
def logger(config: LoggerConfig, folder: Path, manifest: Mapping[str, Any], told: Mapping[str, Any]) -> Iterator[Once]:
    """Yields where the figures of a run go beside its tables.

    Args:
        config: checked.
        folder: of the run.
        manifest: of the run; when it was started first tells it from others.
        told: every value of the run's config.
    """
    settings = asdict(config)
    name = settings.pop("name")
    identity = hashlib.sha256(f"{manifest['started']} {folder.absolute()}".encode()).hexdigest()[:12]
    opened: Logger = Nowhere()
    if name == "tensorboard":
        from berteam_cli.logger.tensorboard import Tensorboard  # noqa: PLC0415 (start-up)

        opened = Tensorboard(folder)
    elif name == "wandb":
        from berteam_cli.logger.wandb import Wandb  # noqa: PLC0415 (an extra)

        opened = Wandb(folder, identity, told, **settings)
    elif name == "mlflow":
        from berteam_cli.logger.mlflow import Mlflow  # noqa: PLC0415 (an extra)

        opened = Mlflow(folder, identity, told, **settings)
    ended = FAILED
    try:
        yield Once(opened)
        ended = FINISHED
    except KeyboardInterrupt:
        ended = KILLED
        raise
    finally:
        opened.close(ended)


def figures_of(
    run: Run, report: Report, parts: Parts, state: Mapping[str, float], sight: Sight | None = None
) -> dict[str, float]:
    """Returns the figures of an epoch under the names that loggers show; NaN where there is none.

    Args:
        run: after the epoch.
        report: of the epoch.
        parts: of the run.
        state: of the selector after it: effective_teams, entropy, exploitability.
        sight: what was seen of it against fixed teams; None where it was not looked at.
    """
    seconds, games = report.seconds, len(report.outcomes.lineups) + len(report.met.teams)
    figures = {f"timing/{name}": value for name, value in seconds.items()}
    if seconds.get("play_s"):
        steps = int(report.outcomes.steps.sum() + report.met.outcomes.steps.sum())  # without those of probing games
        figures |= {"play/games_per_s": games / seconds["play_s"], "play/steps_per_s": steps / seconds["play_s"]}
    selecting = report.selecting
    figures |= {
        "selector/loss": selecting.loss,
        "selector/updates": selecting.updates,
        "selector/buffer": selecting.buffer,
    }
    figures |= {f"selector/{name}": value for name, value in state.items()}
    fitness = parts.optimizer.fitness.shown(run.population.fitness)
    for island in (x for x in parts.optimizer.islands if not x.exploits):  # these are not rated
        members = fitness[island.members]
        figures |= {f"fitness/{island.name}": members.mean(), f"fitness/{island.name}_best": members.max()}
    figures |= {"population/replaced": len(report.replaced)}
    for algorithm in dict.fromkeys(parts.optimizer.islands[i].learner.algorithm for i, _ in report.learnt):
        learnt = [x for i, x in report.learnt if parts.optimizer.islands[i].learner.algorithm == algorithm]
        for name in ("loss", "entropy"):
            known = [value for x in learnt if not math.isnan(value := getattr(x, name))]
            figures[f"learning/{algorithm}_{name}"] = float(np.mean(known)) if known else math.nan
    return figures | seen(sight)


def seen(sight: Sight | None) -> dict[str, float]:
    """Returns the figures of a look at the run, none where there was no look."""
    return {} if sight is None else sight.figures()
