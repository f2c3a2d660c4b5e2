"""One job of a sweep as a launcher calls it, perhaps in a new process: so this imports nothing heavy by itself."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = "BasicLauncher"  # runs jobs in the process of the command, one after the other
LIBRARIES = ("OMP", "OPENBLAS", "MKL", "NUMBA")

Command = Callable[[Any, str, Path | None], float]


def perform_job(word: str, cfg: Any, said: Any, command_of: Callable[[str], Command]) -> float:
    """Runs one job of a sweep and returns what its command returns, NaN if it failed.

    Args:
        word: the command.
        cfg: the job's config, composed.
        said: Hydra's own config.
        command_of: finds the function of a command.
    """
    alone = not str(said.launcher._target_).endswith(HERE)
    if alone:  # several share a machine: what is loaded from here on computes with one thread, beside our workers
        for library in LIBRARIES:
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    from omegaconf import OmegaConf  # noqa: PLC0415

    from berteam_cli.compose import prepare  # noqa: PLC0415
    from berteam_cli.config import checked  # noqa: PLC0415
    from berteam_cli.sweep.job import cores_each, in_sweep, swept  # noqa: PLC0415

    prepare()
    folder, overrides = Path(said.runtime.output_dir), list(said.overrides.task)
    sys.argv = [f"berteam {word}", *overrides]  # what the run's manifest tells, wherever it runs
    at_once = in_sweep(folder, word, overrides, said.sweeper)

    def task() -> float:
        config, text = checked(cfg), OmegaConf.to_yaml(cfg, resolve=True)
        config.workers = config.workers or cores_each(said.launcher, at_once)
        return command_of(word)(config, text, folder)

    return swept(task, folder, overrides, alone=alone)
