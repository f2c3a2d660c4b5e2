"""Deep Q-learning as in Stable-Baselines3, for the members of an island."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.acting import GREEDY, Policies, networks
from berteam_cli.learner.adam import Adam, Trained, untrained
from berteam_cli.learner.base import Learning
from berteam_cli.learner.breeding import spans
from berteam_cli.learner.fitting import check_columns
from berteam_cli.learner.health import guarded
from berteam_cli.learner.mlp import Singles, layers, uniform, weight_count
from berteam_cli.learner.replay import Replay, empty, remember
from berteam_cli.learner.temporal import FIGURES, Difference, follow, learn_steps, schedule
from berteam_cli.learner.traits import tuned
from berteam_cli.outcomes import Experience, Floats, Ints
from berteam_cli.workers import Workers

ADAM_EPSILON = 1e-8  # torch's, which Stable-Baselines3 leaves for DQN


class DqnState(NamedTuple):
    """What an island of DQN members knows.

    Attributes:
        trained: weights of the Q networks and Adam's moments.
        target: (M, W) float32, weights of the target networks.
        replay: (M, buffer_size) steps.
        collected: (M,) steps each member has made in all; exploration, target and buffer follow from it.
    """

    trained: Trained
    target: Singles
    replay: Replay
    collected: Ints


@dataclass(frozen=True)
class Dqn:
    """Settings of DQN.

    Attributes:
        observation_size: O.
        actions: A.
        network: widths of the hidden layers.
        activation: of the hidden layers, "tanh" or "relu".
        learning_rate: Adam's.
        buffer_size: steps a member remembers.
        batch_size: steps of one gradient step.
        gamma: discount of one step.
        n_steps: rewards of so many steps are added up before the target network is asked.
        train_freq: steps of the game from one learning to the next.
        gradient_steps: gradient steps of each learning; -1: as many as steps of the game.
        learning_starts: steps a member makes before it learns.
        target_update_interval: steps of the game until the target network is renewed.
        tau: share of its way to the network's weights that the target goes then.
        exploration_initial: chance of a random action before the first step.
        exploration_final: chance of a random action at the end of the schedule, and later.
        exploration_steps: steps over which it falls in a straight line.
        max_grad_norm: a member's gradient is shortened to this norm.
    """

    observation_size: int
    actions: int
    network: tuple[int, ...]
    activation: str
    learning_rate: float
    buffer_size: int
    batch_size: int
    gamma: float
    n_steps: int
    train_freq: int
    gradient_steps: int
    learning_starts: int
    target_update_interval: int
    tau: float
    exploration_initial: float
    exploration_final: float
    exploration_steps: int
    max_grad_norm: float

    algorithm: ClassVar[str] = "dqn"
    buffer: ClassVar[str] = "buffer_size"
    own_traits: ClassVar[tuple[str, ...]] = ("learning_rate", "gamma")

    @property
    def sizes(self) -> tuple[int, ...]:
        """Widths of the network's layers."""
        return (self.observation_size, *self.network, self.actions)

    @property
    def smooth(self) -> bool:
        """Whether hidden layers use tanh, else ReLU."""
        return self.activation == "tanh"

    @property
    def adam(self) -> Adam:
        """The settings of the optimizer."""
        return Adam(self.learning_rate, ADAM_EPSILON, self.max_grad_norm)

    def init(self, members: int, rng: Generator) -> DqnState:
        """Returns the state of ``members`` members that have not learnt yet."""
        weights = uniform(self.sizes, members, rng)
        replay = empty(members, self.buffer_size, self.observation_size)
        return DqnState(untrained(weights), weights.copy(), replay, np.zeros(members, dtype=np.int64))

    def epsilon(self, collected: Ints) -> Floats:
        """Returns the chance of a random action after ``collected`` steps; before a member learns it is 1."""
        progress = np.minimum(collected / self.exploration_steps, 1.0)
        falling = self.exploration_initial + progress * (self.exploration_final - self.exploration_initial)
        return np.where(collected < self.learning_starts, 1.0, falling)

    def policies(self, state: DqnState, *, explore: bool) -> Policies:
        """Returns the members' greedy policies, which err at random as their schedules say if they ``explore``."""
        chance = self.epsilon(state.collected) if explore else 0.0
        return networks(GREEDY, layers(state.trained.weights, self.sizes), tanh=self.smooth, epsilon=chance)

    def state_bytes(self, members: int) -> int:
        """Returns the bytes of both networks' weights with Adam's moments, and of the replay buffers."""
        a_step = 2 * 4 * self.observation_size + 2 + 4 + 2
        return members * (4 * 4 * int(weight_count(np.array(self.sizes))) + 8 + self.buffer_size * a_step + 8)

    def names(self, state: DqnState, island: str) -> list[str]:
        """Returns the island's name with the member's number in it."""
        return [f"{island}.{row}" for row in range(len(state.collected))]

    def learn(
        self,
        state: DqnState,
        experience: Experience,
        first: int,
        rng: Generator,
        workers: Workers,
        traits: Floats | None = None,
    ) -> list[Learning]:
        """Adds the members' steps to their replay buffers, then takes the gradient steps these allow.

        With (M, H) ``traits`` each member has its own. Changes ``state``.
        """
        rngs = rng.spawn(len(state.collected))
        trajectories = experience.trajectories(first, len(state.collected))

        def learn_alone(row: int) -> Learning:
            before = int(state.collected[row])
            for game, player in trajectories[row]:
                state.collected[row] = remember(
                    state.replay.member(row), int(state.collected[row]), experience, game, player
                )
            return tuned(self, traits, row).member_learns(state, row, before, rngs[row])

        return workers.map(learn_alone, list(trajectories))

    def member_learns(self, state: DqnState, row: int, before: int, rng: Generator) -> Learning:
        """Takes the gradient steps for the steps a member has made since it had made ``before``."""
        after = int(state.collected[row])
        count, renewals = self.plan(before, after)
        batches = self.batches(after, count, rng)
        columns = (*state.trained, state.target)
        figures = guarded(columns, row, len(FIGURES), lambda: self.steps_taken(state, row, batches, renewals))
        learning = Learning(row, epsilon=float(self.epsilon(state.collected[row])), steps=after - before)
        if figures is None:  # what is undone does not delay the target
            follow(state.target[row], state.trained.weights[row], self.tau, int(renewals.sum()))
            return replace(learning, failures=1)
        means = dict(zip(FIGURES, figures.tolist(), strict=True)) if count else {}
        return replace(learning, updates=count, **means)

    def plan(self, before: int, after: int) -> tuple[int, Ints]:
        """Returns how many gradient steps are due after step ``after``, and when targets are renewed; ``schedule``."""
        each = self.train_freq if self.gradient_steps == -1 else self.gradient_steps
        return schedule(before, after, self.train_freq, each, self.learning_starts, self.target_update_interval)

    def batches(self, collected: int, count: int, rng: Generator) -> Ints:
        """Returns (count, batch_size) places in the ring of a member that has ``collected`` so many steps."""
        return rng.integers(0, min(collected, self.buffer_size), (count, self.batch_size))

    def steps_taken(self, state: DqnState, row: int, batches: Ints, renewals: Ints) -> Floats:
        """Takes a gradient step of one member for each of ``batches``; returns the means of loss and of Q."""
        return learn_steps(
            Difference(self.gamma, self.n_steps, self.tau, self.smooth),
            self.adam,
            state.trained.member(row),
            state.target[row],
            np.array(self.sizes),
            state.replay.member(row),
            (int(state.collected[row]) - 1) % self.buffer_size,
            batches,
            renewals,
        )

    @property
    def spans(self) -> list[slice]:
        """Where each layer lies in a member's weights."""
        return spans(self.sizes)

    def genes(self, state: DqnState) -> list[Tensor]:
        """Returns (M, W) views of the weights, Adam's moments and the target network, which goes with the layer."""
        return [torch.as_tensor(column) for column in (*state.trained[:3], state.target)]

    def copy(self, state: DqnState, child: int, parent: int) -> None:
        """Makes ``child`` a copy of ``parent``, with all that it remembers."""
        for column in (*state.trained, state.target, *state.replay, state.collected):
            column[child] = column[parent]

    def tensors(self, state: DqnState) -> dict[str, Any]:
        """Returns all that ``state`` holds, by name; of the replay buffers what the fullest one holds."""
        replay = {name: column[:, : self.held(state)] for name, column in state.replay._asdict().items()}
        columns = {**state.trained._asdict(), "target": state.target, **replay}
        columns["collected"] = state.collected
        return {name: torch.from_numpy(column) for name, column in columns.items()}

    def held(self, state: DqnState) -> int:
        """Returns how many steps the fullest replay buffer holds."""
        return min(int(state.collected.max()), self.buffer_size)

    def whole(self, held: dict[str, Any]) -> Replay:
        """Returns replay buffers that begin with the columns ``held``, (M, steps), of ``tensors``."""
        replay = empty(len(held["actions"]), self.buffer_size, self.observation_size)
        for name in Replay._fields:
            column, begun = getattr(replay, name), held[name]
            column[:, : begun.shape[1]] = begun
        return replay

    def checked(self, tensors: dict[str, Any]) -> dict[str, Any]:
        """Returns ``tensors`` as arrays.

        Raises:
            ValueError: they are of other members.
        """
        columns = {name: tensor.cpu().numpy() for name, tensor in tensors.items()}
        one = Dqn.tensors(self, Dqn.init(self, 1, np.random.default_rng(0)))
        check_columns(columns, {name: tensor.numpy() for name, tensor in one.items()}, self.actions, Replay._fields)
        return columns

    def restored(self, tensors: dict[str, Any]) -> DqnState:
        """Returns the state that ``tensors`` gave these.

        Raises:
            ValueError: they are of other members.
        """
        columns = self.checked(tensors)
        return DqnState(
            Trained(*(columns[name] for name in Trained._fields)),
            columns["target"],
            self.whole({name: columns[name] for name in Replay._fields}),
            columns["collected"],
        )
