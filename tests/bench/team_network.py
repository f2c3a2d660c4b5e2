"""What is measured of the team network, at the paper's sizes: three layers each, 128 wide, four heads.

Apart from the rows, so that a process that measures the memory of one task loads nothing else:
``python -m tests.bench.team_network NAME`` does the task NAME of TASKS once and prints how much memory it had, in MiB.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import torch
from numpy.random import Generator
from torch import Tensor

from berteam_cli.outcomes import OPEN, Ints
from berteam_cli.selector.base import Field
from berteam_cli.selector.chances import total_distribution
from berteam_cli.selector.embedders import EMBEDDERS, embedder
from berteam_cli.selector.filling import filled
from berteam_cli.selector.masking import masking_loss
from berteam_cli.selector.network import TeamNetwork, odds_of, seeded
from berteam_cli.selector.updates import Learnt, untrained, updated
from berteam_cli.selector.winners import Examples, in_parts

CPU = torch.device("cpu")
NUMBERS, STEPS = 45, 43  # of an observation of MCTF 2v2; of its games of 420 steps, every tenth and the last
MINIBATCH, MINIBATCHES = 64, 8


def made(members: int, size: int, sees: str | None = None) -> tuple[TeamNetwork, Learnt]:
    """Returns a network for teams of ``size``, and its random weights."""
    with seeded(np.random.default_rng(0), CPU):
        reader = None if sees is None else embedder(sees, NUMBERS, 128, 4, 2, 0.1)
        network = TeamNetwork(members, size, 3, 128, 4, 0.1, "append", 1, reader)
    return network, untrained(network, CPU)


def examples(members: int, size: int, steps: int) -> Examples:
    """Returns a made-up minibatch; training shows what was seen in half of it, as it does by default."""
    rng = np.random.default_rng(0)
    teams = rng.integers(members, size=(MINIBATCH, size))
    rows = rng.normal(size=(*teams.shape, steps, NUMBERS)).astype(np.float16)
    ones, sides = np.ones(MINIBATCH), np.zeros(MINIBATCH, dtype=np.int64)
    return Examples(teams, ones, sides, rows, np.full(teams.shape, steps), ones)


def update(members: int, size: int, sees: str | None = None, *, one_by_one: bool = False) -> Callable[[], object]:
    """Returns what takes the steps of one update."""
    network, start = made(members, size, sees)
    minibatches = [examples(members, size, STEPS if sees else 0)] * MINIBATCHES
    loss = partial(loss_of, members)
    if one_by_one:
        network.rows = lambda *_: 1  # type: ignore[method-assign]
    return lambda: updated(
        network,
        start,
        (in_parts(shown, network.rows(size, *shown.rows.shape[1:3])) for shown in minibatches),
        loss,
        np.random.default_rng(0),
        learning_rate=1e-3,
        averaging=0.0,
    )


def loss_of(members: int, network: Callable[..., Tensor], shown: Examples, rng: Generator) -> Tensor:
    return masking_loss(network, shown, members, 0.5, 0.1, rng)


def sampling(members: int, size: int, count: int) -> Callable[[], Ints]:
    """Returns what draws ``count`` teams."""
    network, start = made(members, size)
    rng, known = np.random.default_rng(0), np.zeros(count, dtype=np.int64)
    return lambda: filled(odds_of(network, start.weights, known[:1]), np.full((count, size), OPEN), known, rng)


def total(members: int, size: int) -> Callable[[], object]:
    """Returns what computes a total distribution."""
    network, start = made(members, size)
    field = Field(np.zeros(members, dtype=np.int64), size)
    source = np.zeros(1, dtype=np.int64)
    return lambda: total_distribution(odds_of(network, start.weights, source), field, 0, exchangeable=False)


TASKS: dict[str, Callable[[], Callable[[], object]]] = {
    "nothing": lambda: lambda: None,
    "update": lambda: update(60, 2),
    **{f"update_{name}": partial(update, 60, 2, name) for name in EMBEDDERS},
    "update_large": lambda: update(500, 10),
    "sampling_large": lambda: sampling(500, 10, 100),
    "total_2": lambda: total(60, 2),
    "total_3": lambda: total(50, 3),
}


def peak() -> int:
    """Returns the most memory that this process had, in MiB.

    As Linux tells it: ``getrusage`` says no less than what the process had that started this one, here a large one.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) // 1024  # type: ignore[index]


if __name__ == "__main__":
    torch.set_num_threads(1)
    TASKS[sys.argv[1]]()()
    print(peak())
