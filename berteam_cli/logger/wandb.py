"""Weights & Biases, on the disk by default."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from berteam_cli.logger.base import FINISHED


class Wandb:
    """A run of Weights & Biases; it drops by itself what it was told of an epoch before."""

    def __init__(self, folder: Path, identity: str, config: Mapping[str, Any], project: str, mode: str) -> None:
        """Begins the run, or goes on with it.

        Args:
            folder: of the run; its files go into `wandb` there.
            identity: the same for all starts of a run.
            config: every value of the run.
            project: that it belongs to.
            mode: offline or online.
        """
        import wandb  # noqa: PLC0415 (an extra)

        self.run = wandb.init(
            dir=str(folder),
            id=identity,
            name=folder.name,
            config=dict(config),
            project=project,
            mode=mode,
            resume="allow" if mode == "online" else None,
            settings=wandb.Settings(console="off", silent=True),
        )

    def last(self) -> Mapping[str, int]:
        """Returns nothing: what is known stands elsewhere."""
        return {}

    def write(self, epoch: int, figures: Mapping[str, float]) -> None:
        """Adds the ``figures`` of an epoch."""
        self.run.log(dict(figures), step=epoch)

    def flush(self) -> None:
        """Does nothing: a process of its own writes."""

    def close(self, ended: str) -> None:
        """Ends the run; one that is not finished counts as failed."""
        self.run.finish(exit_code=int(ended != FINISHED))
