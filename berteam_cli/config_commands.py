"""Schemas of the commands: the top level of each command's yaml."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from omegaconf import MISSING

from berteam_cli.bounds import choice, number, number_or
from berteam_cli.config_env import CurriculumConfig, EnvConfig, OpponentsConfig
from berteam_cli.config_groups import EvaluationConfig, LoggerConfig, OptimizerConfig, SelectorConfig
from berteam_cli.config_members import LearnerConfig, PopulationConfig

RAY = "ray"
"""Who plays, if not so many threads."""


@dataclass
class CommandConfig:
    """What every command that writes a folder has."""

    seed: int = number(0, 2**63 - 1)
    team_size: int = number(1, 512)
    out: str | None = MISSING
    on_exists: str = choice("error", "overwrite", "resume")
    workers: Any = number_or(RAY, 0, 4096)  # noqa: RUF009 (it declares)
    env: EnvConfig = MISSING


@dataclass
class TrainConfig(CommandConfig):
    """Settings of ``berteam train``."""

    epochs: int = number()
    games_per_epoch: int = number(1)
    device: str = choice("cpu", "cuda", "auto")
    record_every: int = number(1)
    payoff_steps: int = number()
    checkpoint_every: int = number(1)
    evaluate_every: int = number()
    evaluate_teams: int = number(1, 1000)
    selector: SelectorConfig = MISSING
    optimizer: OptimizerConfig = MISSING
    population: PopulationConfig = MISSING
    learner: LearnerConfig = MISSING
    evaluation: EvaluationConfig = MISSING
    logger: LoggerConfig = MISSING
    curriculum: CurriculumConfig = MISSING
    opponents: OpponentsConfig = MISSING


@dataclass
class SprtConfig:
    """Settings of evaluation/sequential.py."""

    rounds: int = number(1)
    elo0: float = number(-2000, 2000)
    elo1: float = number(-2000, 2000)
    alpha: float = number(0, 0.5, open_low=True)
    beta: float = number(0, 0.5, open_low=True)


@dataclass
class TournamentConfig(CommandConfig):
    """Settings of ``berteam tournament``."""

    run: Any = MISSING
    trust: Any = MISSING
    policies: list[str] = MISSING
    fixed: bool = MISSING
    teams: list[str] = MISSING
    top: int = number(1)
    games_per_pair: int = number(1)
    random_starts: bool = MISSING
    action_noise: float = number(0, 1)
    rating: str = choice("ml", "davidson", "paper")
    sprt: SprtConfig = field(default_factory=SprtConfig)


@dataclass
class ReplayConfig:
    """Settings of ``berteam replay``."""

    run: str | None = MISSING
    trust: Any = MISSING
    blue: str | None = MISSING
    red: str | None = MISSING
    seed: int = number(0, 2**63 - 1)
    format: str = choice("html", "gif", "both")
    out: str | None = MISSING
    on_exists: str = choice("error", "overwrite")
    team_size: int = number(1, 512)
    env: EnvConfig = MISSING


@dataclass
class OutputConfig:
    """What commands share that look at runs which are there."""

    seed: int = number(0, 2**63 - 1)
    workers: Any = number_or(RAY, 0, 4096)  # noqa: RUF009 (it declares)
    trust: Any = MISSING


@dataclass
class EvaluateConfig(OutputConfig):
    """Settings of ``berteam evaluate``."""

    run: str = MISSING
    games_per_pair: int = number(1)
    reference_teams: int = number(2)
    teams_at_most: int = number(2)
    aggression_games: int = number(1)
    replay_games: int = number(1)
    most: int = number()
    payoff_games: int = number(1)
    top: int = number(1)


@dataclass
class CompareConfig(OutputConfig):
    """Settings of ``berteam compare``."""

    runs: list[str] = MISSING
    games: int = number(1)
    reference_games: int = number(1)
    reference_teams: int = number(2)
    out: str | None = MISSING
    on_exists: str = choice("error", "overwrite", "resume")


@dataclass
class ReproduceConfig:
    """Settings of ``berteam reproduce``."""

    what: str = choice("paper_fixed", "paper_coevolution", "paper_comparison")
    scale: float = number(0, 1, open_low=True)
    seeds: list[int] = MISSING
    workers: Any = number_or(RAY, 0, 4096)  # noqa: RUF009 (it declares)
    out: str | None = MISSING


@dataclass
class ReportConfig:
    """Settings of ``berteam report``."""

    runs: list[str] = MISSING
    compare: str | None = MISSING
    trust: Any = MISSING
    seed: int = number(0, 2**63 - 1)
    out: str | None = MISSING
    on_exists: str = choice("error", "overwrite")
