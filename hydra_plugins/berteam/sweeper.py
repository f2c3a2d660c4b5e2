"""Hydra's door to berteam's sweeps. Hydra imports this at every start, so it imports nothing itself."""

from __future__ import annotations

from pathlib import Path

from hydra.core.config_loader import ConfigLoader
from hydra.core.plugins import Plugins
from hydra.plugins.launcher import Launcher
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig


class BerteamSweeper(Sweeper):
    """Runs the jobs in the sweep's folder that are not done, by whatever launcher was chosen."""

    launcher: Launcher
    loader: ConfigLoader
    config: DictConfig
    folder: Path

    def __init__(self, max_batch_size: int | None = None) -> None:
        """Takes how many jobs the launcher gets at once; None: all."""
        self.max_batch_size = max_batch_size

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Makes the launcher."""
        self.folder, self.config, self.loader = Path(config.hydra.sweep.dir), config, hydra_context.config_loader
        self.launcher = Plugins.instance().instantiate_launcher(
            hydra_context=hydra_context, task_function=task_function, config=config
        )

    def sweep(self, arguments: list[str]) -> None:
        """Runs what is not done; the jobs have their ``arguments`` in sweep.json already."""
        from berteam_cli.sweep.launching import run  # noqa: PLC0415

        run(
            self.folder,
            self.launcher,
            lambda words: self.loader.load_sweep_config(self.config, words),
            self.max_batch_size,
        )
