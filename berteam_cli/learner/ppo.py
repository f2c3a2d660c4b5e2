"""Proximal policy optimisation as in Stable-Baselines3, for the members of an island."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.acting import SAMPLED, Policies, networks
from berteam_cli.learner.adam import Adam, Trained, untrained
from berteam_cli.learner.base import Learning
from berteam_cli.learner.breeding import spans
from berteam_cli.learner.fitting import check_columns
from berteam_cli.learner.health import guarded
from berteam_cli.learner.mlp import Singles, forward, layers, n_values, orthogonal, weight_count
from berteam_cli.learner.rollout import Steps, advantages, append, empty, seen, stitched
from berteam_cli.learner.surrogate import FIGURES, LOSSES, Sample, Surrogate, log_chances, one_update
from berteam_cli.learner.traits import tuned
from berteam_cli.outcomes import Experience, Floats, Ints
from berteam_cli.workers import Workers

ADAM_EPSILON = 1e-5  # Stable-Baselines3's for actor-critic policies; torch's own is 1e-8


class PpoState(NamedTuple):
    """What an island of PPO members knows.

    Attributes:
        trained: weights, of the policy network before those of the value network, and Adam's moments.
        rollouts: (M, n_steps) steps made with these weights, not learnt from yet.
        filled: (M,) how many steps of each rollout there are.
        collected: (M,) steps each member has made in all, those of whom it is a copy included.
    """

    trained: Trained
    rollouts: Steps
    filled: Ints
    collected: Ints


@dataclass(frozen=True)
class Ppo:
    """Settings of PPO.

    Attributes:
        observation_size: O.
        actions: A.
        network: widths of the hidden layers of the policy and, apart from it, of the value network.
        activation: of the hidden layers, "tanh" or "relu".
        learning_rate: Adam's.
        n_steps: steps a member gathers, over games and epochs, before it learns from them.
        minibatch_size: steps of one gradient step.
        n_epochs: how often each step is used.
        gamma: discount of one step.
        gae_lambda: in [0, 1], how far advantages look ahead.
        clip_range: how far an action's probability may move, as a share of what it was.
        clip_range_vf: how far a value may move from what it was; None: anywhere.
        target_kl: an update ends when the policy has diverged by 1.5 times this from the one that acted; None: never.
        entropy_coef: weight of the entropy in the loss.
        value_coef: weight of the value network's squared error in the loss.
        max_grad_norm: a member's gradient is shortened to this norm.
        normalize_advantage: whether the advantages of a minibatch get mean 0 and standard deviation 1.
    """

    observation_size: int
    actions: int
    network: tuple[int, ...]
    activation: str
    learning_rate: float
    n_steps: int
    minibatch_size: int
    n_epochs: int
    gamma: float
    gae_lambda: float
    clip_range: float
    clip_range_vf: float | None
    target_kl: float | None
    entropy_coef: float
    value_coef: float
    max_grad_norm: float
    normalize_advantage: bool

    algorithm: ClassVar[str] = "ppo"
    buffer: ClassVar[str] = "n_steps"
    own_traits: ClassVar[tuple[str, ...]] = ("learning_rate", "entropy_coef", "gamma")

    @property
    def policy_sizes(self) -> tuple[int, ...]:
        """Widths of the policy network's layers."""
        return (self.observation_size, *self.network, self.actions)

    @property
    def value_sizes(self) -> tuple[int, ...]:
        """Widths of the value network's layers."""
        return (self.observation_size, *self.network, 1)

    @property
    def smooth(self) -> bool:
        """Whether hidden layers use tanh, else ReLU."""
        return self.activation == "tanh"

    @property
    def surrogate(self) -> Surrogate:
        """The settings of the loss."""
        reach, limit = (math.inf if x is None else x for x in (self.clip_range_vf, self.target_kl))
        return Surrogate(self.clip_range, reach, limit, self.entropy_coef, self.value_coef, self.normalize_advantage)

    @property
    def adam(self) -> Adam:
        """The settings of the optimizer."""
        return Adam(self.learning_rate, ADAM_EPSILON, self.max_grad_norm)

    def init(self, members: int, rng: Generator) -> PpoState:
        """Returns the state of ``members`` members that have not learnt yet."""
        policy = orthogonal(self.policy_sizes, 0.01, members, rng)  # nearly uniform over the actions
        value = orthogonal(self.value_sizes, 1.0, members, rng)
        return PpoState(
            untrained(np.concatenate([policy, value], axis=1)),
            empty(members, self.n_steps, self.observation_size),
            *np.zeros((2, members), dtype=np.int64),
        )

    def policies(self, state: PpoState, *, explore: bool) -> Policies:
        """Returns the members' stochastic policies; they are evaluated as they play, whatever ``explore`` is."""
        return networks(SAMPLED, layers(state.trained.weights, self.policy_sizes), tanh=self.smooth)

    def state_bytes(self, members: int) -> int:
        """Returns the bytes of weights with Adam's moments, and of rollouts."""
        weights = weight_count(np.array(self.policy_sizes)) + weight_count(np.array(self.value_sizes))
        a_step = 4 * self.observation_size + 2 + 4 * 4 + 1
        return members * (3 * 4 * int(weights) + 8 + self.n_steps * a_step + 2 * 8)

    def names(self, state: PpoState, island: str) -> list[str]:
        """Returns the island's name with the member's number in it."""
        return [f"{island}.{row}" for row in range(len(state.filled))]

    def learn(
        self,
        state: PpoState,
        experience: Experience,
        first: int,
        rng: Generator,
        workers: Workers,
        traits: Floats | None = None,
    ) -> list[Learning]:
        """Adds the members' steps to their rollouts; whoever's is full learns from it and begins a new one.

        Values and probabilities are those of the weights the games were played with, even of the steps that are
        left over when a member learns. With (M, H) ``traits`` each member has its own. Changes ``state``.
        """
        rngs = rng.spawn(len(state.filled))
        trajectories = experience.trajectories(first, len(state.filled))

        def learn_alone(row: int) -> Learning:
            own = tuned(self, traits, row)
            return own.member_learns(state, row, own.judged(state, row, experience, trajectories[row]), rngs[row])

        return workers.map(learn_alone, list(trajectories))

    def judged(self, state: PpoState, row: int, experience: Experience, trajectories: list[tuple[int, int]]) -> Steps:
        """Returns one member's new steps, with what its networks say of them before it learns."""
        what = seen(experience, trajectories)
        weights, count = state.trained.weights[row], weight_count(np.array(self.policy_sizes))
        logits = outputs(weights[:count], self.policy_sizes, self.smooth, what.observations)
        values = outputs(weights[count:], self.value_sizes, self.smooth, what.observations)
        return stitched(what, values[:, 0], log_chances(logits, what.actions), self.gamma)

    def member_learns(self, state: PpoState, row: int, new: Steps, rng: Generator) -> Learning:
        """Adds ``new`` steps to a member's rollout and updates it as often as that is full."""
        figures: list[Floats] = []
        failures, taken = 0, int(state.trained.updates[row])
        used = append(state.rollouts, state.filled, row, new, 0)
        while state.filled[row] == self.n_steps:
            of_update = guarded(state.trained, row, LOSSES, lambda: self.update(state, row, rng))
            figures += [] if of_update is None else [of_update]
            failures += of_update is None
            state.filled[row] = 0
            used += append(state.rollouts, state.filled, row, new, used)
        state.collected[row] += used
        return learning(row, figures, int(state.trained.updates[row]) - taken, used, failures)

    def update(self, state: PpoState, row: int, rng: Generator) -> Floats:
        """Lets a member learn from its full rollout; returns (len(FIGURES),) figures."""
        return one_update(
            self.surrogate,
            self.adam,
            state.trained.member(row),
            np.array(self.policy_sizes),
            np.array(self.value_sizes),
            self.smooth,
            self.sample(state, row),
            self.orders(rng),
            self.minibatch_size,
        )

    def sample(self, state: PpoState, row: int) -> Sample:
        """Returns a member's full rollout with its advantages and returns, as a loss wants it."""
        rollout = Steps(*(column[row] for column in state.rollouts))
        gains = advantages(
            rollout.rewards, rollout.values, rollout.next_values, rollout.ends, self.gamma, self.gae_lambda
        )
        returns = gains + rollout.values
        return Sample(rollout.observations, rollout.actions, rollout.log_probs, gains, rollout.values, returns)

    def orders(self, rng: Generator) -> Ints:
        """Returns (n_epochs, n_steps) in which order each pass takes the steps."""
        return np.stack([rng.permutation(self.n_steps) for _ in range(self.n_epochs)])

    def copy(self, state: PpoState, child: int, parent: int) -> None:
        """Makes ``child`` a copy of ``parent`` with an empty rollout, since the parent's steps are not its own."""
        for column in (*state.trained, state.collected):
            column[child] = column[parent]
        for emptied in (*state.rollouts, state.filled):
            emptied[child] = 0

    @property
    def spans(self) -> list[slice]:
        """Where each layer lies in a member's weights, those of the policy first."""
        return spans(self.policy_sizes, self.value_sizes)

    def genes(self, state: PpoState) -> list[Tensor]:
        """Returns (M, W) views of the weights and Adam's moments."""
        return [torch.as_tensor(column) for column in state.trained[:3]]

    def tensors(self, state: PpoState) -> dict[str, Any]:
        """Returns all that ``state`` holds, by name."""
        columns: dict[str, Any] = {**state.trained._asdict(), **state.rollouts._asdict()}
        columns |= {"filled": state.filled, "collected": state.collected}
        return {name: torch.from_numpy(column) for name, column in columns.items()}

    def checked(self, tensors: dict[str, Any]) -> dict[str, Any]:
        """Returns ``tensors`` as arrays.

        Raises:
            ValueError: they are of other members.
        """
        columns = {name: tensor.cpu().numpy() for name, tensor in tensors.items()}
        one = Ppo.tensors(self, Ppo.init(self, 1, np.random.default_rng(0)))
        check_columns(columns, {name: tensor.numpy() for name, tensor in one.items()}, self.actions)
        return columns

    def restored(self, tensors: dict[str, Any]) -> PpoState:
        """Returns the state that ``tensors`` gave these.

        Raises:
            ValueError: they are of other members.
        """
        columns = self.checked(tensors)
        return PpoState(
            Trained(*(columns[name] for name in Trained._fields)),
            Steps(*(columns[name] for name in Steps._fields)),
            columns["filled"],
            columns["collected"],
        )


def learning(
    row: int, figures: Sequence[Floats] | Sequence[list[float]], updates: int, steps: int, failures: int
) -> Learning:
    """Returns what a member learnt.

    Args:
        row: the member within its island.
        figures: (len(FIGURES),) of each update that was not undone.
        updates: gradient steps.
        steps: transitions that arrived.
        failures: updates that were undone.
    """
    means = dict(zip(FIGURES, np.mean(figures, axis=0).tolist(), strict=True)) if figures else {}
    return Learning(row, updates, **means, steps=steps, failures=failures)


def outputs(weights: Singles, sizes: tuple[int, ...], smooth: bool, observations: Singles) -> Singles:
    """Returns the outputs (n, out) of one network for ``observations``, shape (n, O)."""
    widths = np.array(sizes)
    values = np.empty(n_values(widths, len(observations)), dtype=np.float32)
    return forward(weights, widths, smooth, observations, values)
