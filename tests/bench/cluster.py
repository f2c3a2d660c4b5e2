"""Speed of games on a Ray cluster, of this machine alone."""

from __future__ import annotations

import time
from collections.abc import Iterator
from importlib.util import find_spec

import numpy as np

from berteam_cli.cluster import Cluster
from berteam_cli.games import Games, pairings
from berteam_cli.population import policies
from berteam_cli.training import begin
from berteam_cli.workers import Workers, available_cores
from tests.bench.timing import Row, parts

GAMES = 4_000  # of an evaluation, in batches of 2,000
TIMES = 3


def cluster_rows() -> Iterator[Row]:
    """The same games on this machine's threads and through Ray, in turn."""
    if find_spec("ray") is None:
        yield "workers=ray", "Ray is not installed", ""
        return
    made = parts("experiment=paper_coevolution")
    members = policies(made.optimizer.islands, begin(made).population, explore=True)
    here = Games(made.games.env, Workers(available_cores()))
    there = Games(here.env, here.workers, Cluster())
    rng = np.random.default_rng(0)

    def ratio(games: int, pieces: int, times: int, *, record: bool) -> tuple[float, float]:
        """Returns the median seconds of games through Ray, in so many ``pieces``, and times those of threads."""
        teams = pairings(*rng.integers(50, size=(2, games, 2)))
        taken = np.zeros((2, times))
        for k in range(times):
            for row, who in enumerate((here, there)):
                started = time.perf_counter()
                for piece in range(pieces):
                    who.play(members, teams, piece, record=record)
                taken[row, k] = time.perf_counter() - started
        threads, ray = np.median(taken, axis=1)
        return float(ray), float(ray / threads)

    ratio(64, 1, 1, record=True)  # each process loads what is compiled
    seconds, times = ratio(GAMES // 2, 2, TIMES, record=False)
    yield f"workers=ray on this machine, {GAMES:,} evaluation games: times that of threads", f"{times:.2f}", "1.2"
    yield "  the same, games/s", f"{GAMES / seconds:,.0f}", ""
    seconds, times = ratio(25, 1, 20, record=True)
    yield (
        "workers=ray, the 25 games of an epoch, recorded, s (times that of threads)",
        f"{seconds:.3f} ({times:.1f})",
        "",
    )


ROWS = (cluster_rows,)
