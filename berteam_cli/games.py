"""Plays line-ups: from teams to outcomes and experience. The only place that hands games to threads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from berteam_cli.acting import Policies
from berteam_cli.env.base import Env, Results, Stoppable, Trajectories, blank_results
from berteam_cli.outcomes import NOBODY, Bools, Experience, Ints, Lineups, Outcomes
from berteam_cli.workers import Workers
from mctf.draws import seed_of

GAMES_A_CALL = 8  # at most: enough that calling costs nothing
CALLS = 32  # at least, where there are so many games: enough that threads end together


@dataclass(frozen=True)
class Games:
    """A kind of game and the threads that play it.

    Attributes:
        env: the game.
        workers: the threads.
    """

    env: Env
    workers: Workers

    def play(
        self,
        policies: Policies,
        lineups: Lineups,
        key: int,
        *,
        record: bool = False,
        room: Trajectories | None = None,
    ) -> tuple[Outcomes, Experience]:
        """Returns the outcomes of all ``lineups``, and what the players saw and did.

        Every game draws from its own stream, made from ``key`` and its index, so that neither the number of threads nor
        the other games change it.

        Args:
            policies: how the members of the line-ups act.
            lineups: B games.
            key: below 2**63; games of the same key and index draw the same.
            record: whether anyone will learn; else the experience has no rows.
            room: for the trajectories of B games; what was in it is overwritten. None makes a new one.

        Where players may leave a game early, the experience has a row for each player of each game, (B * V, 1).
        """
        games = len(lineups)
        players = np.ascontiguousarray(lineups.teams.reshape(games, 2 * self.env.team_size))
        seeds = seeds_of(key, games)
        results = blank_results(self.env, games, record=record, room=room)
        each = min(GAMES_A_CALL, max(1, games // CALLS))
        try:
            self.workers.map(
                lambda start: self.env.play(range(start, min(start + each, games)), players, policies, seeds, results),
                range(0, games, each),
            )
        except BaseException:  # Ctrl-C among others
            if isinstance(self.env, Stoppable):
                self.env.stop()
            raise
        outcomes = Outcomes(lineups, results.scores, results.steps, results.events, seeds)
        return outcomes, experience_of(players, results)


def experience_of(players: Ints, results: Results) -> Experience:
    """Returns what the players saw and did: a row for each game, or for each player where players may leave early.

    Args:
        players: (B, V) who played.
        results: of the games.
    """
    kept = len(results.actions)
    seen = (players[:kept], results.observations, results.actions, results.rewards)
    if not results.lengths.any():
        return Experience(*seen, results.steps[:kept], results.terminated[:kept])
    alone = (column.reshape(-1, 1, *column.shape[2:]) for column in seen)
    return Experience(*alone, results.lengths.ravel(), results.ended.ravel())


def seeds_of(key: int, games: int) -> np.ndarray:
    """Returns (games,) uint64 the seed of each game of ``key``."""
    return np.array([seed_of(np.uint64(key), np.uint64(b)) for b in range(games)], dtype=np.uint64)


def pairings(blue: Ints, red: Ints) -> Lineups:
    """Returns the line-ups of games between (B, T) teams ``blue`` and ``red``, without captains."""
    teams = np.stack([blue, red], axis=1)
    nobody = np.full(teams.shape[:2], NOBODY, dtype=np.int64)
    return Lineups(teams, nobody, np.full(teams.shape[:2], np.nan))


def in_turn(games: int, each: int) -> Bools:
    """Returns (games,) which games a team plays as side 1: every second of its ``each`` games, not the first."""
    return np.arange(games) % each % 2 == 1


def both_sides(ours: Ints, theirs: Ints, each: int) -> Lineups:
    """Returns games of (B, T) teams ``ours`` against ``theirs``, from either side in turn.

    Args:
        ours: ``each`` games of the same team in a row.
        theirs: their opponents.
        each: games of each team of ours; all teams are on the same side in their k-th game.
    """
    swapped = in_turn(len(ours), each)[:, np.newaxis]
    return pairings(np.where(swapped, theirs, ours), np.where(swapped, ours, theirs))


def as_side_0(outcomes: Outcomes, each: int) -> Outcomes:
    """Returns the outcomes of ``both_sides`` games with us as side 0 in every record."""
    swapped = in_turn(len(outcomes.steps), each)

    def turned(per_side: np.ndarray) -> np.ndarray:
        per_side = per_side.copy()
        per_side[swapped] = per_side[swapped, ::-1]
        return per_side

    lineups = outcomes.lineups
    return Outcomes(
        Lineups(turned(lineups.teams), turned(lineups.captains), turned(lineups.log_chances)),
        turned(outcomes.scores),
        outcomes.steps,
        turned(outcomes.events),
        outcomes.seeds,
    )
