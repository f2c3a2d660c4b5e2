"""Gives a model of Stable-Baselines3 the steps of games that were played elsewhere, as its own loop would have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from berteam_cli.learner.rollout import Steps, seen, stitched
from berteam_cli.outcomes import Experience

LOGGED = {
    "train/loss": ("loss", 1.0),
    "train/policy_gradient_loss": ("policy_loss", 1.0),  # PPO
    "train/policy_loss": ("policy_loss", 1.0),  # A2C
    "train/policy_objective": ("policy_loss", -1.0),  # TRPO
    "train/value_loss": ("value_loss", 1.0),
    "train/entropy_loss": ("entropy", -1.0),
    "train/approx_kl": ("approx_kl", 1.0),  # PPO
    "train/kl_divergence_loss": ("approx_kl", 1.0),  # TRPO
    "train/clip_fraction": ("clip_fraction", 1.0),
}
"""What the algorithms log, our name for it and the factor between."""

Figures = dict[str, float]


def fed(
    model: BaseAlgorithm, experience: Experience, trajectories: list[tuple[int, int]], schedule_steps: int
) -> list[Figures]:
    """Lets a model learn from its trajectories, (game, player) in order; returns the figures of each of its updates.

    Args:
        model: of one member. Changed.
        experience: all games.
        trajectories: those of the member.
        schedule_steps: what the model takes for the length of its training, in steps.
    """
    if isinstance(model, OnPolicyAlgorithm):
        return fed_rollouts(model, judged(model, experience, trajectories), schedule_steps)
    figures = []
    for game, player in trajectories:
        figures += fed_replay(model, experience, game, player, schedule_steps)  # type: ignore[arg-type]
    return figures


def judged(model: OnPolicyAlgorithm, experience: Experience, trajectories: list[tuple[int, int]]) -> Steps:
    """Returns a member's new steps, with what its networks say of them before it learns from any."""
    what = seen(experience, trajectories)
    with torch.no_grad():
        actions = torch.tensor(what.actions, dtype=torch.int64)
        values, log_probs, _ = model.policy.evaluate_actions(torch.tensor(what.observations), actions)
    return stitched(what, values.flatten().numpy(), log_probs.numpy(), model.gamma)


def fed_rollouts(model: OnPolicyAlgorithm, new: Steps, schedule_steps: int) -> list[Figures]:
    """Fills the model's rollout buffer as ``OnPolicyAlgorithm.collect_rollouts`` does, and updates it when it is full.

    What is left over stays in the buffer. The first of the ``new`` steps begins a game, since games are whole.
    """
    buffer = model.rollout_buffer
    begins = np.concatenate([[True], new.ends[:-1]])
    figures = []
    for t in range(len(new.actions)):
        at = slice(t, t + 1)
        values, log_probs, after = (torch.from_numpy(x[at]) for x in (new.values, new.log_probs, new.next_values))
        buffer.add(new.observations[at], new.actions[at], new.rewards[at], begins[at], values, log_probs)
        model.num_timesteps += 1
        if buffer.full:
            buffer.compute_returns_and_advantage(after, new.ends[at])
            model._update_current_progress_remaining(model.num_timesteps, schedule_steps)
            model.train()
            buffer.reset()
            figures.append(total(model, renamed(model.logger.name_to_value)))
    return figures


def fed_replay(
    model: OffPolicyAlgorithm, experience: Experience, game: int, player: int, schedule_steps: int
) -> list[Figures]:
    """Stores one trajectory as ``OffPolicyAlgorithm.collect_rollouts`` does, and updates when ``learn`` would."""
    observations, actions = experience.observations[game, player], experience.actions[game, player]
    rewards, length = experience.rewards[game, player], int(experience.lengths[game])
    figures = []
    for t in range(length):
        at, done = slice(t, t + 1), t + 1 == length
        late = done and not experience.terminated[game]
        model.replay_buffer.add(  # type: ignore[union-attr]
            observations[at],
            observations[t + 1 : t + 2],
            actions[at],
            rewards[at],
            np.array([done]),
            [{"TimeLimit.truncated": late}],
        )
        model.num_timesteps += 1
        model._update_current_progress_remaining(model.num_timesteps, schedule_steps)
        model._on_step()
        steps = gradient_steps(model)
        if steps:
            model.train(gradient_steps=steps, batch_size=model.batch_size)
            figures.append(renamed(model.logger.name_to_value))
    return figures


def gradient_steps(model: OffPolicyAlgorithm) -> int:
    """Returns how many gradient steps are due after the step that the model has just stored."""
    frequency = model.train_freq.frequency  # type: ignore[union-attr]
    if model.num_timesteps % frequency or model.num_timesteps <= model.learning_starts:
        return 0
    return model.gradient_steps if model.gradient_steps >= 0 else frequency


def exploration(model: Any, schedule_steps: int) -> float:
    """Returns the chance of a random action of an off-policy model; before ``learning_starts`` all are random."""
    if model.num_timesteps < model.learning_starts:
        return 1.0
    return float(model.exploration_schedule(1.0 - model.num_timesteps / schedule_steps))


def renamed(logged: Mapping[str, float]) -> Figures:
    """Returns what a model logged of its update, under our names."""
    return {name: sign * float(logged[key]) for key, (name, sign) in LOGGED.items() if key in logged}


def total(model: OnPolicyAlgorithm, figures: Figures) -> Figures:
    """Returns the figures with the loss that the gradient is of; TRPO has no such sum.

    What PPO logs as its loss is that of the last minibatch alone, and A2C logs none.
    """
    if "entropy" not in figures:
        return figures
    loss = figures["policy_loss"] - model.ent_coef * figures["entropy"] + model.vf_coef * figures["value_loss"]
    return figures | {"loss": loss}
