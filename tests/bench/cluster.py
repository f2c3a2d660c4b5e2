"""Speed of games through Ray, on this machine alone."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from berteam_cli.cluster import Cluster
from berteam_cli.evaluation.playing import BATCH
from berteam_cli.games import Games, pairings
from berteam_cli.population import policies
from berteam_cli.training import begin
from berteam_cli.workers import Workers, available_cores
from tests.bench.timing import Row, parts


def cluster_rows() -> Iterator[Row]:
    """Games of members that have not learnt, on threads and through Ray in turn."""
    try:
        import ray  # noqa: PLC0415 (an extra)
    except ImportError:
        yield "workers=ray", "Ray is not installed", ""
        return
    made = parts("experiment=paper_coevolution")
    members = policies(made.optimizer.islands, begin(made).population, explore=True)
    here = Games(made.games.env, Workers(available_cores()))
    there = Games(here.env, here.workers, Cluster())
    rng = np.random.default_rng(0)

    def compared(games: int, times: int, *, record: bool) -> tuple[float, float]:
        """Returns the median seconds that games take on threads, and through Ray."""
        taken = np.zeros((2, times))
        for k in range(times):
            teams = pairings(*rng.integers(50, size=(2, games, 2)))
            for row, who in enumerate((here, there)):
                started = time.perf_counter()
                who.play(members, teams, k, record=record, room=made.room)
                taken[row, k] = time.perf_counter() - started
        threads, far = np.median(taken, axis=1)
        return float(threads), float(far)

    compared(25, 4, record=True)  # each process loads what is compiled
    threads, far = compared(BATCH, 3, record=False)
    said = f"{far / threads:.2f} ({BATCH / far:,.0f}/s)"
    yield f"{BATCH:,} evaluation games through Ray on this machine, times threads", said, "1.2"
    threads, far = compared(25, 20, record=True)
    yield "the 25 games of an epoch, recorded: threads, Ray, s", f"{threads:.3f}, {far:.3f}", ""
    ray.shutdown()


ROWS = (cluster_rows,)
