"""What is done when the training has ended: the teams are rated, and the run is summed up."""

from __future__ import annotations

import logging
import math
import resource
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from berteam_cli.config_groups import EvaluationConfig
from berteam_cli.evaluation.reference import Reference, reference, reference_teams
from berteam_cli.evaluation.truth import Chosen, Truth, choose_teams, truth
from berteam_cli.folder import Manifest
from berteam_cli.outcomes import Floats
from berteam_cli.population import names, policies
from berteam_cli.rating.bootstrap import interval, rank_intervals
from berteam_cli.rating.counts import independent
from berteam_cli.recording import Recorder
from berteam_cli.records import COLUMNS, team_name, write_table
from berteam_cli.training import EVALUATION, Run, generator

log = logging.getLogger("berteam")

END_TABLES = ("elo", "summary")


def conclude(
    settings: EvaluationConfig,
    folder: Path,
    run: Run,
    recorder: Recorder,
    manifest: Manifest,
    seconds: Callable[[], float],
) -> float:
    """Rates the teams, writes elo.csv and summary.csv, and returns the expected Elo, NaN if it is not known.

    Args:
        settings: of the evaluation.
        folder: of the run.
        run: after its last epoch.
        recorder: of the run.
        manifest: where it is said how the evaluation was made.
        seconds: tells how long the run has taken.
    """
    parts = recorder.parts
    distribution = recorder.distribution(run)
    field = parts.selector.field
    if distribution.samples:
        manifest.add(
            team_distribution=f"estimated from {distribution.samples} drawn teams; rows `other` hold what is not listed"
        )
    game = parts.games.env
    opponents = len(reference_teams(game.standard_policies, game.team_size, settings.reference_teams))
    each = opponents * settings.games_per_pair
    budget = run.played if settings.games is None else settings.games
    rng = generator(parts.seed, EVALUATION, run.epoch)
    chosen = choose_teams(distribution, lambda count: parts.selector.sample(run.selection, count, rng), each, budget)
    log.info(
        "Rating %d of %s teams, %d games each, as evaluation.games=%s allows.",
        *(len(chosen), f"{field.teams:,}", each, f"{budget:,}"),
    )
    rated, source = rate(settings, chosen, run, recorder, rng)
    manifest.add(
        evaluation={
            "teams": field.teams,
            "rated": len(chosen),
            "most_probable": int(chosen.listed.sum()),
            "random_sample": int((~chosen.listed).sum()),
            "reference": source,
        }
    )
    called = names(parts.optimizer.islands, run.population)
    write_table(folder / "elo.csv", COLUMNS["elo"], elo_rows(rated, called, exact=distribution.samples == 0))
    expected, width = rated.expected_elo()
    if math.isnan(width):
        log.info("Too few teams were rated to tell the selector's expected Elo; allow more with evaluation.games.")
    best = int(np.argmax(rated.elos)) if len(chosen) else None
    row = (
        *(expected, expected - width, expected + width),
        *(("", math.nan) if best is None else (team_name(chosen.teams[best]), rated.elos[best])),
        *(run.played, run.steps, round(seconds(), 3), peak_rss_mib()),
    )
    write_table(folder / "summary.csv", COLUMNS["summary"], [row])
    return expected


def rate(
    settings: EvaluationConfig, chosen: Chosen, run: Run, recorder: Recorder, rng: np.random.Generator
) -> tuple[Truth, str]:
    """Returns the Elos of the ``chosen`` teams, and where those of their opponents come from."""
    parts = recorder.parts
    if len(chosen) == 0:
        nobody = Truth(chosen, np.zeros(0), np.zeros(0), independent(*np.zeros((3, 0, 0), dtype=np.int64)))
        return nobody, "none: no team was rated"
    watching = recorder.watching  # which knows them already
    known: Reference = watching.reference if watching else reference(parts.games, settings.reference_teams)
    members = policies(parts.optimizer.islands, run.population, explore=False)
    return truth(parts.games, members, chosen, known, settings.games_per_pair, rng), known.source


def elo_rows(
    rated: Truth, called: list[str], samples: Floats | None = None, *, exact: bool
) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of elo.csv, the strongest team first.

    Args:
        rated: the teams.
        called: (N,) the members' names.
        samples: (R, K) Elos after drawing the games anew, of which the intervals are; None: of the half widths.
        exact: whether their probabilities are; else nothing is predicted from them.
    """
    chosen = rated.chosen
    predicted, record = rated.predicted_elos(), rated.record
    unknown = np.full(len(rated.elos), math.nan)
    low, high, ranks = rated.elos - rated.half_widths, rated.elos + rated.half_widths, (unknown, unknown)
    if samples is not None:
        (low, high), ranks = interval(samples), rank_intervals(samples)
    order = np.argsort(-rated.elos, kind="stable")
    place = np.empty(len(order), dtype=int)
    place[np.argsort(-chosen.probability, kind="stable")] = np.arange(1, len(order) + 1)
    for rank, k in enumerate(order, start=1):
        team, results = chosen.teams[k], record[:, k]
        yield (
            *(team_name(team), " + ".join(called[m] for m in team), rated.elos[k], low[k], high[k]),
            *(results.sum(), *results),
            *(chosen.probability[k], rank),
            *((predicted[k], place[k]) if exact else (math.nan, math.nan)),
            *(ranks[0][k], ranks[1][k]),
        )


def peak_rss_mib() -> float:
    """Returns the most memory this process has held, in MiB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return round(peak / (2**20 if sys.platform == "darwin" else 2**10), 1)
