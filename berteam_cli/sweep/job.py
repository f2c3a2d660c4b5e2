"""One job of a sweep, in whatever process a launcher put it."""

from __future__ import annotations

import math
import sys
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from berteam_cli.errors import InputError, RunError, shown
from berteam_cli.folder import ERROR, MANIFEST, Manifest
from berteam_cli.sweep.folder import LOCKS, STOP, Sweep, with_job, working, write_table
from berteam_cli.workers import available_cores


def swept(task: Callable[[], float], folder: Path, overrides: list[str], *, alone: bool) -> float:
    """Runs one job of a sweep; an error ends the job and not the sweep, an interrupt ends both.

    Args:
        task: the job; returns the expected Elo.
        folder: of the job, in the sweep's folder.
        overrides: what tells this job from the others.
        alone: whether a process of its own runs it: then an interrupt is left for the sweep to find.

    Returns:
        The expected Elo, NaN if the job failed or was not begun.

    Raises:
        KeyboardInterrupt: the job was interrupted and is not alone.
    """
    stop = folder.parent / LOCKS / STOP
    if stop.exists():
        return math.nan
    figure, status, error = math.nan, "refused", ""
    try:
        with working(folder):
            write_table(folder.parent)
            try:
                figure, status = task(), "done"
            except InputError as refused:
                error = str(refused)
            except RunError as failure:
                status, error = "failed", str(failure)
            except KeyboardInterrupt:
                status = "interrupted"
                stop.touch()
            except Exception as failure:  # a mistake of ours must not cost the other jobs
                status, error = "failed", f"{type(failure).__name__}: {failure} (traceback in {folder / ERROR})."
                (folder / ERROR).write_text(traceback.format_exc(), encoding="utf-8")
            manifest = manifest_of(folder, status)
            if status == "failed":
                manifest.add(status=status)
            manifest.add(overrides=overrides, error=error)
    except InputError as busy:
        error = str(busy)
    if error:
        print(told(folder.name, overrides, error), file=sys.stderr, flush=True)
    write_table(folder.parent)
    if status == "interrupted" and not alone:
        raise KeyboardInterrupt
    return figure


def manifest_of(folder: Path, status: str) -> Manifest:
    """Returns the manifest of the job in ``folder``, which begins with ``status`` if there is none.

    What had begun keeps its status: it may still go on.

    Raises:
        InputError: it cannot be read.
    """
    return Manifest.of(folder) if (folder / MANIFEST).exists() else Manifest.begun(folder, status=status)


def told(job: str | int, overrides: list[str], error: str) -> str:
    """Returns the line that tells of a job that failed."""
    return shown(f"berteam: job {job} ({' '.join(overrides)}): {error}")


def cores_each(launcher: Mapping[str, Any], jobs: int) -> int:
    """Returns how many cores a job of ``jobs`` may use where it runs, so that those at once do not fight.

    Args:
        launcher: the settings of Hydra's launcher.
        jobs: that it runs in all.
    """
    cores, name = available_cores(), str(launcher["_target_"]).rpartition(".")[2]
    if name == "JoblibLauncher":
        asked = int(launcher["n_jobs"])
        at_once = asked if asked > 0 else max(1, cores + 1 + asked)  # -1: all, -2: all but one
        return max(1, cores // min(at_once, jobs))
    if name == "LocalLauncher":  # submitit begins all at once, on this machine
        return int(launcher["cpus_per_task"] or max(1, cores // jobs))
    if name == "SlurmLauncher":  # which gives a task one core if nothing is said
        return min(cores, int(launcher["cpus_per_task"] or 1))
    if name == "RayLauncher":
        return max(1, min(cores, int(launcher["ray"]["remote"].get("num_cpus", 1))))
    return cores


def in_sweep(folder: Path, command: str, overrides: list[str], sweeper: Mapping[str, Any]) -> int:
    """Makes sure that the job of ``folder`` is one of its sweep's, and returns how many of them run at most at once.

    Args:
        folder: of the job.
        command: that it is of.
        overrides: of the job.
        sweeper: the settings of Hydra's sweeper.
    """
    with_job(folder.parent, command, int(folder.name), overrides)
    sweep = Sweep.read(folder.parent)
    jobs = int(sweep.search["at_once"]) if sweep.search else len(sweep.jobs)
    return min(jobs, int(sweeper.get("max_batch_size") or jobs))
