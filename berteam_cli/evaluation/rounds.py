"""The games of a tournament, in one round, or in as many as a sequential test of each pair asks for."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.sequential import Sprt
from berteam_cli.evaluation.tournament import Plan, counted, planned, plays_every_order
from berteam_cli.games import Games
from berteam_cli.outcomes import Ints, Lineups, Outcomes, joined_fields
from berteam_cli.rating.copies import chancy_teams
from berteam_cli.training import key


def play_rounds(
    games: Games, policies: Policies, teams: Ints, each: int, test: Sprt, rng: Generator, sheets: Path
) -> tuple[Plan, Outcomes]:
    """Returns all games of a tournament, round by round, and what came of them.

    In the first round every pair plays, in the next those that the test has not decided. Two teams without chance that
    have stood in every order on both sides play no more: their games would be copies.

    Args:
        games: the game and its threads.
        policies: how the players act.
        teams: (K, T).
        each: games of a pair in a round.
        test: of the pairs; its rounds are played at most.
        rng: orders the members and seeds the games.
        sheets: folder where games are kept until all are played.
    """
    sides, (first, second) = games.env.sides, np.triu_indices(len(teams), 1)
    chance = chancy_teams(games.env, policies, teams)
    copied = ~(chance[first] | chance[second]) & plays_every_order(sides, teams, each)
    undecided = np.arange(len(first))
    plan, outcomes = None, None
    for number in range(test.rounds):
        more = planned(sides, teams, (first[undecided], second[undecided]), each, rng)
        title = "Tournament" if test.rounds == 1 else f"Round {number + 1}, {len(undecided)} pairs"
        played = play_all(games, policies, more.lineups, key(rng), title, sheets / f"round_{number}")
        plan = more if plan is None else together(plan, more)
        outcomes = played if outcomes is None else outcomes.followed_by(played)
        if number + 1 < test.rounds:
            record = counted(teams, plan, outcomes).record[:, first, second]
            undecided = np.flatnonzero((test.decided(test.log_ratio(*record)) == 0) & ~copied)
            if not len(undecided):
                break
    assert plan is not None and outcomes is not None
    return plan, outcomes


def together(plan: Plan, more: Plan) -> Plan:
    """Returns the games of ``plan`` and then those of ``more``."""
    lineups = Lineups(*joined_fields(plan.lineups, more.lineups))
    return Plan(lineups, *joined_fields(plan, more)[1:])


def forget_rounds(sheets: Path) -> None:
    """Removes what ``play_rounds`` kept: the tables are written."""
    shutil.rmtree(sheets, ignore_errors=True)
