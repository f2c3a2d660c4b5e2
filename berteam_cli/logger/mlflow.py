"""MLflow, in files of the run's folder by default."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from berteam_cli.stored import flat

FOLDER, TAG = "mlflow", "berteam.run"
ROOM = 100  # parameters that MLflow takes at once


class Mlflow:
    """A run of MLflow, found again by its tag."""

    def __init__(
        self, folder: Path, identity: str, config: Mapping[str, Any], experiment: str, tracking: str | None
    ) -> None:
        """Begins the run, or goes on with it.

        Args:
            folder: of the run.
            identity: the same for all starts of a run.
            config: every value of the run.
            experiment: that it belongs to.
            tracking: address of the server; None has files in `mlflow` in the folder.
        """
        from mlflow import MlflowClient  # noqa: PLC0415 (an extra)
        from mlflow.entities import Param  # noqa: PLC0415

        if tracking is None:
            os.environ.setdefault("MLFLOW_ALLOW_FILE_STORE", "true")  # MLflow 3 takes files only when asked twice
        self.client = MlflowClient(tracking_uri=tracking or (folder / FOLDER).absolute().as_uri())
        found = self.client.get_experiment_by_name(experiment)
        place = self.client.create_experiment(experiment) if found is None else found.experiment_id
        runs = self.client.search_runs([place], f"tags.`{TAG}` = '{identity}'")
        if runs:
            self.run = runs[0].info.run_id
            self.client.update_run(self.run, status="RUNNING")
            return
        made = self.client.create_run(place, tags={TAG: identity}, run_name=folder.name)
        self.run = made.info.run_id
        params = [Param(key, str(value)[:500]) for key, value in flat(config).items() if key]
        for k in range(0, len(params), ROOM):
            self.client.log_batch(self.run, params=params[k : k + ROOM])

    def last(self) -> Mapping[str, int]:
        """Returns the last epoch of each figure that the run holds."""
        names = self.client.get_run(self.run).data.metrics
        return {name: max(x.step for x in self.client.get_metric_history(self.run, name)) for name in names}

    def write(self, epoch: int, figures: Mapping[str, float]) -> None:
        """Adds the ``figures`` of an epoch."""
        from mlflow.entities import Metric  # noqa: PLC0415

        now = int(1000 * time.time())
        self.client.log_batch(self.run, metrics=[Metric(name, value, now, epoch) for name, value in figures.items()])

    def flush(self) -> None:
        """Does nothing: everything is written at once."""

    def close(self, ended: str) -> None:
        """Ends the run as it ``ended``."""
        self.client.set_terminated(self.run, status=ended.upper())
