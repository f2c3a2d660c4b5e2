"""Schemas of what is played: games, how training games start, and against whom."""

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
class CurriculumConfig:
    """How training games start; curriculum.py."""

    random: float = number(0, 1)
    near_flag: float = number(0, 1)
    carrying: float = number(0, 1)
    near_flag_m: float = number(open_low=True)
    until: int = number()


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
