"""The configuration: its schemas by the names that the yaml files give them, and the check of a whole.

Schemas have types and bounds, no values; the values stand in conf/, one yaml for each choice.
"""

from __future__ import annotations

import functools
import re
from dataclasses import fields
from typing import Any

from hydra.core.config_store import ConfigStore
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from berteam_cli import config_commands, config_env, config_groups, config_members
from berteam_cli.bounds import check_bounds
from berteam_cli.errors import InputError, did_you_mean

MODULES = (config_env, config_members, config_groups, config_commands)
"""Where schemas are."""

SCHEMAS: dict[str, dict[str, type]] = {
    "env": {
        "mctf": config_env.MctfConfig,
        "rps": config_env.RpsConfig,
        "pettingzoo": config_env.PettingzooConfig,
    },
    "selector": {
        "uniform": config_groups.UniformConfig,
        "mcaa": config_groups.McaaConfig,
        "berteam": config_groups.BerteamConfig,
        "best_members": config_groups.BestMembersConfig,
        "best_team": config_groups.BestTeamConfig,
        "assessor": config_groups.AssessorConfig,
        "psro": config_groups.PsroConfig,
    },
    "optimizer": {
        "fixed": config_groups.FixedOptimizerConfig,
        "coevolution": config_groups.CoevolutionConfig,
        "mapelites": config_groups.MapElitesConfig,
    },
    "learner": {
        "fixed": config_members.FixedLearnerConfig,
        "ppo": config_members.PpoConfig,
        "dqn": config_members.DqnConfig,
        "sb3": config_members.Sb3Config,
    },
    "population": {"islands": config_members.PopulationConfig},
    "opponents": {
        "none": config_env.OpponentsConfig,
        "past": config_env.PastConfig,
        "scripted": config_env.ScriptedConfig,
        "league": config_env.LeagueConfig,
    },
    "evaluation": {"truth": config_groups.EvaluationConfig},
    "logger": {
        "csv": config_groups.LoggerConfig,
        "tensorboard": config_groups.LoggerConfig,
        "wandb": config_groups.WandbConfig,
        "mlflow": config_groups.MlflowConfig,
    },
    "curriculum": {"none": config_env.CurriculumConfig, "starts": config_env.CurriculumConfig},
    "command": {
        "train": config_commands.TrainConfig,
        "tournament": config_commands.TournamentConfig,
        "replay": config_commands.ReplayConfig,
        "evaluate": config_commands.EvaluateConfig,
        "compare": config_commands.CompareConfig,
        "reproduce": config_commands.ReproduceConfig,
        "report": config_commands.ReportConfig,
    },
}


@functools.cache  # Hydra keeps them as long as the process
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
        schema = next(getattr(x, unknown[2]) for x in MODULES if hasattr(x, unknown[2]))
        known = [item.name for item in fields(schema)]
        near = did_you_mean(unknown[1], known)
        return f"{key} is no key here; there are {', '.join(known)}.{near}"
    if key and "missing mandatory value" in said:
        return f"{key} must be given."
    return f"{key}: {said}." if key else f"{said}."
