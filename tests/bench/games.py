"""Speed and memory of the games."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator

import numpy as np
from numba import njit

from berteam_cli.acting import fixed_policies
from berteam_cli.env.mctf import Mctf
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.evaluation.tournament import tournament
from berteam_cli.games import Games, pairings
from berteam_cli.selector.base import unordered_teams
from berteam_cli.training import begin
from berteam_cli.workers import Workers, available_cores
from mctf.kernel import step
from mctf.observe import normalise, observe, ranges
from mctf.rewards import TERMS, make_reward, rewards
from mctf.rules import make_rules
from mctf.scripted import act
from mctf.start import reset
from mctf.state import empty
from tests.bench.timing import Row, parts, seconds

PIECES = 20_000
FIRST_GAME = """
import time; start = time.perf_counter()
import numpy as np, mctf
mctf.play_scripted(np.zeros((1, 4), int), np.zeros(1, np.uint64), mctf.make_rules())
print(time.perf_counter() - start)
"""
MANY_GAMES = """
import pathlib, numpy as np, mctf
from mctf.batch import Batch
mctf.play_scripted(np.zeros((1, 4), int), np.zeros(1, np.uint64), mctf.make_rules())
Batch(2, mctf.make_rules()).start([1, 2])
resident = lambda: int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20
before = resident()
batch = Batch(10_000, mctf.make_rules())
batch.start(np.arange(10_000, dtype=np.uint64))
for _ in range(3):
    batch.step(np.full((10_000, 4), 4))
print(resident() - before)
"""


def step_rows() -> Iterator[Row]:
    """Environment steps a second, observed by all vehicles and paid, played by fixed policies."""
    cores = available_cores()
    speeds = {(size, workers): _steps_a_second(size, workers) for size, workers in ((2, 1), (5, 1), (2, cores))}
    loose = _steps_a_second(2, 1, float32=False)
    alone = speeds.pop((2, 1))
    yield "MCTF 2v2, env steps/s, observed and paid, 1 thread", f"{alone:,.0f}", "200,000"
    yield "the same with env.float32=false", f"{loose:,.0f}", ""
    five = speeds.pop((5, 1))
    yield "5v5, 1 thread: env steps/s", f"{five:,.0f}", ""
    yield "5v5: time of a step, times that of 2v2", f"{alone / five:.1f}", "4"
    for (_, workers), speed in speeds.items():
        yield f"MCTF 2v2, {workers} threads: env steps/s", f"{speed:,.0f}", "400,000"
        yield f"{workers} threads, times one", f"{speed / alone:.2f}", "1.8"


def _steps_a_second(size: int, workers: int, **rules: bool) -> float:
    games = Games(Mctf(team_size=size, reward="custom_rew2", **rules), Workers(workers))
    rng = np.random.default_rng(0)
    lineups = pairings(rng.integers(7, size=(200, size)), rng.integers(7, size=(200, size)))
    steps = int(games.play(fixed_policies(range(7)), lineups, 0, record=True)[0].steps.sum())
    return steps / seconds(lambda: games.play(fixed_policies(range(7)), lineups, 0, record=True), 5)


def game_rows() -> Iterator[Row]:
    """Whole games, with networks and without."""
    rng = np.random.default_rng(0)
    trained = parts("population=ppo50", "workers=1")
    acting = trained.optimizer.islands[0].learner.policies(begin(trained).population.minds[0], explore=True)
    lineups = pairings(rng.integers(50, size=(50, 2)), rng.integers(50, size=(50, 2)))
    steps = int(trained.games.play(acting, lineups, 0)[0].steps.sum())
    speed = steps / seconds(lambda: trained.games.play(acting, lineups, 0, record=True))
    yield "MCTF 2v2, four networks of 64x64, 1 thread: env steps/s", f"{speed:,.0f}", ""
    games = Games(Mctf(team_size=2, reward="custom_rew2"), Workers(available_cores()))
    taken = seconds(lambda: tournament(games, fixed_policies(range(7)), unordered_teams(7, 2), 10, 0), 1)
    yield "fixed-policy tournament, 3,780 games, s", f"{taken:.1f}", "10"


def zoo_rows() -> Iterator[Row]:
    """Environment steps a second through env=pettingzoo, random players; the environment itself is the most of it."""
    env = Pettingzoo(2, "mctf:parallel_env", {"team_size": 2}, {}, 1000, "reward")
    lineups = pairings(np.zeros((32, 2), dtype=np.int64), np.zeros((32, 2), dtype=np.int64))
    for workers in (1, available_cores()):
        games = Games(env, Workers(workers))
        steps = int(games.play(fixed_policies([0]), lineups, 0, record=True)[0].steps.sum())
        speed = steps / seconds(lambda games=games: games.play(fixed_policies([0]), lineups, 0, record=True))
        yield f"env=pettingzoo with MCTF 2v2, {workers} process(es): env steps/s", f"{speed:,.0f}", ""


def piece_rows() -> Iterator[Row]:
    """Where the time of a step goes: each piece alone, repeated in the middle of a game."""
    rules, reward = make_rules(), make_reward()
    state, scale = empty(1, rules), ranges(rules)
    reset(state, 0, rules)
    raw, seen = np.zeros((4, 45)), np.zeros((4, 45), np.float32)
    terms, paid, actions = np.zeros(len(TERMS)), np.zeros(4), np.array([4, 3, 5, 12])

    def timed(piece):
        return f"{1e6 * seconds(lambda: piece(PIECES), 5) / PIECES:.2f}"

    for name, piece in (
        ("motion and events", _steps(state, actions, rules)),
        ("observations of four", _observations(state, rules, raw)),
        ("normalising them", _normalised(raw, scale, rules, seen)),
        ("rewards of four", _rewards(reward, state, rules, raw, terms, paid)),
        ("actions of four hard attackers", _actions(state, rules, raw)),
    ):
        yield f"  of a step: {name}, µs", timed(piece), ""


def _steps(state, actions, rules):
    @njit
    def loop(times, state, actions, rules):
        for moment in range(times):
            if moment % 60 == 0:
                reset(state, 0, rules)
            step(state, 0, actions, rules)

    return lambda times: loop(times, state, actions, rules)


def _observations(state, rules, raw):
    @njit
    def loop(times, state, rules, raw):
        for _ in range(times):
            observe(state, 0, rules, raw)

    return lambda times: loop(times, state, rules, raw)


def _normalised(raw, scale, rules, seen):
    @njit
    def loop(times, raw, scale, rules, seen):
        for _ in range(times):
            normalise(raw, scale, rules, seen)

    return lambda times: loop(times, raw, scale, rules, seen)


def _rewards(reward, state, rules, raw, terms, paid):
    @njit
    def loop(times, reward, state, rules, raw, terms, paid):
        for _ in range(times):
            rewards(reward, state, 0, rules, raw, raw, terms, paid)

    return lambda times: loop(times, reward, state, rules, raw, terms, paid)


def _actions(state, rules, raw):
    @njit
    def loop(times, state, rules, raw):
        chosen = 0
        for _ in range(times):
            for v in range(4):
                chosen += act(2, state, 0, v, raw[v], rules)
        return chosen

    return lambda times: loop(times, state, rules, raw)


def memory_and_start_rows() -> Iterator[Row]:
    """What ten thousand games take, and how long the first one takes to come."""
    used = subprocess.run([sys.executable, "-c", MANY_GAMES], capture_output=True, text=True, check=True).stdout
    yield "MCTF, 10,000 games at once, MiB", f"{float(used):.0f}", "300"
    with tempfile.TemporaryDirectory() as folder:
        for name, target in (
            ("first game, kernels not compiled yet, s", "30"),
            ("first game, compiled before, s", "1"),
        ):
            said = subprocess.run(
                [sys.executable, "-c", FIRST_GAME],
                capture_output=True,
                text=True,
                check=True,
                env=os.environ | {"NUMBA_CACHE_DIR": folder},
            ).stdout
            yield f"MCTF, {name}", f"{float(said):.1f}", target


ROWS = (step_rows, game_rows, zoo_rows, piece_rows, memory_and_start_rows)
