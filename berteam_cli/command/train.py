"""berteam train: one run from a checked config to its tables."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from berteam_cli import build, checkpoint
from berteam_cli.checkpoint import Saved
from berteam_cli.command.inspect import show
from berteam_cli.config_commands import TrainConfig
from berteam_cli.errors import InputError
from berteam_cli.evaluation.ending import END_TABLES, conclude
from berteam_cli.evaluation.exploiting import Exploiting
from berteam_cli.evaluation.reference import reference
from berteam_cli.evaluation.watching import Watching
from berteam_cli.folder import Manifest, claim, logging_to, new_folder, newest
from berteam_cli.founding import discounts
from berteam_cli.holding import held
from berteam_cli.live import View, shown
from berteam_cli.logger.base import Once
from berteam_cli.logger.opening import check_logger, figures_of, logger, seen
from berteam_cli.memory import spoken, state_bytes
from berteam_cli.opponents import pool
from berteam_cli.pace import Pace
from berteam_cli.recording import Recorder, also_growing
from berteam_cli.records import Tables
from berteam_cli.stopping import Stop, stoppable
from berteam_cli.stored import check_same, checkpointed, goes_on, write_config
from berteam_cli.sweep.folder import LOCKS, STOP
from berteam_cli.training import Parts, Run, begin, epoch

log = logging.getLogger("berteam")


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
    folder = folder or new_folder("train")
    check_logger(config.logger)
    parts = build.parts(config, stored=checkpointed(config, folder))
    with held(folder):
        expected = held_run(config, text, folder, parts)
    show(folder, 10)
    return expected


def held_run(config: TrainConfig, text: str, folder: Path, parts: Parts) -> float:
    """Trains in a ``folder`` that this process holds; see ``train``."""
    started = time.monotonic()
    saved = resumed(config, text, folder, parts)
    if saved is None:
        claim(folder, "overwrite" if goes_on(config, folder) else config.on_exists)
    write_config(folder, text)
    with logging_to(folder):
        state = sum(state_bytes(island) for island in parts.optimizer.islands)
        played = sum(column.nbytes for column in parts.room or ())
        for remark in (*parts.selector.remarks(), *discounts(parts.optimizer, parts.games.env)):
            log.info("%s", remark)
        seen_by = f", {spoken(parts.selector.seen_bytes)} of what winners saw" if parts.selector.observes else ""
        words = "Memory: %s of members' weights and buffers, %s of an epoch's games%s."
        log.info(words, spoken(state), spoken(played), seen_by)
        if against := parts.opponents.remarks():
            log.info("Trained against %s, beside teams of the population.", "; ".join(against))
        if saved:
            log.info("Going on after epoch %d of %d.", saved.run.epoch, config.epochs)
        manifest = (Manifest.resumed if saved else Manifest.begun)(folder, seed=config.seed)
        if against:
            manifest.add(trained_against="; ".join(against))
        if origin := next((x.origin for x in parts.optimizer.islands if x.origin), None):
            manifest.add(members_of=f"{origin.run} after epoch {origin.epoch}")
            log.info("Members of %s after epoch %d, who learn nothing more.", origin.run, origin.epoch)
        with manifest.until_the_end(), stoppable(folder.parent / LOCKS / STOP) as stop:
            told: Any = OmegaConf.to_container(OmegaConf.create(text))
            with logger(config.logger, folder, manifest.facts, told) as also:
                run, recorder = trained(config, folder, parts, saved, started, stop, also)
                before = saved.seconds if saved else 0.0
                expected = conclude(
                    config.evaluation, folder, run, recorder, manifest, lambda: before + time.monotonic() - started
                )
                also(run.epoch, {"elo/expected": expected})
    return expected


def resumed(config: TrainConfig, text: str, folder: Path, parts: Parts) -> Saved | None:
    """Returns the checkpoint to go on from, or None where the run begins anew, as one must that ended before its first.

    Raises:
        InputError: the folder's run was made with other settings, or is further than the config wants it.
        RunError: it has no whole checkpoint.
    """
    if not goes_on(config, folder):
        return None
    checkpoint.check_schema(folder)
    check_same(folder, text)
    if newest(folder) < 0:
        return None
    saved = checkpoint.load(folder, parts)
    done = saved.run.epoch
    if done > config.epochs:
        raise InputError(f"epochs must be >= {done}, which {folder} has done already, but is {config.epochs}.")
    return saved


def trained(
    config: TrainConfig, folder: Path, parts: Parts, saved: Saved | None, started: float, stop: Stop, also: Once
) -> tuple[Run, Recorder]:
    """Runs the epochs; returns the run after the last one, and what recorded it."""
    watching = watched(config, parts)
    sizes = saved.table_sizes if saved else None
    tables = Tables(folder, sizes, also_growing(parts, watched=watching is not None))
    recorder = Recorder(tables, parts, config.record_every, Exploiting(parts, config.payoff_steps), watching)
    seconds = saved.seconds if saved else 0.0
    run = saved.run if saved else begin(parts)
    run = replace(run, league=pool.on_disk(run.league, folder / pool.POOL))

    def keep() -> None:
        also.logger.flush()
        checkpoint.save(folder, Saved(run, tables.sizes(), seconds + time.monotonic() - started), parts)

    for name in END_TABLES:
        (folder / f"{name}.csv").unlink(missing_ok=True)  # of an earlier end of this run
    distribution, sight = None, None
    if saved is None:
        distribution, sight = recorder.state(run), recorder.watched(run)
        also(run.epoch, seen(sight))
        keep()
    pace = Pace(run.epoch, config.epochs)
    view = View(parts, config.epochs, pace, run)
    view.tell(run, tables.rows("generations"), distribution, sight)
    with shown(view):
        while run.epoch < config.epochs:
            stop.in_epoch = True
            run, report = epoch(run, parts)
            run = replace(run, league=pool.on_disk(run.league, folder / pool.POOL))
            state, distribution, sight = recorder.epoch(run, report)
            also(run.epoch, figures_of(run, report, parts, state, sight))
            pace.tell(run.epoch, config.games_per_epoch)
            view.tell(run, len(report.replaced), distribution, sight)
            asked = stop.wanted()  # later than this it ends after the next epoch
            if asked or run.epoch == config.epochs or run.epoch % config.checkpoint_every == 0:
                keep()
            stop.in_epoch = False
            if asked:
                tables.close()
                raise KeyboardInterrupt
    also(run.epoch, seen(recorder.last(run)))
    tables.close()
    return run, recorder


def watched(config: TrainConfig, parts: Parts) -> Watching | None:
    """Returns how the run is looked at while it goes on, None where it is not.

    Where the Elos of the fixed teams are not shipped, they play for them now.
    """
    if not config.evaluate_every:
        return None
    opponents = reference(parts.games, config.evaluation.reference_teams)
    return Watching(parts, config.evaluate_every, config.evaluate_teams, opponents)
