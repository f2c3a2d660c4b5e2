"""Schemas of who plays: how members learn, on which islands they are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from omegaconf import MISSING

from berteam_cli.bounds import choice, number, open_dict


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
