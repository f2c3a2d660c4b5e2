"""berteam tournament: every team against every other, of the fixed policies or of trained runs."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from berteam_cli.command.entrants import players, runs_of, with_game_of
from berteam_cli.command.inspect import show
from berteam_cli.config_commands import TournamentConfig
from berteam_cli.evaluation.certainty import (
    Cells,
    cells,
    cycles,
    davidson_samples,
    elo_samples,
    results_of,
    scores_of,
    strategies,
)
from berteam_cli.evaluation.rounds import forget_rounds, play_rounds
from berteam_cli.evaluation.sequential import Sprt
from berteam_cli.evaluation.tournament import Standings, counted, plays_every_order
from berteam_cli.folder import logging_to, new_folder
from berteam_cli.outcomes import SIDES, Floats
from berteam_cli.rating.bootstrap import interval, rank_intervals, superiority
from berteam_cli.rating.copies import chancy_teams, clusters
from berteam_cli.rating.davidson import davidson
from berteam_cli.rating.paper import in_order, online_elos, squared_error_elos
from berteam_cli.recording import game_rows, side_rows
from berteam_cli.records import COLUMNS, SIDES_TABLE, team_name, team_names, write_table
from berteam_cli.stored import begun

log = logging.getLogger("berteam")

VERDICTS = {1: "stronger", -1: "weaker", 0: "open"}


def tournament(config: TournamentConfig, text: str, folder: Path | None = None) -> float:
    """Plays as configured and writes the tables; returns NaN, having no figure of its own.

    Args:
        config: checked.
        text: the same as yaml, for the folder.
        folder: None makes one.

    Raises:
        InputError: the config does not go together, or the folder is not free.
        RunError: it failed.
    """
    entry, runs = players(config), runs_of(config)
    if runs:
        text = with_game_of(runs[0], text)
    folder = folder or new_folder("tournament")
    facts = {"seed": config.seed, "teams": len(entry.teams), "pairs": len(entry.teams) * (len(entry.teams) - 1) // 2}
    with begun(folder, config.on_exists, text, "tournament", facts | entry.facts) as manifest, logging_to(folder):
        log.info("%d teams, %d pairs, %d games each.", facts["teams"], facts["pairs"], config.games_per_pair)
        with manifest.until_the_end(again=f"Go on with the same command and out={folder} on_exists=resume."):
            rng = np.random.default_rng(config.seed)
            sides, test, sheets = entry.games.env.sides, Sprt(**asdict(config.sprt)), folder / "checkpoint"
            plan, outcomes = play_rounds(
                entry.games, entry.policies, entry.teams, config.games_per_pair, test, rng, sheets
            )
            standings = counted(entry.teams, plan, outcomes)
            alike = clusters(entry.games.env, entry.policies, plan.lineups.teams)
            copied = int((alike != np.arange(len(alike))).sum())
            if copied:
                log.info("%d of %d games are copies of others, and make no Elo surer.", copied, len(alike))
            manifest.add(copies=copied, games=len(alike))
            chance = chancy_teams(entry.games.env, entry.policies, entry.teams)
            known = cells(standings, alike, chance, plays_every_order(sides, entry.teams, config.games_per_pair))
            write(folder, standings, known, entry.names, config.rating, test, np.random.default_rng([config.seed, 1]))
            forget_rounds(sheets)
    show(folder, 10)
    return math.nan


def write(
    folder: Path,
    standings: Standings,
    games: Cells,
    called: list[str],
    rating: str,
    test: Sprt,
    rng: np.random.Generator,
) -> None:
    """Writes all tables of a tournament between players who are ``called`` so."""
    standings, drawn = rated(standings, games, rating, rng)
    write_table(folder / "elo.csv", COLUMNS["elo"], elo_rows(standings, drawn, called))
    write_table(folder / "pairs.csv", COLUMNS["pairs"], pair_rows(standings, drawn, test))
    if rating == "paper":
        elos = online_elos(len(standings.teams), in_order(standings.pairs, first_scores(standings)))
        order = np.argsort(-elos, kind="stable")
        rows = zip(team_names(standings.teams[order]), elos[order], strict=True)
        write_table(folder / "online_elo.csv", COLUMNS["online_elo"], rows)
    names = team_names(standings.teams)
    scores = scores_of(games, len(names), games.counts.astype(float))
    order = np.argsort(-standings.elos, kind="stable")
    write_table(
        folder / "crosstable.csv",
        [*COLUMNS["crosstable"], *(names[k] for k in order)],
        ((names[k], *(math.nan if j == k else scores[k, j] for j in order)) for k in order),
    )
    write_table(
        folder / "cycles.csv",
        COLUMNS["cycles"],
        ((" > ".join(names[k] for k in circle), *sure) for circle, *sure in cycles(games, len(names))),
    )
    write_table(folder / "strategies.csv", COLUMNS["strategies"], strategy_rows(standings, games, called, rng))
    write_table(folder / "games.csv", COLUMNS["games"], game_rows(0, standings.outcomes))
    if len(standings.results) > 2:
        write_table(folder / f"{SIDES_TABLE}.csv", COLUMNS[SIDES_TABLE], side_rows(0, standings.outcomes))


def strategy_rows(
    standings: Standings, games: Cells, called: list[str], rng: np.random.Generator
) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of strategies.csv, who is most of alpha-rank first."""
    found = strategies(games, len(standings.teams), rng)
    for k in np.argsort(-found.alpha_rank[0], kind="stable"):
        team = standings.teams[k]
        members = " + ".join(called[m] for m in team)
        yield team_name(team), members, *found.alpha_rank[:, k], *found.nash[:, k]


def rated(standings: Standings, games: Cells, rating: str, rng: np.random.Generator) -> tuple[Standings, Floats | None]:
    """Returns the standings with Elos as ``rating`` tells, and (R, K) of them as other games might have given them.

    The paper's ways have no such samples.
    """
    players = len(standings.teams)
    if rating == "ml":
        return standings, elo_samples(standings, games, rng)
    if rating == "davidson":
        found = davidson(*results_of(games, players, games.counts.astype(float)))
        log.info("Two equal teams draw with chance %.2f (Davidson's model).", found.nu / (2 + found.nu))
        return replace(standings, elos=found.elos), davidson_samples(games, players, rng)
    elos = squared_error_elos(standings.points, standings.games.astype(float))
    return replace(standings, elos=elos), None


def first_scores(standings: Standings) -> Floats:
    """Returns (B,) what the first team of each game made, between two sides."""
    return np.where(standings.first_held, standings.outcomes.scores, 0.0).sum(axis=1)


def elo_rows(standings: Standings, drawn: Floats | None, called: list[str]) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of elo.csv, the strongest team first; nobody predicted anything here."""
    won, drew, lost = standings.record.sum(axis=2)
    unknown = np.full(len(standings.elos), math.nan)
    low, high, best, worst = (unknown,) * 4 if drawn is None else (*interval(drawn), *rank_intervals(drawn))
    for rank, k in enumerate(np.argsort(-standings.elos, kind="stable"), start=1):
        team = standings.teams[k]
        yield (
            *(team_name(team), " + ".join(called[m] for m in team), standings.elos[k], low[k], high[k]),
            *(won[k] + drew[k] + lost[k], won[k], drew[k], lost[k], math.nan, rank, math.nan, math.nan),
            *(best[k], worst[k]),
        )


def pair_rows(standings: Standings, drawn: Floats | None, test: Sprt) -> Iterator[tuple[Any, ...]]:
    """Returns the rows of pairs.csv: each team against each other, apart for the side it played alone."""
    names, players = team_names(standings.teams), len(standings.teams)
    stronger = np.full((players, players), math.nan) if drawn is None else superiority(drawn)
    # As it was asked of the team of the smaller index; of the other it is the opposite.
    ratio = np.triu(test.log_ratio(*standings.record), 1)
    ratio = ratio - ratio.T
    for k, j in np.ndindex(players, players):
        verdict: tuple[float, str] = (math.nan, "")
        if test.rounds > 1:
            decided = int(test.decided(ratio[k, j] if k < j else -ratio[k, j]))
            verdict = float(ratio[k, j]), VERDICTS[decided if k < j else -decided]
        for color, results in zip(SIDES, standings.results, strict=False):
            counts = results[:, k, j]
            if counts.sum():
                yield names[k], names[j], counts.sum(), *counts, color, stronger[k, j], *verdict
