"""Plays line-ups: from teams to outcomes and experience. The only place that hands games to threads and machines."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.env.base import Env, Results, Stoppable, Trajectories, blank_results
from berteam_cli.outcomes import NOBODY, Bools, Experience, Ints, Lineups, Outcomes
from berteam_cli.workers import Workers
from mctf.draws import seed_of

GAMES_A_CALL = 8  # at most: enough that calling costs nothing
CALLS = 32  # at least, where there are so many games: enough that threads end together


class Elsewhere(Protocol):
    """Other machines than this one."""

    def play(
        self, env: Env, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        """Plays all games to their ends, and fills ``results``; see ``Env.play``."""


@dataclass(frozen=True)
class Games:
    """A kind of game and who plays it.

    Attributes:
        env: the game.
        workers: threads that play, and do what else there is to do.
        elsewhere: machines that play in their place, if any.
    """

    env: Env
    workers: Workers
    elsewhere: Elsewhere | None = None

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

        Every game draws from its own stream, made from ``key`` and its index, so that neither who plays it nor the
        other games change it.

        Args:
            policies: how the members of the line-ups act.
            lineups: B games.
            key: below 2**63; games of the same key and index draw the same.
            record: whether anyone will learn; else the experience has no rows.
            room: for the trajectories of B games; what was in it is overwritten. None makes a new one.

        Where players may leave a game early, the experience has a row for each player of each game, (B * V, 1).
        """
        games = len(lineups)
        players = np.ascontiguousarray(lineups.teams.reshape(games, self.env.sides * self.env.team_size))
        seeds = seeds_of(key, games)
        results = blank_results(self.env, games, record=record, room=room)
        try:
            if self.elsewhere is not None:
                self.elsewhere.play(self.env, players, policies, seeds, results)
            else:
                self.play_here(players, policies, seeds, results)
        except BaseException:  # Ctrl-C among others
            if isinstance(self.env, Stoppable):
                self.env.stop()
            raise
        outcomes = Outcomes(lineups, results.scores, results.steps, results.events, seeds, results.habits)
        return outcomes, experience_of(players, results)

    def play_here(self, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results) -> None:
        """Plays all games on the threads, and fills ``results``; see ``Env.play``."""
        games = len(seeds)
        each = min(GAMES_A_CALL, max(1, games // CALLS))
        self.workers.map(
            lambda start: self.env.play(range(start, min(start + each, games)), players, policies, seeds, results),
            range(0, games, each),
        )


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
    columns: Iterable[npt.NDArray[Any]] = (column.reshape(-1, 1, *column.shape[2:]) for column in seen)
    members, observations, actions, rewards = columns
    return Experience(members, observations, actions, rewards, results.lengths.ravel(), results.ended.ravel())


def seeds_of(key: int, games: int) -> np.ndarray:
    """Returns (games,) uint64 the seed of each game of ``key``."""
    return np.array([seed_of(np.uint64(key), np.uint64(b)) for b in range(games)], dtype=np.uint64)


def pairings(blue: Ints, red: Ints, sides: int = 2) -> Lineups:
    """Returns the line-ups of games of (B, T) teams ``blue``, side 0, against ``red`` on all others; no captains."""
    return placed(blue, red, np.arange(sides)[np.newaxis] == 0)


def placed(ours: Ints, theirs: Ints, held: Bools) -> Lineups:
    """Returns the line-ups of games between two teams that hold all sides together, without captains.

    Args:
        ours: (B, T) teams.
        theirs: (B, T) their opponents.
        held: (B, S) or (1, S) the sides where ours stand; theirs stand on all others.
    """
    teams = np.where(held[:, :, np.newaxis], ours[:, np.newaxis], theirs[:, np.newaxis])
    nobody = np.full(teams.shape[:2], NOBODY, dtype=np.int64)
    return Lineups(teams, nobody, np.full(teams.shape[:2], np.nan))


def in_turn(games: int, each: int, sides: int = 2) -> Ints:
    """Returns (games,) the side from which a team plays its ``each`` games: side k % S in the k-th, from 0."""
    return np.arange(games) % each % sides


def both_sides(ours: Ints, theirs: Ints, each: int, sides: int = 2) -> Lineups:
    """Returns games of (B, T) teams ``ours`` against ``theirs``, from each side in turn.

    Args:
        ours: ``each`` games of the same team in a row; it stands on one side.
        theirs: their opponents, who stand on all others.
        each: games of each team of ours; all teams are on the same side in their k-th game.
        sides: S.
    """
    return placed(ours, theirs, np.arange(sides) == in_turn(len(ours), each, sides)[:, np.newaxis])


def as_side_0(outcomes: Outcomes, each: int) -> Outcomes:
    """Returns the outcomes of ``both_sides`` games with us as side 0 in every record, and those after us in turn."""
    games, sides = outcomes.scores.shape
    order = (np.arange(sides) + in_turn(games, each, sides)[:, np.newaxis]) % sides
    row = np.arange(games)[:, np.newaxis]
    lineups = outcomes.lineups
    return Outcomes(
        Lineups(lineups.teams[row, order], lineups.captains[row, order], lineups.log_chances[row, order]),
        outcomes.scores[row, order],
        outcomes.steps,
        outcomes.events[row, order],
        outcomes.seeds,
        None if outcomes.habits is None else outcomes.habits[row, order],
    )


def arrangements(sides: int) -> Bools:
    """Returns (A, S) the ways in which the first of two teams can hold sides, one team standing alone: A = 2 or 2 S.

    In turn the first and the second team stand alone on side 0, then on side 1, and so on. Between two sides both are
    alone, so that only two ways differ.
    """
    alone = np.eye(sides, dtype=np.bool_)
    ways = np.stack([alone, ~alone], axis=1).reshape(2 * sides, sides)
    return ways[:2] if sides == 2 else ways
