"""The configuration: its schemas by the names that the yaml files give them, and the check of a whole.

Schemas have types and bounds, no values; the values stand in conf/, one yaml for each choice.
"""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Any

from hydra.core.config_store import ConfigStore
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from berteam_cli import config_commands, config_groups
from berteam_cli.bounds import check_bounds
from berteam_cli.config_commands import (
    CompareConfig,
    EvaluateConfig,
    ReplayConfig,
    ReportConfig,
    ReproduceConfig,
    TournamentConfig,
    TrainConfig,
)
from berteam_cli.config_groups import (
    AssessorConfig,
    BerteamConfig,
    BestMembersConfig,
    BestTeamConfig,
    CoevolutionConfig,
    DqnConfig,
    EvaluationConfig,
    FixedLearnerConfig,
    FixedOptimizerConfig,
    LoggerConfig,
    MapElitesConfig,
    McaaConfig,
    MctfConfig,
    MlflowConfig,
    PettingzooConfig,
    PopulationConfig,
    PpoConfig,
    PsroConfig,
    RpsConfig,
    Sb3Config,
    UniformConfig,
    WandbConfig,
)
from berteam_cli.errors import InputError, did_you_mean

SCHEMAS: dict[str, dict[str, type]] = {
    "env": {"mctf": MctfConfig, "rps": RpsConfig, "pettingzoo": PettingzooConfig},
    "selector": {
        "uniform": UniformConfig,
        "mcaa": McaaConfig,
        "berteam": BerteamConfig,
        "best_members": BestMembersConfig,
        "best_team": BestTeamConfig,
        "assessor": AssessorConfig,
        "psro": PsroConfig,
    },
    "optimizer": {"fixed": FixedOptimizerConfig, "coevolution": CoevolutionConfig, "mapelites": MapElitesConfig},
    "learner": {"fixed": FixedLearnerConfig, "ppo": PpoConfig, "dqn": DqnConfig, "sb3": Sb3Config},
    "population": {"islands": PopulationConfig},
    "evaluation": {"truth": EvaluationConfig},
    "logger": {"csv": LoggerConfig, "tensorboard": LoggerConfig, "wandb": WandbConfig, "mlflow": MlflowConfig},
    "command": {
        "train": TrainConfig,
        "tournament": TournamentConfig,
        "replay": ReplayConfig,
        "evaluate": EvaluateConfig,
        "compare": CompareConfig,
        "reproduce": ReproduceConfig,
        "report": ReportConfig,
    },
}


def register() -> None:
    """Puts the schemas where the yaml files name them: /schema/<group>/<name>."""
    store = ConfigStore.instance()
    for group, schemas in SCHEMAS.items():
        for name, schema in schemas.items():
            store.store(group=f"schema/{group}", name=name, node=schema)


def checked(config: DictConfig) -> Any:
    """Returns the composed ``config`` as objects of the schemas.

    Raises:
        InputError: a value is missing, of a wrong type or out of bounds.
    """
    try:
        objects = OmegaConf.to_object(config)
    except OmegaConfBaseException as error:
        raise InputError(one_line(error)) from error
    check_bounds(objects, "")
    return objects


def one_line(error: OmegaConfBaseException) -> str:
    """Returns what OmegaConf objects to, with the key, in one line."""
    said = str(error).splitlines()[0].rstrip(".")
    key = getattr(error, "full_key", None)
    if key and (unknown := re.fullmatch(r"Key '(.*)' not in '(\w+)'", said)):
        schema = getattr(config_groups, unknown[2], None) or getattr(config_commands, unknown[2])
        known = [item.name for item in fields(schema)]
        near = did_you_mean(unknown[1], known)
        return f"{key} is no key here; there are {', '.join(known)}.{near}"
    if key and "missing mandatory value" in said:
        return f"{key} must be given."
    return f"{key}: {said}." if key else f"{said}."
