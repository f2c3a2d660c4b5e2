"""Speed of learning and acting, beside Stable-Baselines3's and beside other ways to do it, all in one run.

docs/performance.md tells what the other ways gave, and why they are not used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np
import torch
from numba import njit
from stable_baselines3 import DQN, PPO
from torch import Tensor
from torch.func import grad, vmap

from berteam_cli.acting import act
from berteam_cli.learner.adam import Trained
from berteam_cli.learner.mlp import layers
from berteam_cli.learner.stacked import descend, outputs
from berteam_cli.learner.stacked_ppo import StackedPpo
from berteam_cli.learner.surrogate import Sample
from berteam_cli.outcomes import Experience
from berteam_cli.workers import Workers, available_cores
from tests.bench.timing import Row, parts, seconds

SEEN, A, HIDDEN, MINIBATCH = 45, 17, 64, 64  # of MCTF 2v2, the paper's smaller networks and Stable-Baselines3's default
# Products of one step of a minibatch: forwards and for the weights' gradients, then for the slopes of hidden layers.
PRODUCTS = 2 * (2 * (SEEN * HIDDEN + HIDDEN * HIDDEN) + HIDDEN * (A + 1)) + 2 * HIDDEN * HIDDEN + HIDDEN * (A + 1)
FLOPS = 2 * MINIBATCH * PRODUCTS


class Noise(gymnasium.Env):
    """An environment of the game's size that costs nothing."""

    observation_space = gymnasium.spaces.Box(-1, 1, (SEEN,), np.float32)
    action_space = gymnasium.spaces.Discrete(A)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.observation_space.sample(), {}

    def step(self, action):
        return self.observation_space.sample(), 0.0, False, False, {}


def experience(members: int, length: int) -> Experience:
    """Returns made-up games in which each member makes ``length`` steps."""
    rng = np.random.default_rng(0)
    shape = (1, members, length)
    return Experience(
        members=np.arange(members)[np.newaxis],
        observations=rng.normal(size=(1, members, length + 1, SEEN)).astype(np.float32),
        actions=rng.integers(A, size=shape).astype(np.int16),
        rewards=rng.normal(size=shape).astype(np.float32),
        lengths=np.full(1, length),
        terminated=np.ones(1, dtype=bool),
    )


def learner(*overrides: str) -> Any:
    return parts("population=ppo6", *overrides).optimizer.islands[0].learner


def with_threads(threads: int, task: Callable[[], float]) -> float:
    torch.set_num_threads(threads)
    try:
        return task()
    finally:
        torch.set_num_threads(1)


def minibatch_ms(ppo: Any, members: int, workers: int) -> float:
    """Returns the time of a minibatch step of one member of PPO, when ``members`` are due together."""
    state, games, pool = ppo.init(members, np.random.default_rng(0)), experience(members, ppo.n_steps), Workers(workers)
    taken = seconds(lambda: ppo.learn(state, games, 0, np.random.default_rng(0), pool))
    return 1000 * taken / (ppo.n_epochs * ppo.n_steps / ppo.minibatch_size) / members


def learner_rows() -> Iterator[Row]:
    """The learners as they are used, and Stable-Baselines3's own."""
    cores, ppo = available_cores(), learner()
    a, b = torch.randn(2, 2048, 2048)
    peak = 2 * 2048**3 / with_threads(cores, lambda: seconds(lambda: a @ b, 5)) / 1e9
    yield "float32 peak of the cores (product of 2048x2048 matrices), GFLOP/s", f"{peak:.0f}", ""
    ours = {members: minibatch_ms(ppo, members, cores) for members in (20, 50)}
    yield "PPO minibatch step a member, 20 members due, ms", f"{ours[20]:.3f}", "0.15"
    yield "the same, 50 members", f"{ours[50]:.3f}", ""
    yield "  of the peak, %", f"{100 * FLOPS / ours[50] * 1e3 / 1e9 / peak:.0f}", "30"
    yield "  all 50 members' updates of 320 steps in one epoch, s", f"{ours[50] * 50 * 320 / 1000:.2f}", ""
    yield "the same with one worker, 4 members", f"{minibatch_ms(ppo, 4, 1):.3f}", ""

    model = PPO("MlpPolicy", Noise(), device="cpu", n_steps=ppo.n_steps)
    model.learn(ppo.n_steps)
    minibatches = ppo.n_epochs * ppo.n_steps / ppo.minibatch_size
    theirs = with_threads(cores, lambda: 1000 * seconds(model.train, 1) / minibatches)
    yield f"Stable-Baselines3's PPO.train, {cores} threads, minibatch step, ms", f"{theirs:.2f}", ""
    yield "  times ours", f"{theirs / ours[50]:.0f}", ""

    dqn = learner("learner=dqn")
    state, games, pool = dqn.init(20, np.random.default_rng(0)), experience(20, 2000), Workers(cores)
    taken = seconds(lambda: dqn.learn(state, games, 0, np.random.default_rng(0), pool))
    own = 1000 * taken / (2000 / dqn.train_freq) / 20
    yield "DQN gradient step a member, 20 members, ms", f"{own:.3f}", ""
    value = DQN("MlpPolicy", Noise(), device="cpu", buffer_size=dqn.buffer_size, learning_starts=10_000)
    value.learn(2000)
    theirs = with_threads(cores, lambda: 1000 * seconds(lambda: value.train(200, dqn.batch_size), 1) / 200)
    yield f"Stable-Baselines3's DQN.train, {cores} threads, gradient step, ms", f"{theirs:.2f}", ""
    yield "  times ours", f"{theirs / own:.0f}", ""


def way_rows() -> Iterator[Row]:
    """Other ways to take a minibatch step of PPO, 20 members at once: torch, on one thread and on all."""
    settings = {name: value for name, value in vars(learner()).items()}
    stacked = StackedPpo(**settings, device="cpu")
    trained = stacked.init(20, np.random.default_rng(0)).trained
    rng = torch.Generator().manual_seed(0)

    def normal(*shape: int) -> Tensor:
        return torch.randn(20, MINIBATCH, *shape, generator=rng)

    actions = torch.randint(A, (20, MINIBATCH), generator=rng)
    sample = Sample(normal(SEEN), actions, normal() * 0.1 - 3, normal(), normal(), normal())
    everyone, entropy_coef = torch.ones(20, dtype=torch.bool), torch.full((20,), stacked.entropy_coef)
    for name, gradient in (
        ("torch.func, vmap of grad", lambda: by_vmap(stacked, trained, sample)),
        ("baddbmm and autograd (device=cuda)", lambda: stacked.gradient(trained.weights, sample, entropy_coef)[0]),
        ("baddbmm and derivatives by hand", lambda: by_hand(stacked, trained, sample)),
    ):
        torch.testing.assert_close(
            gradient(), stacked.gradient(trained.weights, sample, entropy_coef)[0], atol=1e-5, rtol=1e-3
        )

        def step(gradient: Callable[[], Tensor] = gradient) -> None:
            descend(stacked.adam, trained, gradient(), everyone)

        times = [with_threads(n, lambda step=step: 1000 * seconds(step, 30) / 20) for n in (1, available_cores())]
        yield f"  of torch: {name}, 1 and {available_cores()} threads, ms", " and ".join(f"{x:.2f}" for x in times), ""


def by_vmap(ppo: StackedPpo, trained: Trained, sample: Sample) -> Tensor:
    """Returns the gradients (K, W) by torch.func, as if each member stood alone."""

    def loss(weights: Tensor, *columns: Tensor) -> Tensor:
        return alone(ppo, weights[None], Sample(*(x[None] for x in columns)))

    return vmap(grad(loss))(trained.weights, *sample)


def alone(ppo: StackedPpo, weights: Tensor, sample: Sample) -> Tensor:
    logits, values = ppo.both(weights, sample.observations)
    logs = logits.log_softmax(dim=2)
    ratio = (logs.gather(2, sample.actions[..., None])[..., 0] - sample.log_probs).exp()
    gains = (sample.advantages - sample.advantages.mean()) / (sample.advantages.std() + 1e-8)
    bounded = ratio.clamp(1 - ppo.clip_range, 1 + ppo.clip_range)
    return (
        -torch.minimum(gains * ratio, gains * bounded).mean()
        + ppo.value_coef * (values - sample.returns).square().mean()
    )


@torch.no_grad()
def by_hand(ppo: StackedPpo, trained: Trained, sample: Sample) -> Tensor:
    """Returns the gradients (K, W) without autograd."""
    cut = sum((wide + 1) * out for wide, out in pairwise(ppo.policy_sizes))
    n = sample.actions.shape[1]
    gains = sample.advantages
    gains = (gains - gains.mean(dim=1, keepdim=True)) / (gains.std(dim=1, keepdim=True) + 1e-8)
    logits, seen = traced(trained.weights[:, :cut], ppo.policy_sizes, sample.observations)
    logs = logits.log_softmax(dim=2)
    taken = sample.actions[..., None]
    ratio = (logs.gather(2, taken)[..., 0] - sample.log_probs).exp()
    free = gains * ratio <= gains * ratio.clamp(1 - ppo.clip_range, 1 + ppo.clip_range)
    toward = torch.where(free, -gains * ratio / n, 0.0)[..., None]
    slope = (-logs.exp() * toward).scatter_add(2, taken, toward)
    values, seen_by_critic = traced(trained.weights[:, cut:], ppo.value_sizes, sample.observations)
    error = 2 * ppo.value_coef * (values - sample.returns[..., None]) / n
    return torch.cat(
        [
            backwards(trained.weights[:, :cut], ppo.policy_sizes, seen, slope),
            backwards(trained.weights[:, cut:], ppo.value_sizes, seen_by_critic, error),
        ],
        dim=1,
    )


def traced(weights: Tensor, sizes: tuple[int, ...], x: Tensor) -> tuple[Tensor, list[Tensor]]:
    """Returns the outputs of tanh networks, and what each of their layers saw."""
    seen, parts_of = [], layers(weights, sizes)
    for depth, (matrix, bias) in enumerate(parts_of, start=1):
        seen.append(x)
        x = torch.baddbmm(bias[:, None], x, matrix)
        x = x.tanh() if depth < len(parts_of) else x
    return x, seen


def backwards(weights: Tensor, sizes: tuple[int, ...], seen: list[Tensor], slope: Tensor) -> Tensor:
    """Returns the gradients (K, W) from the derivative with respect to the outputs."""
    found: list[Tensor] = []
    for (matrix, _), x in zip(reversed(layers(weights, sizes)), reversed(seen), strict=True):
        found = [x.transpose(1, 2).bmm(slope).flatten(1), slope.sum(dim=1), *found]
        slope = slope.bmm(matrix.transpose(1, 2)) * (1 - x * x)
    return torch.cat(found, dim=1)


def acting_rows() -> Iterator[Row]:
    """One observation to one action."""
    ppo = learner()
    state = ppo.init(50, np.random.default_rng(0))
    table = ppo.policies(state, explore=True)
    seen = np.random.default_rng(0).uniform(-1, 1, (64, SEEN)).astype(np.float32)
    work = np.zeros(2 * table.sizes.max(), dtype=np.float32)

    @njit
    def loop(table, seen, work, times):
        chosen = 0
        for k in range(times):
            chosen += act(table, k % 4, seen[k % 64], work, 0.5, (k * 0.618) % 1.0)
        return chosen

    taken = seconds(lambda: loop(table, seen, work, 20_000), 5) / 20_000
    yield "an action of a 64x64 network inside a game, µs", f"{1e6 * taken:.2f}", ""
    cut = sum((wide + 1) * out for wide, out in pairwise(ppo.policy_sizes))
    weights, observations = torch.from_numpy(state.trained.weights[:, :cut]), torch.randn(50, 20, SEEN)

    def drawn() -> Tensor:
        logits = outputs(weights, ppo.policy_sizes, True, observations)
        return torch.multinomial(logits.softmax(dim=2).flatten(0, 1), 1)

    lockstep = 1e6 * with_threads(available_cores(), lambda: seconds(drawn, 30)) / 1000
    yield (
        "  of torch: 1000 games' worth in lockstep, 50 members of 20 observations, all threads, each",
        f"{lockstep:.2f}",
        "",
    )
    model = PPO("MlpPolicy", Noise(), device="cpu")
    predicted = 1e6 * seconds(lambda: model.predict(seen[0]), 200)
    yield "Stable-Baselines3's predict, µs", f"{predicted:.0f}", ""
    yield "  times ours", f"{predicted / 1e6 / taken:.0f}", ""


ROWS = (learner_rows, way_rows, acting_rows)
