"""berteam train: one run from a checked config to its tables."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable
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
    before, sizes, done = (saved.seconds, saved.table_sizes, saved.run.epoch) if saved else (0.0, None, 0)
    handed = deque([saved.run] if saved else [])  # who takes it lets go of it in time: what was loaded may be large
    del saved

    def took() -> float:
        return before + time.monotonic() - started

    if not handed:
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
        if handed:
            log.info("Going on after epoch %d of %d.", done, config.epochs)
        manifest = (Manifest.resumed if handed else Manifest.begun)(folder, seed=config.seed)
        if against:
            manifest.add(trained_against="; ".join(against))
        if origin := next((x.origin for x in parts.optimizer.islands if x.origin), None):
            manifest.add(members_of=f"{origin.run} after epoch {origin.epoch}")
            log.info("Members of %s after epoch %d, who learn nothing more.", origin.run, origin.epoch)
        with manifest.until_the_end(), stoppable(folder.parent / LOCKS / STOP) as stop:
            told: Any = OmegaConf.to_container(OmegaConf.create(text))
            with logger(config.logger, folder, manifest.facts, told) as also:
                run, recorder = trained(config, folder, parts, handed, sizes, took, stop, also)
                expected = conclude(config.evaluation, folder, run, recorder, manifest, took)
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
    config: TrainConfig,
    folder: Path,
    parts: Parts,
    handed: deque[Run],
    sizes: dict[str, int] | None,
    took: Callable[[], float],
    stop: Stop,
    also: Once,
) -> tuple[Run, Recorder]:
    """Runs the epochs; returns the run after the last one, and what recorded it.

    Args:
        config: of the run.
        folder: of the run.
        parts: of the run.
        handed: the run to go on with, taken from there; empty: it begins.
        sizes: bytes of each growing table of that run.
        took: returns the seconds that it has taken.
        stop: whether it is to end.
        also: where its figures go beside its tables.
    """
    watching = watched(config, parts)
    tables = Tables(folder, sizes, also_growing(parts, watched=watching is not None))
    recorder = Recorder(tables, parts, config.record_every, Exploiting(parts, config.payoff_steps), watching)
    anew = not handed
    run = begin(parts) if anew else handed.pop()
    run = replace(run, league=pool.on_disk(run.league, folder / pool.POOL))

    def keep() -> None:
        also.logger.flush()
        checkpoint.save(folder, Saved(run, tables.sizes(), took()), parts)

    for name in END_TABLES:
        (folder / f"{name}.csv").unlink(missing_ok=True)  # of an earlier end of this run
    distribution, sight = None, None
    if anew:
        distribution, sight = recorder.state(run), recorder.watched(run)
        also(run.epoch, seen(sight))
        keep()
    pace = Pace(run.epoch, config.epochs)
    view = View(parts, config.epochs, pace, run)
    view.tell(run, tables.rows("generations"), distribution, sight)
    with shown(view), stop.epochs():
        while run.epoch < config.epochs:
            run, report = epoch(run, parts)
            run = replace(run, league=pool.on_disk(run.league, folder / pool.POOL))
            state, distribution, sight = recorder.epoch(run, report)
            also(run.epoch, figures_of(run, report, parts, state, sight))
            pace.tell(run.epoch, config.games_per_epoch)
            view.tell(run, len(report.replaced), distribution, sight)
            asked = stop.wanted()  # later than this it ends after the next epoch
            if asked or run.epoch == config.epochs or run.epoch % config.checkpoint_every == 0:
                keep()
            if asked:
                tables.close()
                raise KeyboardInterrupt
    if stop.wanted():  # since the last epoch was saved
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
