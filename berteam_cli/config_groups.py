"""Schemas of the config groups: what a game, a selector, an optimizer, a learner, a population can be told."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from omegaconf import MISSING

from berteam_cli.bounds import choice, number, open_dict


@dataclass
class EnvConfig:
    """What every game has."""

    name: str = MISSING


@dataclass
class RewardWeightsConfig:
    """Weights of mctf.rewards.TERMS."""

    team_captured: float | None = MISSING
    opponents_captured: float | None = MISSING
    team_grabbed: float | None = MISSING
    opponents_grabbed: float | None = MISSING
    grabbed: float | None = MISSING
    dropped: float | None = MISSING
    carries: float | None = MISSING
    newly_tagged: float | None = MISSING
    tagged: float | None = MISSING
    tagged_carrier: float | None = MISSING
    tags: float | None = MISSING
    tags_carrier: float | None = MISSING
    wall_hit: float | None = MISSING
    nearer_m: float | None = MISSING
    won: float | None = MISSING
    lost: float | None = MISSING
    drawn: float | None = MISSING
    step: float | None = MISSING


@dataclass
class MctfConfig(EnvConfig):
    """Settings of env/mctf.py, for all versions of the rules; the meaning of each stands in mctf.rules."""

    profile: str = choice("pyquaticus-2024-06", "pyquaticus-2025-11", "clean")
    reward: str = MISSING
    reward_weights: RewardWeightsConfig = MISSING
    world_size_m: list[float] = MISSING
    flag_homes_m: Any = MISSING  # OmegaConf takes no whole numbers in lists of lists of floats
    flag_keepout_m: float = number()
    catch_radius_m: float = number(open_low=True)
    untag_radius_m: float | None = number(open_low=True)
    agent_radius_m: float = number()
    max_speed: float | None = number(open_low=True)
    tau_s: float = number(open_low=True)
    substeps: int = number(1)
    max_time_s: float = number(open_low=True)
    max_score: int = number(1)
    tagging_cooldown_s: float = number(open_low=True)
    dynamics: str | None = choice("heron_2024", "heron", "surveyor")
    accel_rule: str | None = choice("overshoot", "limit")
    turn_loss_rule: str | None = choice("subtract", "multiply")
    reverse_steering: bool | None = MISSING
    speed_is_mean: bool | None = MISSING
    first_kick: bool | None = MISSING
    pid_reset: bool | None = MISSING
    float32: bool | None = MISSING
    action_speed: str | None = choice("fixed", "share")
    missing_action: str | None = choice("heading", "stop")
    blue_side: str | None = choice("right", "left")
    starts: str | None = choice("quarter", "midway", "random")
    wall_rule: str | None = choice("bounce", "drive_back")
    oob_counts_as_tag: bool | None = MISSING
    wall_tags: bool | None = MISSING
    keepout_rule: str | None = choice("before", "after")
    stale_side: bool | None = MISSING
    grab_from_own_side: bool | None = MISSING
    tag_at_zero: bool | None = MISSING
    oob_may_tag: bool | None = MISSING
    capture_first_only: bool | None = MISSING
    untag_at_keepout: bool | None = MISSING
    tie_at_max: str | None = choice("red", "draw")
    clock_overruns: bool | None = MISSING
    obs_margin_m: float | None = number()
    obs_line_range: str | None = choice("half", "diagonal")
    obs_clipped: bool | None = MISSING
    field_points: str | None = choice("fixed", "scaled")
    field_point_reach_m: float | None = number(open_low=True)
    policy_version: str | None = choice("2024", "repaired", "2025")
    potential: float = number()
    potential_discount: float = number(0, 1)
    potential_tagged: float = number(-1, 1)
    team_share: float = number(0, 1)
    last_steps: int = number(1, 16)


@dataclass
class RpsConfig(EnvConfig):
    """Settings of env/rps.py."""

    sides: int = number(2, 8)


@dataclass
class PettingzooConfig(EnvConfig):
    """Settings of env/pettingzoo.py."""

    target: str | None = MISSING
    options: dict[str, Any] = field(default_factory=open_dict)
    teams: dict[str, list[str]] = field(default_factory=open_dict)
    max_steps: int = number(1, 1_000_000)
    score: str = MISSING


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
class LearnerConfig:
    """What every learner has."""

    name: str = MISSING


@dataclass
class FixedLearnerConfig(LearnerConfig):
    """Settings of learner/fixed.py."""

    policies: list[str] = MISSING


@dataclass
class PpoConfig(LearnerConfig):
    """Settings of learner/ppo.py."""

    network: list[int] = MISSING
    activation: str = choice("tanh", "relu")
    learning_rate: float = number(open_low=True)
    n_steps: int = number(1)
    minibatch_size: int = number(1)
    n_epochs: int = number(1)
    gamma: float = number(0, 1)
    gae_lambda: float = number(0, 1)
    clip_range: float = number(open_low=True)
    clip_range_vf: float | None = number(open_low=True)
    target_kl: float | None = number(open_low=True)
    entropy_coef: float = number()
    value_coef: float = number()
    max_grad_norm: float = number(open_low=True)
    normalize_advantage: bool = MISSING


@dataclass
class DqnConfig(LearnerConfig):
    """Settings of learner/dqn.py."""

    network: list[int] = MISSING
    activation: str = choice("tanh", "relu")
    learning_rate: float = number(open_low=True)
    buffer_size: int = number(1)
    batch_size: int = number(1)
    gamma: float = number(0, 1)
    n_steps: int = number(1, 10_000)
    train_freq: int = number(1)
    gradient_steps: int = number(-1)
    learning_starts: int = number()
    target_update_interval: int = number(1)
    tau: float = number(0, 1, open_low=True)
    exploration_initial: float = number(0, 1)
    exploration_final: float = number(0, 1)
    exploration_steps: int = number(1)
    max_grad_norm: float = number(open_low=True)


@dataclass
class Sb3Config(LearnerConfig):
    """Settings of learner/sb3.py."""

    algorithm: str = MISSING
    network: list[int] = MISSING
    activation: str | None = choice("tanh", "relu")
    schedule_steps: int = number(1)
    options: dict[str, Any] = field(default_factory=open_dict)


@dataclass
class IslandConfig:
    """One island of the population."""

    size: int = number(1, 100_000)
    learner: LearnerConfig = MISSING


@dataclass
class MemberConfig:
    """A member that acts by the network in a file of Stable-Baselines3; learner/imported.py.

    Attributes:
        file: path of the zip file.
        name: of the member; None: the file's name without its ending.
        trust: whether code in the file may run, where its plain part does not tell how the policy acts.
    """

    file: str = MISSING
    name: str | None = None
    trust: bool = False


@dataclass
class PopulationConfig:
    """The islands by name, members from files, who make one more, and a run whose islands come behind these."""

    islands: dict[str, IslandConfig] = MISSING
    members: list[MemberConfig] = field(default_factory=list)
    run: str | None = None


@dataclass
class CurriculumConfig:
    """How training games start; curriculum.py."""

    random: float = number(0, 1)
    near_flag: float = number(0, 1)
    carrying: float = number(0, 1)
    near_flag_m: float = number(open_low=True)
    until: int = number()


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


@dataclass
class OpponentsConfig:
    """Whom the population meets beside itself; the choice none has no settings."""

    name: str = MISSING


@dataclass
class PastConfig(OpponentsConfig):
    """Settings of opponents/past.py."""

    past_share: float = number(0, 1)
    snapshot_every: int = number(1)
    snapshot_members: int | None = number(1)
    pool_size: int = number(2)
    draw: str = choice("uniform", "prioritised")
    power: float = number(0, 100)
    mix_uniform: float = number(0, 1)
    prior_games: float = number(open_low=True)
    half_life: float = number()


@dataclass
class ScriptedConfig(OpponentsConfig):
    """Settings of opponents/scripted.py."""

    scripted_share: float = number(0, 1)
    scripted: list[str] = MISSING


@dataclass
class LeagueConfig(PastConfig, ScriptedConfig):
    """Settings of opponents/league.py, with those of opponents/exploiters.py."""

    exploiters: list[str] = MISSING
    exploit_share: float = number(0, 1)
    exploiter_epochs: int = number()
    exploiter_score: float = number(0, 1)
