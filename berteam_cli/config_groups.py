"""Schemas of what chooses, improves, rates and tells: selectors, optimizers, evaluation, loggers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from omegaconf import MISSING

from berteam_cli.bounds import choice, number


@dataclass
class SelectorConfig:
    """What every selector has."""

    name: str = MISSING
    fitness: str = choice("elo", "moving_average")
    exact_limit: int = number(1)
    valid_members: Any = MISSING  # a list for each place; OmegaConf takes no words beside numbers in it


@dataclass
class UniformConfig(SelectorConfig):
    """Settings of selector/uniform.py."""

    captain: str = choice("matching", "uniform")


@dataclass
class McaaConfig(SelectorConfig):
    """Settings of selector/mcaa.py."""

    learning_rate: float = number(open_low=True)
    train_every: int = number(1)
    top_fraction: float | None = number(0, 1, open_low=True)


@dataclass
class ListedConfig(SelectorConfig):
    """Settings of selector/listed.py, for selectors that choose from a list of teams."""

    explore: float = number(0, 1)


@dataclass
class BestMembersConfig(ListedConfig):
    """Settings of selector/best_members.py."""


@dataclass
class BestTeamConfig(ListedConfig):
    """Settings of selector/best_team.py."""

    candidates: int = number(1)
    games_per_rung: int = number(1)
    restart: bool = MISSING


@dataclass
class AssessorConfig(ListedConfig):
    """Settings of selector/assessor.py."""

    capacity: int = number(1)
    window: int = number(1)
    train_every: int = number(1)
    batch_size: int = number(1)
    minibatch_size: int = number(1)
    width: int = number(1, 8192)
    learning_rate: float = number(open_low=True)
    temperature: float = number()


@dataclass
class PsroConfig(ListedConfig):
    """Settings of selector/psro.py."""

    start: int = number(1)
    solver: str = choice("uniform", "nash", "replicator")
    gamma: float = number(0, 1)
    expand_every: int = number(1)
    candidates: int = number(1)
    capacity: int = number(2)
    half_life: float = number()


@dataclass
class ObservationsConfig:
    """What of the opponent BERTeam knows before it chooses; selector/observations.py."""

    use: str = choice("none", "self", "previous_game")
    stride: int = number(1)
    drop_input: float = number(0, 1)
    drop_player: float = number(0, 1)
    embed: str = choice("lstm", "mean", "attention")
    lstm_layers: int = number(1, 64)


@dataclass
class BerteamConfig(SelectorConfig):
    """Settings of selector/berteam.py."""

    captain: str = choice("matching", "uniform", "berteam")
    weighting: bool = MISSING
    weight_cap: float = number(open_low=True)
    noise_half_life: float = number()
    train_every: int = number(1)
    batch_size: int = number(1)
    minibatch_size: int = number(1)
    capacity: int = number(1)
    weight_half_life: float = number()
    draw_weight: float = number(0, 1)
    loss: str = choice("mlm", "l1")
    entropy_coef: float = number()
    entropy_clip: float = number(0, 1)
    opponents: str = choice("own", "average")
    reservoir: int = number(1)
    sharpening: float = number(1, 1000)
    learning_rate: float = number(open_low=True)
    averaging: float = number(0, 0.9999)
    layers: int = number(1, 64)
    width: int = number(1, 8192)
    heads: int = number(1, 1024)
    dropout: float = number(0, 0.99)
    position: str = choice("append", "add", "none")
    side: str = choice("shared", "token", "separate")
    dataset: str = choice("shared", "per_side")
    observations: ObservationsConfig = MISSING


@dataclass
class OptimizerConfig:
    """What every optimizer has."""

    name: str = MISSING
    fitness: str = choice("elo", "moving_average")
    captain_k: float = number()
    member_k: float = number()
    average_rate: float = number(0, 1, open_low=True)


@dataclass
class FixedOptimizerConfig(OptimizerConfig):
    """Settings of optimizer/fixed.py."""


@dataclass
class PerturbConfig:
    """Factors of optimizer/perturbing.py; 1 moves nothing."""

    learning_rate: float = number(1, 100)
    entropy_coef: float = number(1, 100)
    gamma: float = number(1, 100)
    reward: float = number(1, 100)


@dataclass
class CoevolutionConfig(OptimizerConfig):
    """Settings of optimizer/coevolution.py."""

    replacements: int = number()
    elites: int = number()
    protect_new: int = number()
    draw_protected: bool = MISSING
    perturb: PerturbConfig = MISSING
    mutation: float = number(0, 10)
    crossover: float = number(0, 1)


@dataclass
class BehaviourScalesConfig:
    """By what each of outcomes.BEHAVIOURS is divided before distances are taken."""

    aggression: float = number(open_low=True)
    advance: float = number(open_low=True)
    spread: float = number(open_low=True)


@dataclass
class ArchiveBinsConfig:
    """Cells of a grid along each of outcomes.BEHAVIOURS."""

    aggression: int = number(1, 1000)
    advance: int = number(1, 1000)
    spread: int = number(1, 1000)


@dataclass
class ArchiveRangesConfig:
    """Lowest and highest of each of outcomes.BEHAVIOURS that an archive tells apart."""

    aggression: list[float] = MISSING
    advance: list[float] = MISSING
    spread: list[float] = MISSING


@dataclass
class MapElitesConfig(CoevolutionConfig):
    """Settings of optimizer/mapelites.py."""

    radius: float = number(open_low=True)
    opponents: list[str] = MISSING
    probe_games: int = number(1)
    project_every: int = number(1)
    lambda_growth: float = number(1, 100)
    behaviours: list[str] = MISSING
    behaviour_scales: BehaviourScalesConfig = MISSING
    archive: str = choice("none", "grid", "cvt")
    archive_bins: ArchiveBinsConfig = MISSING
    archive_ranges: ArchiveRangesConfig = MISSING
    archive_cells: int = number(1, 1000)


@dataclass
class EvaluationConfig:
    """How the teams are rated when the training has ended; evaluation/truth.py."""

    games: int | None = number()
    games_per_pair: int = number(1)
    reference_teams: int = number(2)


@dataclass
class LoggerConfig:
    """Where the figures of an epoch go beside the tables; logger/."""

    name: str = MISSING


@dataclass
class WandbConfig(LoggerConfig):
    """Settings of logger/wandb.py."""

    project: str = MISSING
    mode: str = choice("offline", "online")


@dataclass
class MlflowConfig(LoggerConfig):
    """Settings of logger/mlflow.py."""

    experiment: str = MISSING
    tracking: str | None = MISSING
