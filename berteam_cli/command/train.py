"""berteam train: one run from a checked config to its tables."""

from __future__ import annotations

import logging
import math
import resource
import signal
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from berteam_cli import build, checkpoint
from berteam_cli.checkpoint import Saved
from berteam_cli.command.inspect import show
from berteam_cli.config import TrainConfig
from berteam_cli.errors import RunError
from berteam_cli.evaluation.reference import Reference, reference, reference_teams
from berteam_cli.evaluation.truth import Truth, choose_teams, truth
from berteam_cli.folder import CONFIG, Manifest, claim, logging_to, new_folder
from berteam_cli.population import Population, names, policies
from berteam_cli.recording import Recorder
from berteam_cli.records import COLUMNS, Tables, team_name, team_names, write_table
from berteam_cli.training import EVALUATION, Parts, Run, begin, epoch, generator

log = logging.getLogger("berteam")


@dataclass
class Stop:
    """Whether somebody asked the run to end."""

    asked: bool = False


def train(config: TrainConfig, text: str, folder: Path | None = None) -> float:
    """Trains as configured and returns the expected Elo of the selector's choice, NaN if no team was rated.

    Args:
        config: checked.
        text: the same as yaml, for the run folder.
        folder: of the run; None makes one.

    Raises:
        InputError: the config does not go together, or the folder is not free.
        RunError: the run could not go on.
        KeyboardInterrupt: it was interrupted; its state is saved.
    """
    started = time.monotonic()
    parts = build.parts(config)
    folder = folder or new_folder("train")
    saved = resumed(config, text, folder, parts)
    if saved is None:
        claim(folder, config.on_exists)
        (folder / CONFIG).write_text(text, encoding="utf-8")
    with logging_to(folder):
        log.info("%s", folder)
        manifest = Manifest(folder, seed=config.seed, resumed_at=saved.run.epoch if saved else None)
        try:
            with stoppable() as stop:
                expected = trained(config, folder, parts, manifest, saved, started, stop)
        except KeyboardInterrupt:
            manifest.end("interrupted")
            log.info("Interrupted. Go on with: berteam resume %s", folder)
            raise
        except Exception as error:
            manifest.end("failed")
            (folder / "error.txt").write_text(traceback.format_exc(), encoding="utf-8")
            raise RunError(
                f"The run failed: {type(error).__name__}: {error}. The traceback is in {folder / 'error.txt'}; "
                f"go on from the last checkpoint with: berteam resume {folder}"
            ) from error
        manifest.end("done")
    show(folder, 10)
    return expected


def resumed(config: TrainConfig, text: str, folder: Path, parts: Parts) -> Saved | None:
    """Returns the checkpoint to go on from, or None where the run begins anew.

    Raises:
        InputError: the folder's run was made with other settings.
        RunError: it has no whole checkpoint.
    """
    if config.on_exists != "resume" or not (folder / CONFIG).exists():
        return None
    from berteam_cli.command.resume import check_same  # noqa: PLC0415 (it imports this module)

    check_same(folder, text)
    return checkpoint.load(folder, parts)


def trained(
    config: TrainConfig,
    folder: Path,
    parts: Parts,
    manifest: Manifest,
    saved: Saved | None,
    started: float,
    stop: Stop,
) -> float:
    """Runs the epochs and the evaluation; returns the expected Elo."""
    tables = Tables(folder, saved.table_sizes if saved else None)
    recorder = Recorder(tables, parts, config.record_every, config.record_teams)
    before = saved.seconds if saved else 0.0
    run = saved.run if saved else begin(parts)
    if saved is None:
        recorder.first(run)
    pace = Pace(run.epoch, config.epochs)
    while run.epoch < config.epochs:
        run, report = epoch(run, parts)
        last = run.epoch == config.epochs
        recorder.epoch(run, report, last=last)
        pace.tell(run, config)
        if last or stop.asked or run.epoch % config.checkpoint_every == 0:
            seconds = before + time.monotonic() - started
            checkpoint.save(folder, Saved(run, tables.sizes(), seconds), parts)
        if stop.asked and not last:
            tables.close()
            raise KeyboardInterrupt
    tables.close()
    if recorder.distribution(run).samples:
        manifest.add(team_distribution="sampled; the rows `other` hold the rest")
    return evaluated(config, folder, parts, run, recorder, manifest, lambda: before + time.monotonic() - started)


def evaluated(
    config: TrainConfig,
    folder: Path,
    parts: Parts,
    run: Run,
    recorder: Recorder,
    manifest: Manifest,
    seconds: Any,
) -> float:
    """Rates the teams, writes elo.csv and summary.csv, and returns the expected Elo."""
    settings, game = config.evaluation, parts.games.env
    opponents = len(reference_teams(len(game.fixed_policies), game.team_size, settings.reference_teams))
    each = opponents * settings.games_per_pair
    budget = run.played if settings.games is None else settings.games
    rng = generator(parts.seed, EVALUATION, run.epoch)
    distribution = recorder.distribution(run)
    chosen = choose_teams(distribution, each, budget, rng)
    log.info(
        "Rating %d of %d teams, %d games each, as evaluation.games=%s allows.",
        *(len(chosen[0]), len(distribution.teams), each, f"{budget:,}"),
    )
    if len(chosen[0]) == 0:
        known = Reference(np.zeros((0, game.team_size), dtype=np.int64), np.zeros(0), "none: no team was rated")
    else:
        known = reference(parts.games, settings.reference_teams)
    members = policies(parts.optimizer.islands, run.population, explore=False)
    rated = truth(parts.games, members, chosen, known, settings.games_per_pair, rng)
    manifest.add(
        evaluation={
            "teams": len(distribution.teams),
            "rated": len(rated.teams),
            "most_probable": int(rated.listed.sum()),
            "random_sample": int((~rated.listed).sum()),
            "reference": known.source,
        }
    )
    write_table(folder / "elo.csv", COLUMNS["elo"], elo_rows(parts, run.population, rated))
    expected, width = rated.expected_elo()
    best = int(np.argmax(rated.elos)) if len(rated.teams) else None
    row = (
        *(expected, expected - width, expected + width),
        *(("", math.nan) if best is None else (team_name(rated.teams[best]), rated.elos[best])),
        *(run.played, run.steps, round(seconds(), 3), peak_rss_mib()),
    )
    write_table(folder / "summary.csv", COLUMNS["summary"], [row])
    return expected


def elo_rows(parts: Parts, population: Population, rated: Truth) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of elo.csv, the strongest team first."""
    called = names(parts.optimizer.islands, population)
    predicted = rated.predicted_elos()
    order = np.argsort(-rated.elos, kind="stable")
    place = np.empty(len(order), dtype=int)
    place[np.argsort(-rated.probability, kind="stable")] = np.arange(1, len(order) + 1)
    for rank, k in enumerate(order, start=1):
        yield (
            *(team_names(rated.teams[[k]])[0], " + ".join(called[m] for m in rated.teams[k])),
            *(rated.elos[k], rated.elos[k] - rated.half_widths[k], rated.elos[k] + rated.half_widths[k]),
            *(rated.wins[k] + rated.draws[k] + rated.losses[k], rated.wins[k], rated.draws[k], rated.losses[k]),
            *(rated.probability[k], rank, predicted[k] if np.isfinite(predicted[k]) else math.nan, place[k]),
        )


def peak_rss_mib() -> float:
    """Returns the most memory this process has held, in MiB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (2**20 if sys.platform == "darwin" else 2**10), 1)


class Pace:
    """Tells how long the run will take, first after a few epochs and then now and then."""

    def __init__(self, done: int, epochs: int) -> None:
        """Starts with ``done`` of ``epochs`` epochs behind."""
        self.begun = self.told = time.monotonic()
        self.first, self.next, self.epochs = done, min(done + 3, epochs), epochs

    def tell(self, run: Run, config: TrainConfig) -> None:
        """Logs the time left, at most every ten seconds."""
        at = time.monotonic()
        if run.epoch < self.epochs and (run.epoch < self.next or (run.epoch > self.next and at - self.told < 10)):
            return
        each = (at - self.begun) / (run.epoch - self.first)
        left = each * (self.epochs - run.epoch)
        if run.epoch == self.next < self.epochs:
            log.info(
                "%d epochs of %d games: about %s (%.2f s an epoch so far).",
                *(self.epochs, config.games_per_epoch, spoken(left), each),
            )
        else:
            log.info("epoch %d of %d, %.2f s each, %s left", run.epoch, self.epochs, each, spoken(left))
        self.told = at


def spoken(seconds: float) -> str:
    """Returns a time as it is read: 40 s, 12 min, 3.4 h."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Lets the first Ctrl-C end the run after its epoch; the second ends it at once."""
    stop = Stop()

    def ask(number: int, frame: FrameType | None) -> None:
        if stop.asked:
            raise KeyboardInterrupt
        stop.asked = True
        log.info("Stopping after this epoch; once more to stop at once.")

    try:
        before = signal.signal(signal.SIGINT, ask)
    except ValueError:  # not the main thread: whoever owns it handles signals
        yield stop
        return
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)
