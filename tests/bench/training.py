"""Speed of training: epochs, learners, selectors, and how soon a run starts."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO

from berteam_cli.outcomes import Experience
from berteam_cli.training import begin, epoch
from berteam_cli.workers import available_cores
from tests.bench.timing import Row, parts, seconds


def epoch_rows() -> Iterator[Row]:
    for name, overrides, target in (
        ("paper_coevolution", ["experiment=paper_coevolution"], "(goal 1.0)"),
        ("paper_comparison, coevolution", ["experiment=paper_comparison"], "15 (goal 0.7)"),
        (
            "paper_comparison, MAP-Elites projecting every epoch",
            ["experiment=paper_comparison", "optimizer=mapelites", "optimizer.protect_new=1"],
            "(goal 1.0)",
        ),
    ):
        made = parts(*overrides)
        run, split, count = begin(made), {}, 0
        for _ in range(16):  # rollouts of 2,048 steps are full for the first time after some 3 to 5 epochs
            run, report = epoch(run, made)
            if run.epoch > 6:
                count += 1
                for part, taken in report.seconds.items():
                    split[part] = split.get(part, 0.0) + taken
        parts_of = ", ".join(f"{part[:-2]} {total / count:.2f}" for part, total in split.items())
        yield f"epoch of {name}, s ({parts_of})", f"{sum(split.values()) / count:.2f}", target


def learner_rows() -> Iterator[Row]:
    made = parts("population=ppo50", "population.islands.main.size=20")
    learner, state = made.optimizer.islands[0].learner, begin(made).population.minds[0]
    rng = np.random.default_rng(0)
    length = learner.n_steps
    experience = Experience(
        members=np.arange(20).reshape(5, 4),
        observations=rng.normal(size=(5, 4, length + 1, 45)).astype(np.float32),
        actions=rng.integers(17, size=(5, 4, length)).astype(np.int16),
        rewards=rng.normal(size=(5, 4, length)).astype(np.float32),
        lengths=np.full(5, length),
        terminated=np.ones(5, dtype=bool),
    )
    minibatches = learner.n_epochs * length / learner.minibatch_size
    taken = seconds(lambda: learner.learn(state, experience, 0, np.random.default_rng(0), made.games.workers), 1)
    ours = 1000 * taken / minibatches / 20
    yield "PPO minibatch step a member, 20 members stacked, ms", f"{ours:.3f}", "(goal 0.15)"

    model = PPO("MlpPolicy", one_env(), device="cpu", n_steps=length)
    model.learn(length)
    torch.set_num_threads(available_cores())
    theirs = 1000 * seconds(model.train, 1) / minibatches
    torch.set_num_threads(1)
    yield "the same with Stable-Baselines3's PPO.train, ms", f"{theirs:.3f}", ""
    yield "ratio", f"{theirs / ours:.1f}", ""
    seen = rng.normal(size=45).astype(np.float32)
    yield "one action by Stable-Baselines3's predict, µs", f"{1e6 * seconds(lambda: model.predict(seen)):.0f}", ""


def one_env() -> Any:
    import gymnasium  # noqa: PLC0415

    class Noise(gymnasium.Env):
        observation_space = gymnasium.spaces.Box(-1, 1, (45,), np.float32)
        action_space = gymnasium.spaces.Discrete(17)

        def reset(self, *, seed=None, options=None):
            super().reset(seed=seed)
            return self.observation_space.sample(), {}

        def step(self, action):
            return self.observation_space.sample(), 0.0, False, False, {}

    return Noise()


def selector_rows() -> Iterator[Row]:
    made = parts("experiment=paper_comparison", "selector.train_every=1")
    selector, run = made.selector, begin(made)
    ages = np.zeros(60, dtype=np.int64)
    rng = np.random.default_rng(0)
    lineups = selector.select(run.selection, 25, ages, rng)
    outcomes = epoch(run, parts("experiment=paper_comparison", "population=islands4x15", "env.max_time_s=5"))[
        1
    ].outcomes
    outcomes.scores[:] = [1, 0]
    assert len(lineups) == 25
    yield (
        "BERTeam update, 512 teams in minibatches of 64, s",
        f"{seconds(lambda: selector.learn(run.selection, outcomes, rng)):.2f}",
        "0.3",
    )
    yield (
        "BERTeam, teams of 25 games, ms",
        f"{1000 * seconds(lambda: selector.select(run.selection, 25, ages, rng)):.0f}",
        "",
    )
    yield (
        "BERTeam, total distribution, 60 members, teams of 2, ms",
        f"{1000 * seconds(lambda: selector.distribution(run.selection)):.0f}",
        "(goal 50)",
    )


def start_rows() -> Iterator[Row]:
    berteam = str(Path(sys.executable).with_name("berteam"))

    def quiet(*words: str) -> None:
        subprocess.run([berteam, *words], stdout=subprocess.DEVNULL, check=True)

    yield "berteam --help, s", f"{seconds(lambda: quiet('--help')):.2f}", "0.5"
    with tempfile.TemporaryDirectory() as folder:
        words = ["train", "epochs=0", "evaluation.games=0", f"out={folder}/run", "on_exists=overwrite"]
        yield "berteam train until the first game, s", f"{seconds(lambda: quiet(*words), 1):.1f}", "5"


ROWS = (epoch_rows, learner_rows, selector_rows, start_rows)
