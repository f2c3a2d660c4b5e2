"""Members as models of Stable-Baselines3: their networks, what Adam remembers of them, and how they learn.

What cannot go along is experience: the steps of a half full rollout, and a replay buffer, which that library does not
save with a model either.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box, Discrete
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm

from berteam_cli.learner.adam import Trained
from berteam_cli.learner.base import Learner
from berteam_cli.learner.dqn import Dqn, DqnState
from berteam_cli.learner.mlp import Singles, layers, weight_count
from berteam_cli.learner.ppo import Ppo, PpoState


def exported(learner: Learner[Any], state: Any, row: int, space: Box) -> BaseAlgorithm:
    """Returns member ``row`` of an island as a model.

    Args:
        learner: of the island.
        state: its state.
        row: the member within the island.
        space: of what the game lets its players see.

    Raises:
        ValueError: members of this learner are no such models.
    """
    if learner.algorithm not in EXPORTERS:
        raise ValueError(f"its learner is {learner.algorithm}, and only members of {', '.join(EXPORTERS)} can be")
    return EXPORTERS[learner.algorithm](learner, state, row, space)


def ppo(learner: Ppo, state: PpoState, row: int, space: Box) -> PPO:
    """Returns a member that learns by PPO."""
    model = PPO(
        "MlpPolicy",
        None,  # type: ignore[arg-type]  # as its own load does: the spaces are enough
        learning_rate=learner.learning_rate,
        n_steps=learner.n_steps,
        batch_size=learner.minibatch_size,
        n_epochs=learner.n_epochs,
        gamma=learner.gamma,
        gae_lambda=learner.gae_lambda,
        clip_range=learner.clip_range,
        clip_range_vf=learner.clip_range_vf,
        target_kl=learner.target_kl,
        normalize_advantage=learner.normalize_advantage,
        ent_coef=learner.entropy_coef,
        vf_coef=learner.value_coef,
        max_grad_norm=learner.max_grad_norm,
        policy_kwargs=policy_settings(learner),
        device="cpu",
        _init_setup_model=False,
    )
    set_up(model, space, learner.actions)
    member, cut = state.trained.member(row), weight_count(np.array(learner.policy_sizes))
    policy = model.policy
    take_over(
        policy, (policy.mlp_extractor.policy_net, policy.action_net), section(member, 0, cut), learner.policy_sizes
    )
    take_over(
        policy, (policy.mlp_extractor.value_net, policy.value_net), section(member, cut, None), learner.value_sizes
    )
    model._n_updates = int(member.updates[0]) // -(-learner.n_steps // learner.minibatch_size)
    model.num_timesteps = int(state.collected[row])
    return model


def dqn(learner: Dqn, state: DqnState, row: int, space: Box) -> DQN:
    """Returns a member that learns by DQN.

    Its ``exploration_fraction`` is Stable-Baselines3's: that counts in shares of what ``learn`` is called for, and
    ours in steps.
    """
    model = DQN(
        "MlpPolicy",
        None,  # type: ignore[arg-type]
        learning_rate=learner.learning_rate,
        buffer_size=learner.buffer_size,
        learning_starts=learner.learning_starts,
        batch_size=learner.batch_size,
        gamma=learner.gamma,
        n_steps=learner.n_steps,
        tau=learner.tau,
        train_freq=learner.train_freq,
        gradient_steps=learner.gradient_steps,
        target_update_interval=learner.target_update_interval,
        exploration_initial_eps=learner.exploration_initial,
        exploration_final_eps=learner.exploration_final,
        max_grad_norm=learner.max_grad_norm,
        policy_kwargs=policy_settings(learner),
        device="cpu",
        _init_setup_model=False,
    )
    set_up(model, space, learner.actions)
    member = state.trained.member(row)
    take_over(model.policy, (model.q_net,), member, learner.sizes)
    write(parameters(model.q_net_target), torch_layers(state.target[row], learner.sizes))
    model._n_updates, model.num_timesteps = int(member.updates[0]), int(state.collected[row])
    model._n_calls = model.num_timesteps
    model.exploration_rate = float(learner.epsilon(state.collected[row]))
    return model


def policy_settings(learner: Ppo | Dqn) -> dict[str, Any]:
    """Returns what makes a policy of the learner's networks."""
    activation = torch.nn.Tanh if learner.smooth else torch.nn.ReLU
    return {"net_arch": list(learner.network), "activation_fn": activation}


def own_model(learner: Learner[Any], state: list[BaseAlgorithm], row: int, space: Box) -> BaseAlgorithm:
    """Returns the model that a member of ``sb3`` is."""
    from berteam_cli.learner.sb3_feeding import exploration  # noqa: PLC0415 (loaded already where there is one)

    model = state[row]
    if hasattr(model, "exploration_rate"):
        model.exploration_rate = exploration(model, learner.schedule_steps)  # type: ignore[attr-defined]
    return model


EXPORTERS: dict[str, Callable[[Any, Any, int, Box], BaseAlgorithm]] = {"ppo": ppo, "dqn": dqn}
EXPORTERS |= dict.fromkeys(("A2C", "DQN", "PPO", "QRDQN", "TRPO"), own_model)
"""By ``Learner.algorithm``: what makes a model of a member, called as ``exported`` is."""


def set_up(model: BaseAlgorithm, space: Box, actions: int) -> None:
    """Makes the networks of ``model``, which is changed."""
    model.observation_space, model.action_space, model.n_envs = space, Discrete(actions), 1
    model._setup_model()


def section(member: Trained, first: int, last: int | None) -> Trained:
    """Returns the weights ``first`` to before ``last`` of one member, with what Adam remembers of them."""
    return Trained._make((*(column[first:last] for column in member[:3]), member.updates))


def take_over(policy: Any, modules: tuple[torch.nn.Module, ...], member: Trained, sizes: tuple[int, ...]) -> None:
    """Writes one network of a member, and what Adam remembers of it, into ``policy``.

    Args:
        policy: of the model; its optimizer is changed.
        modules: where the network's layers are, in order. Changed.
        member: as ``Trained.member`` returns it, of this network only.
        sizes: width of each layer from observation to output.
    """
    own = parameters(*modules)
    weights, mean, square = (torch_layers(column, sizes) for column in member[:3])
    write(own, weights)
    if member.updates[0]:
        for parameter, first, second in zip(own, mean, square, strict=True):
            step = torch.tensor(float(member.updates[0]))
            policy.optimizer.state[parameter] = {"step": step, "exp_avg": first, "exp_avg_sq": second}


def parameters(*modules: torch.nn.Module) -> list[torch.nn.Parameter]:
    """Returns matrix and bias of each linear layer in ``modules``."""
    found = [each for module in modules for each in module.modules() if isinstance(each, torch.nn.Linear)]
    return [part for linear in found for part in (linear.weight, linear.bias) if isinstance(part, torch.nn.Parameter)]


def torch_layers(flat: Singles, sizes: tuple[int, ...]) -> list[torch.Tensor]:
    """Returns copies of the numbers (W,) of one network as torch has them: (out, in) and (out,) of each layer."""
    return [torch.tensor(part) for matrix, bias in layers(flat[np.newaxis], sizes) for part in (matrix[0].T, bias[0])]


@torch.no_grad()
def write(own: list[torch.nn.Parameter], values: list[torch.Tensor]) -> None:
    """Writes ``values`` into the parameters ``own``, which are changed."""
    for parameter, value in zip(own, values, strict=True):
        parameter.copy_(value)
