"""What a model of Stable-Baselines3 knows, as tensors by name, and the way back; nothing is pickled."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import BaseBuffer
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from berteam_cli.tensors import below

COUNTERS = ("num_timesteps", "_n_updates", "_n_calls")  # the last is that of targets, where there are any
ROLLOUT = ("observations", "actions", "rewards", "episode_starts", "values", "log_probs")
REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")

POLICY, OPTIMIZER, BUFFER, COUNTER = "policy.", "optimizer.", "buffer.", "counter."


def buffer_of(model: BaseAlgorithm) -> tuple[BaseBuffer, tuple[str, ...]]:
    """Returns the model's steps, and the names of their columns."""
    if isinstance(model, OnPolicyAlgorithm):
        return model.rollout_buffer, ROLLOUT
    return model.replay_buffer, REPLAY  # type: ignore[attr-defined]


def held(model: BaseAlgorithm) -> dict[str, torch.Tensor]:
    """Returns all that the model's next update depends on: weights, the optimizer's state, steps and counters.

    No copies. Of a buffer it returns the rows that are filled.
    """
    buffer, columns = buffer_of(model)
    policy: Any = model.policy
    tensors = {f"{POLICY}{name}": tensor for name, tensor in policy.state_dict().items()}
    for index, state in policy.optimizer.state_dict()["state"].items():
        tensors |= {f"{OPTIMIZER}{index}.{name}": tensor for name, tensor in state.items()}
    tensors |= {f"{BUFFER}{name}": torch.from_numpy(getattr(buffer, name)[: buffer.size()]) for name in columns}
    counters = {name: getattr(model, name) for name in COUNTERS if hasattr(model, name)} | {"position": buffer.pos}
    return tensors | {f"{COUNTER}{name}": torch.tensor(count) for name, count in counters.items()}


def networks_of(model: BaseAlgorithm) -> dict[str, torch.Tensor]:
    """Returns copies of the weights and of the optimizer's state, as ``held`` names them."""
    networks = (POLICY, OPTIMIZER)
    return {name: tensor.clone() for name, tensor in held(model).items() if name.startswith(networks)}


def take(model: BaseAlgorithm, tensors: Mapping[str, torch.Tensor]) -> None:
    """Makes ``model`` know what another of the same settings did when ``held`` gave ``tensors``; they are copied."""
    take_networks(model, tensors)
    buffer, columns = buffer_of(model)
    counters = below(tensors, COUNTER)
    for name in columns:
        filled = tensors[f"{BUFFER}{name}"].numpy()
        getattr(buffer, name)[: len(filled)] = filled
    buffer.pos = int(counters.pop("position"))
    buffer.full = len(tensors[f"{BUFFER}rewards"]) == buffer.buffer_size
    for name, count in counters.items():
        setattr(model, name, int(count))


def take_networks(model: BaseAlgorithm, tensors: Mapping[str, torch.Tensor]) -> None:
    """Gives ``model`` the weights and the optimizer's state among ``tensors``; they are copied."""
    policy: Any = model.policy
    policy.load_state_dict(below(tensors, POLICY))
    state: dict[int, dict[str, torch.Tensor]] = {}
    for key, tensor in below(tensors, OPTIMIZER).items():
        index, name = key.split(".", maxsplit=1)
        state.setdefault(int(index), {})[name] = tensor.clone()
    groups = policy.optimizer.state_dict()["param_groups"]  # settings, and a learning rate that each update sets
    policy.optimizer.load_state_dict({"state": state, "param_groups": groups})
