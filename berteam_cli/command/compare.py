"""berteam compare: which selector and which optimizer is better, and how sure it is (paper, Table 3)."""

from __future__ import annotations

import logging
import math
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from berteam_cli import build
from berteam_cli.command.inspect import narrow, printed, read_table
from berteam_cli.config_commands import CompareConfig
from berteam_cli.errors import InputError
from berteam_cli.evaluation.comparison import Comparison, Figures, Played, compared, counted, planned
from berteam_cli.evaluation.contenders import Contender, algorithms, contenders
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.reference import reference
from berteam_cli.evaluation.sheet import forget
from berteam_cli.folder import logging_to, new_folder
from berteam_cli.outcomes import Ints
from berteam_cli.rating.bootstrap import superiority, with_interval
from berteam_cli.records import COLUMNS, write_table
from berteam_cli.stored import begun
from berteam_cli.terminal import berteam, console, end
from berteam_cli.training import key
from berteam_cli.trust import trusted

log = logging.getLogger("berteam")

FEW = 30  # sampled teams, of which drawing them anew tells less scatter than there is

TABLES = ("comparison", "runs", "versus")
AGENTS_S = ("select_s", "play_s", "learn_s", "renew_s", "probe_s")  # the paper's time of agents


def compare(config: CompareConfig, text: str, folder: Path | None = None) -> float:
    """Plays the runs against each other and the fixed teams, and writes the tables; returns NaN.

    Args:
        config: checked.
        text: the same as yaml, for the folder.
        folder: None makes one.

    Raises:
        InputError: the runs cannot be compared, or the folder is not free.
        RunError: it failed.
    """
    runs = contenders([Path(x) for x in config.runs], trusted(config.trust))
    names, of = algorithms(runs)
    seconds = [times(x.folder) for x in runs]
    # Networks that see fewer steps than others read the newest ones, which come first.
    game = max((x.parts.games.env for x in runs), key=lambda env: env.observation_size)
    games = build.played_by(config.workers, game)
    folder = folder or new_folder("compare")
    if any(folder.resolve() == x.folder.resolve() for x in runs):
        raise InputError(f"out={folder} is one of the runs; choose another folder.")
    broken = [x.broken for x in runs if x.broken]
    facts = {"seed": config.seed, "algorithms": names, "runs": len(runs), "broken_off": broken}
    again = f"Go on with the same command, out={folder} on_exists=resume."
    with (
        begun(folder, config.on_exists, text, "comparison", facts) as manifest,
        logging_to(folder),
        manifest.until_the_end(again=again),
    ):
        for sentence in broken:
            log.info("%s.", sentence)
        known = reference(games, config.reference_teams)
        rng = np.random.default_rng(config.seed)
        plan = planned(runs, of, known, games.env.standard_policies, config.games, config.reference_games, rng)
        sheet = folder / "checkpoint" / "played"
        outcomes = play_all(games, plan.acting, plan.lineups, key(rng), f"Comparing {len(runs)} runs", sheet)
        if min(plan.teams) < FEW:
            log.warning(
                "Only %d teams of a run met the fixed ones: intervals of Elos are too narrow or empty; with a "
                "larger reference_games there are more.",
                min(plan.teams),
            )
        played = counted(plan, outcomes, len(known.teams))
        found = compared(played, of, known, np.random.default_rng([config.seed, 1]))
        manifest.add(games=len(plan.lineups), reference=known.source)
        write_table(folder / "comparison.csv", COLUMNS["comparison"], comparison_rows(found, names, of, seconds))
        write_table(folder / "runs.csv", COLUMNS["runs"], run_rows(found.runs, names, of, runs, seconds))
        write_table(folder / "versus.csv", COLUMNS["versus"], versus_rows(found, played, names, of))
        forget(sheet)
    show(folder, runs)
    return math.nan


def times(folder: Path) -> tuple[float, float]:
    """Returns the seconds that a run takes for an epoch of its agents, and for an update of its selector.

    Raises:
        InputError: its tables cannot be read.
    """
    timing, selector = (read_table(folder, name, whole=False) for name in ("timing", "selector"))
    if timing is None or selector is None or not len(timing):
        return math.nan, math.nan
    updates = int((selector.updates > 0).sum())
    agents = float(timing[list(AGENTS_S)].sum(axis=1).mean())
    return agents, float(timing.selector_s.sum()) / updates if updates else 0.0


def elos(figures: Figures, k: int) -> tuple[float, ...]:
    """Returns the expected and the mixed Elo of player ``k``, each with its interval."""
    expected = with_interval(figures.expected[k], figures.expected_samples[:, k])
    return *expected, *with_interval(figures.mixed[k], figures.mixed_samples[:, k])


def comparison_rows(
    found: Comparison, names: list[str], of: Ints, seconds: list[tuple[float, float]]
) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of comparison.csv, the strongest algorithm first."""
    for a in np.argsort(-found.algorithms.mixed, kind="stable"):
        mine = [x for x, algorithm in zip(seconds, of, strict=True) if algorithm == a]
        middle = with_interval(found.iqm[a], found.iqm_samples[:, a])
        yield names[a], len(mine), *elos(found.algorithms, a), *np.mean(mine, axis=0), *middle


def run_rows(
    figures: Figures, names: list[str], of: Ints, runs: list[Contender], seconds: list[tuple[float, float]]
) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of runs.csv."""
    for r, run in enumerate(runs):
        yield names[of[r]], run.seed, str(run.folder), run.run.epoch, *elos(figures, r), *seconds[r]


def versus_rows(found: Comparison, played: Played, names: list[str], of: Ints) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of versus.csv: each algorithm against each other."""
    owned = (np.arange(len(names))[:, np.newaxis] == of).astype(np.int64)
    counts = np.einsum("ar,rsc,bs->abc", owned, played.versus, owned)
    above = superiority(found.algorithms.mixed_samples)
    for a, b in np.ndindex(len(names), len(names)):
        if a != b:
            score = with_interval(float(found.algorithms.scores[a, b]), found.algorithms.score_samples[:, a, b])
            better = with_interval(float(found.improvement[a, b]), found.improvement_samples[:, a, b])
            yield names[a], names[b], counts[a, b].sum(), *counts[a, b], *score, above[a, b], *better


def show(folder: Path, runs: list[Contender]) -> None:
    """Prints the tables of a comparison of ``runs``."""
    titles = ("Algorithms: Elo with 95 % intervals, seconds", "Runs", "Algorithm against algorithm")
    for name, title in zip(TABLES, titles, strict=True):
        console().print(printed(title, narrow(pd.read_csv(folder / f"{name}.csv"))))
    then = berteam("report", [run.folder for run in runs], shlex.quote(f"compare={folder}"))
    end(folder, [f"{name}.csv" for name in TABLES], then)
