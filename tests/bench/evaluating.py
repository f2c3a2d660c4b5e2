"""Speed of evaluations: games of many teams, and how sure their Elos are."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.reference import reference_teams
from berteam_cli.evaluation.truth import fixture
from berteam_cli.games import Games, pairings
from berteam_cli.population import policies
from berteam_cli.rating.bootstrap import held_samples, samples
from berteam_cli.rating.counts import independent
from berteam_cli.selector.base import unordered_teams
from berteam_cli.training import begin
from berteam_cli.workers import Workers, available_cores
from tests.bench.timing import Row, parts

SHARE = 10  # a tenth of the games is timed, and told as all of them


class Yardstick:
    """The fixed teams, as ``fixture`` wants them; their Elos play no part in how long games take."""

    teams = reference_teams(7, 2, 28)


def game_rows() -> Iterator[Row]:
    """Games of members that have not learnt: they run to the end of their time, which is the longest there are."""
    made = parts("experiment=paper_coevolution")
    members = policies(made.optimizer.islands, begin(made).population, explore=False)
    games = Games(made.games.env, Workers(available_cores()))
    rng = np.random.default_rng(0)
    play_all(games, joined([members, fixed_policies(range(7))]), pairings(*np.zeros((2, 8, 2), np.int64)), 0, "Warming")
    match = fixture(games, members, unordered_teams(50, 2), Yardstick, 1, rng)
    teams = rng.integers(50, size=(2, 60_000 // SHARE, 2))
    for name, acting, lineups, target in (
        ("357,000 evaluation games", match.acting, match.lineups, "8 min"),
        ("60,000 comparison games", members, pairings(*teams), "2 min"),
    ):
        started = time.perf_counter()
        play_all(games, acting, lineups, 0, name)
        taken = time.perf_counter() - started
        rate = len(lineups) / taken
        yield f"{name}, told from a tenth", f"{taken * SHARE / 60:.1f} min ({rate:,.0f}/s)", target


def bootstrap_rows() -> Iterator[Row]:
    rng = np.random.default_rng(0)
    counts = rng.multinomial(10, [0.2, 0.5, 0.3], size=(1830, 28)).transpose(2, 0, 1)
    anchors = rng.normal(1000, 150, 28)
    held_samples(independent(*counts[:, :2]), anchors, rng, 2)
    started = time.perf_counter()
    held_samples(independent(*counts), anchors, rng)
    yield "bootstrap of 1,830 teams, 280 games each, 1,000 resamples", f"{time.perf_counter() - started:.1f} s", "20 s"
    upper = np.triu(rng.multinomial(8, [0.3, 0.4, 0.3], size=(100, 100)).transpose(2, 0, 1), 1)
    wins, draws = upper[0] + upper[2].T, upper[1] + upper[1].T
    samples(wins, draws, wins.T, rng, 2)
    started = time.perf_counter()
    samples(wins, draws, wins.T, rng)
    yield "bootstrap of a tournament of 100 teams, 8 games a pair", f"{time.perf_counter() - started:.1f} s", ""


ROWS = (game_rows, bootstrap_rows)
