"""Speed: figures beside targets, and ratios taken in the same run. `make bench` prints the table.

Nothing here is asserted: the machines are shared, and a test that fails when somebody else compiles is no test.
"""

from __future__ import annotations

import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from hydra import compose, initialize_config_module
from rich.console import Console
from rich.table import Table
from stable_baselines3 import PPO

from berteam_cli import build
from berteam_cli.acting import fixed_policies
from berteam_cli.compose import CONF, prepare
from berteam_cli.config import checked
from berteam_cli.env.mctf import Mctf
from berteam_cli.evaluation.tournament import tournament
from berteam_cli.games import Games, pairings
from berteam_cli.outcomes import Experience
from berteam_cli.selector.base import unordered_teams
from berteam_cli.training import begin, epoch
from berteam_cli.workers import Workers, available_cores

Row = tuple[str, str, str]


def parts(*overrides: str) -> Any:
    prepare()
    with initialize_config_module(CONF, version_base="1.3"):
        return build.parts(checked(compose("train", overrides=list(overrides))))


def seconds(task: Callable[[], object], times: int = 3) -> float:
    """Returns the median time of ``task``, after one run that does not count."""
    task()
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        task()
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))


def game_rows() -> Iterator[Row]:
    env = Mctf(team_size=2, reward="custom_rew2")
    rng = np.random.default_rng(0)
    lineups = pairings(rng.integers(7, size=(200, 2)), rng.integers(7, size=(200, 2)))
    fixed = fixed_policies(range(7))
    for workers in (1, available_cores()):
        games = Games(env, Workers(workers))
        steps = int(games.play(fixed, lineups, 0, record=True)[0].steps.sum())
        speed = steps / seconds(lambda games=games: games.play(fixed, lineups, 0, record=True))
        target = "50,000 (goal 200,000)" if workers == 1 else ""
        yield f"env steps/s, fixed policies, observed and paid, {workers} thread(s)", f"{speed:,.0f}", target
    trained = parts("population=ppo50", "workers=1")
    acting = trained.optimizer.islands[0].learner.policies(begin(trained).population.minds[0], explore=True)
    lineups = pairings(rng.integers(50, size=(50, 2)), rng.integers(50, size=(50, 2)))
    steps = int(trained.games.play(acting, lineups, 0)[0].steps.sum())
    speed = steps / seconds(lambda: trained.games.play(acting, lineups, 0, record=True))
    yield "env steps/s, four networks of 64x64, 1 thread", f"{speed:,.0f}", ""
    games = Games(env, Workers(available_cores()))
    taken = seconds(lambda: tournament(games, fixed, unordered_teams(7, 2), 10, 0), 1)
    yield "fixed-policy tournament, 3,780 games, s", f"{taken:.1f}", "10"


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


def main() -> None:
    table = Table(
        title=f"{platform.processor() or platform.machine()}, {available_cores()} cores; torch {torch.__version__}"
    )
    for column in ("what", "here", "target"):
        table.add_column(column, justify="left" if column == "what" else "right")
    torch.set_num_threads(1)
    for rows in (game_rows, epoch_rows, learner_rows, selector_rows, start_rows):
        for row in rows():
            table.add_row(*row)
            print(*row, sep=" | ", flush=True)
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
