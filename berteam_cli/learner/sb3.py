"""Members that are models of Stable-Baselines3, of an algorithm that is named; slower than those of our own."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.random import Generator
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from torch import nn

from berteam_cli.acting import GREEDY, SAMPLED, Policies, networks
from berteam_cli.learner.base import Learning
from berteam_cli.learner.mlp import Singles
from berteam_cli.learner.sb3_feeding import Figures, exploration, fed
from berteam_cli.learner.sb3_models import algorithm_class, built, check_options
from berteam_cli.learner.sb3_state import buffer_of, held, networks_of, take, take_networks
from berteam_cli.outcomes import Experience
from berteam_cli.tensors import below
from berteam_cli.workers import Workers


@dataclass(frozen=True)
class Sb3:
    """Settings of Stable-Baselines3; the state of an island is a list of models, one for each member.

    Attributes:
        observation_size: O.
        actions: A.
        network: widths of the hidden layers, of actor and critic apart.
        algorithm: name of its class.
        activation: "tanh" or "relu"; None is the algorithm's own.
        schedule_steps: steps of a member that count as its whole training; exploration falls over a share of them.
        options: other keywords of the constructor.
    """

    observation_size: int
    actions: int
    network: tuple[int, ...]
    algorithm: str
    activation: str | None
    schedule_steps: int
    options: Mapping[str, Any]

    buffer: ClassVar[str] = ""  # its size is an option, whose name differs

    def __post_init__(self) -> None:
        """Checks the settings, at last by building a model with them.

        Raises:
            ValueError: one is not allowed.
        """
        check_options(algorithm_class(self.algorithm), self.options)
        try:
            with drawing_from(np.random.default_rng(0)):
                self.model()
        except (AssertionError, ValueError, TypeError, ArithmeticError, MemoryError, RuntimeError) as error:
            why = str(error).splitlines()[0].rstrip(".")
            raise ValueError(f"options cannot be used, as {self.algorithm} says: {why}.") from error

    def init(self, members: int, rng: Generator) -> list[BaseAlgorithm]:
        """Returns the models of ``members`` members that have not learnt yet; all their memory is taken now."""
        models = []
        for alone in rng.spawn(members):
            with drawing_from(alone):
                models.append(self.model())
            buffer, columns = buffer_of(models[-1])
            for name in columns:
                getattr(buffer, name).fill(0)
        return models

    def model(self) -> BaseAlgorithm:
        """Returns a new model; draws from torch's global generator."""
        kind = algorithm_class(self.algorithm)
        return built(kind, self.observation_size, self.actions, self.network, self.activation, self.options)

    def policies(self, state: list[BaseAlgorithm], *, explore: bool) -> Policies:
        """Returns how the models act: actors draw from their distribution; the others take what they value most.

        These err at random if they ``explore``, as their schedules say.
        """
        layers = [
            (np.stack([matrix for matrix, _ in layer]), np.stack([bias for _, bias in layer]))
            for layer in zip(*(acting_layers(model) for model in state), strict=True)
        ]
        tanh = state[0].policy.activation_fn is nn.Tanh
        if isinstance(state[0], OnPolicyAlgorithm):
            return networks(SAMPLED, layers, tanh=tanh)
        chances = [exploration(model, self.schedule_steps) if explore else 0.0 for model in state]
        return networks(GREEDY, layers, tanh=tanh, epsilon=chances)

    def names(self, state: list[BaseAlgorithm], island: str) -> list[str]:
        """Returns the island's name with the member's number in it."""
        return [f"{island}.{row}" for row in range(len(state))]

    def learn(
        self, state: list[BaseAlgorithm], experience: Experience, first: int, rng: Generator, workers: Workers
    ) -> list[Learning]:
        """Lets each model learn from its member's steps, one after the other: its generators are the process's.

        Changes ``state``.
        """
        rngs = rng.spawn(len(state))
        learnt = []
        for row, trajectories in experience.trajectories(first, len(state)).items():
            with drawing_from(rngs[row]), unchecked():
                learnt.append(self.member_learns(state[row], row, experience, trajectories))
        return learnt

    def member_learns(
        self, model: BaseAlgorithm, row: int, experience: Experience, trajectories: list[tuple[int, int]]
    ) -> Learning:
        """Gives a model the steps of its member ``row``; returns what came of it.

        Updates that give weights or a loss that are not finite are undone, all of this epoch, and an actor's rollout
        is emptied.
        """
        steps, updates, before = model.num_timesteps, gradient_steps_taken(model), networks_of(model)
        figures = means(fed(model, experience, trajectories, self.schedule_steps))
        losses = [figures[name] for name in ("loss", "policy_loss", "value_loss") if name in figures]
        failed = not (np.isfinite(losses).all() and all(x.isfinite().all() for x in networks_of(model).values()))
        if failed:
            take_networks(model, before)
            figures = {}
            if isinstance(model, OnPolicyAlgorithm):
                model.rollout_buffer.reset()
        if not isinstance(model, OnPolicyAlgorithm):
            figures["epsilon"] = exploration(model, self.schedule_steps)
        updates, steps = gradient_steps_taken(model) - updates, model.num_timesteps - steps
        return Learning(row, updates=updates, steps=steps, failures=int(failed), **figures)

    def state_bytes(self, members: int) -> int:
        """Returns the bytes of the models' weights, of what the optimizer remembers and of full buffers."""
        return members * self._member_bytes

    @cached_property
    def _member_bytes(self) -> int:
        """The bytes of one model; to know them takes building it."""
        with drawing_from(np.random.default_rng(0)):
            model = self.model()
        buffer, columns = buffer_of(model)
        weights = sum(x.numel() * x.element_size() for x in model.policy.state_dict().values())
        return 3 * weights + sum(getattr(buffer, name).nbytes for name in columns)

    def copy(self, state: list[BaseAlgorithm], child: int, parent: int) -> None:
        """Makes ``child`` know what ``parent`` does, with its replay buffer; an actor's rollout is its own."""
        take(state[child], held(state[parent]))
        if isinstance(state[child], OnPolicyAlgorithm):
            state[child].rollout_buffer.reset()  # type: ignore[attr-defined]

    def tensors(self, state: list[BaseAlgorithm]) -> dict[str, Any]:
        """Returns all that ``state`` holds; names begin with the member's number."""
        return {f"{row}.{name}": tensor for row, model in enumerate(state) for name, tensor in held(model).items()}

    def restored(self, tensors: dict[str, Any]) -> list[BaseAlgorithm]:
        """Returns the state that ``tensors`` gave these."""
        state = self.init(len({name.split(".", maxsplit=1)[0] for name in tensors}), np.random.default_rng(0))
        for row, model in enumerate(state):
            take(model, below(tensors, f"{row}."))
        return state


@contextmanager
def drawing_from(rng: Generator) -> Iterator[None]:
    """Lets the process's generators, which Stable-Baselines3 draws from, begin from ``rng``; puts them back at the end.

    The one of a CUDA device is left alone.
    """
    python, numpy, torch_ = (int(seed) for seed in rng.integers(2**32, size=3))
    python_before, numpy_before = random.getstate(), np.random.get_state()  # noqa: NPY002 (it is what they use)
    with torch.random.fork_rng(devices=[]):
        random.seed(python)
        np.random.seed(numpy)  # noqa: NPY002
        torch.default_generator.manual_seed(torch_)
        try:
            yield
        finally:
            random.setstate(python_before)
            np.random.set_state(numpy_before)  # noqa: NPY002


@contextmanager
def unchecked() -> Iterator[None]:
    """Lets torch's distributions take what is not finite: it is found in the losses, and ends no run."""
    checks = torch.distributions.Distribution._validate_args
    torch.distributions.Distribution.set_default_validate_args(False)
    try:
        with np.errstate(all="ignore"):
            yield
    finally:
        torch.distributions.Distribution.set_default_validate_args(checks)


def acting_layers(model: BaseAlgorithm) -> list[tuple[Singles, Singles]]:
    """Returns for each layer, from observation to actions, its matrix (in, out) and bias (out,).

    QRDQN values an action by the mean of its quantiles; as that is linear, the last layer gives it at once.
    """
    policy: Any = model.policy
    if isinstance(model, OnPolicyAlgorithm):
        parts = [policy.mlp_extractor.policy_net, policy.action_net]
    elif hasattr(policy, "quantile_net"):
        parts = [policy.quantile_net.quantile_net]
    else:
        parts = [policy.q_net.q_net]
    linears = [module for part in parts for module in part.modules() if isinstance(module, nn.Linear)]
    layers = [(linear.weight.detach().numpy().T, linear.bias.detach().numpy()) for linear in linears]
    matrix, bias = layers[-1]
    actions = model.action_space.n  # type: ignore[attr-defined]
    if len(bias) != actions:  # (quantile, action) are one after the other
        matrix, bias = matrix.reshape(len(matrix), -1, actions).mean(axis=1), bias.reshape(-1, actions).mean(axis=0)
    return [*layers[:-1], (matrix, bias)]


def gradient_steps_taken(model: BaseAlgorithm) -> int:
    """Returns how many gradient steps the model has taken in all; of TRPO those of its critic."""
    state: Any = model.policy.optimizer.state
    return max((int(moments["step"]) for moments in state.values()), default=0)


def means(figures: list[Figures]) -> Figures:
    """Returns the means of the figures of several updates, none of none."""
    return {name: float(np.mean([each[name] for each in figures])) for name in figures[0]} if figures else {}
