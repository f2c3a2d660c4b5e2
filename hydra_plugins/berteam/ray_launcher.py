"""Jobs of a sweep as tasks of Ray, with the settings of hydra-ray-launcher, which needs packages we do not.

A job whose process dies is told as failed, and the others go on.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, JobStatus, configure_log, filter_overrides, run_job, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf, open_dict

log = logging.getLogger(__name__)


class RayLauncher(Launcher):
    """Starts, or joins, a Ray cluster and gives it a task for each job."""

    config: DictConfig
    task_function: TaskFunction
    hydra_context: HydraContext

    def __init__(self, ray: DictConfig) -> None:
        """Takes ``init`` and ``remote``, the arguments of ray.init and ray.remote."""
        self.ray: Any = OmegaConf.to_container(ray, resolve=True)

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Takes what each job needs."""
        self.hydra_context, self.task_function, self.config = hydra_context, task_function, config

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Returns what each job returned, when all have ended."""
        import ray  # noqa: PLC0415 (an extra, and Hydra imports this file at every start)

        from berteam_cli.cluster import own_handler  # noqa: PLC0415

        setup_globals()
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        ours = not ray.is_initialized()
        if ours:
            with own_handler():
                ray.init(**self.ray["init"])
        try:
            task = ray.remote(**self.ray["remote"])(one_job)
            shared = ray.put((self.hydra_context, self.task_function, Singleton.get_state(), os.getcwd()))
            tasks = []
            for number, overrides in enumerate(job_overrides, start=initial_job_idx):
                log.info("\t#%d : %s", number, " ".join(filter_overrides(overrides)))
                config = self.hydra_context.config_loader.load_sweep_config(self.config, list(overrides))
                with open_dict(config):
                    config.hydra.job.id = config.hydra.job.num = number
                tasks.append(task.remote(shared, config))
            return [ended(task, ray) for task in tasks]
        finally:
            if ours:
                ray.shutdown()


def one_job(shared: tuple[HydraContext, TaskFunction, Any, str], config: DictConfig) -> JobReturn:
    """Runs one job, in a process of Ray's; what it names without a root is where the command was given."""
    context, task_function, singletons, place = shared
    if os.path.isdir(place):
        os.chdir(place)
    setup_globals()
    Singleton.set_state(singletons)
    HydraConfig.instance().set_config(config)
    return run_job(
        hydra_context=context,
        task_function=task_function,
        config=config,
        job_dir_key="hydra.sweep.dir",
        job_subdir_key="hydra.sweep.subdir",
    )


def ended(task: Any, ray: Any) -> JobReturn:
    """Returns what ``task`` returned; a failed job if its process died."""
    try:
        return ray.get(task)
    except ray.exceptions.RayError as error:
        log.error("A job's process ended without a word: %s", str(error).splitlines()[0])
        failed = JobReturn()
        failed.status, failed.return_value = JobStatus.FAILED, error
        return failed
