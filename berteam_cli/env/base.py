"""What the runner asks of a game."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.outcomes import EVENTS, HABITS, Bools, Floats, Ints


class Results(NamedTuple):
    """Where games write what came of them; row b belongs to game b alone.

    From ``observations`` to ``ended`` there are no rows where nobody is to learn from the games.

    Attributes:
        scores: (B, S).
        steps: (B,).
        events: (B, S, len(EVENTS)).
        terminated: (B,) whether the rules ended the game; else time ran out.
        observations: (B, V, L + 1, O) float32.
        actions: (B, V, L) int16.
        rewards: (B, V, L) float32.
        lengths: (B, V) steps of each player, of a kind of game that players may leave before its end; else zeros.
        ended: (B, V) whether the rules ended such a game for the player.
        habits: (B, S, len(HABITS)); zeros of a game without positions.
    """

    scores: Floats
    steps: Ints
    events: Ints
    terminated: Bools
    observations: npt.NDArray[np.float32]
    actions: npt.NDArray[np.int16]
    rewards: npt.NDArray[np.float32]
    lengths: Ints
    ended: Bools
    habits: Floats


class Env(Protocol):
    """A kind of game between S teams of T places; keeps settings only."""

    @property
    def name(self) -> str:
        """Of the config choice."""

    @property
    def team_size(self) -> int:
        """T."""

    @property
    def sides(self) -> int:
        """S, at least 2."""

    @property
    def observation_size(self) -> int:
        """O."""

    @property
    def actions(self) -> int:
        """A, how many discrete actions there are."""

    @property
    def longest(self) -> int:
        """L, steps after which every game is over."""

    @property
    def fixed_policies(self) -> tuple[str, ...]:
        """Names of the scripted players that come with the game."""

    @property
    def standard_policies(self) -> int:
        """How many of them, the first, tournaments are among and teams are measured against."""

    def play(
        self,
        games: range,
        players: Ints,
        policies: Policies,
        seeds: npt.NDArray[np.uint64],
        results: Results,
    ) -> None:
        """Plays games ``games`` to their ends without holding the interpreter, and fills their rows of ``results``.

        Args:
            games: rows to play; the other rows are not touched.
            players: (B, V) row in ``policies`` of each player, side 0 first.
            policies: how everybody acts.
            seeds: (B,) the stream each game draws from, and nothing else does.
            results: changed.
        """

    def fingerprint(self) -> dict[str, object]:
        """Returns the settings that decide how strong a team is, for finding a table of Elos that fits them."""


@runtime_checkable
class Stoppable(Protocol):
    """A kind of game whose games take long."""

    def stop(self) -> None:
        """Ends games that other threads play, since nobody waits for them any more; no more can be played."""


@runtime_checkable
class Weighing(Protocol):
    """A kind of game that pays a player by weighted terms, which ``Policies.pay`` multiplies."""

    @property
    def reward_weights(self) -> dict[str, float]:
        """The weight of each term, in the order of the columns of ``Policies.pay``."""


@runtime_checkable
class Spatial(Protocol):
    """A kind of game with positions."""

    @property
    def habits(self) -> tuple[str, ...]:
        """Which of HABITS it measures."""


class Trajectories(NamedTuple):
    """Room for what the players of a batch of games see and do; fields as of Results."""

    observations: npt.NDArray[np.float32]
    actions: npt.NDArray[np.int16]
    rewards: npt.NDArray[np.float32]
    lengths: Ints
    ended: Bools


def blank_trajectories(env: Env, games: int) -> Trajectories:
    """Returns room for the trajectories of ``games`` games; the memory is taken when they are written."""
    players = env.sides * env.team_size
    return Trajectories(
        observations=np.empty((games, players, env.longest + 1, env.observation_size), dtype=np.float32),
        actions=np.empty((games, players, env.longest), dtype=np.int16),
        rewards=np.empty((games, players, env.longest), dtype=np.float32),
        lengths=np.zeros((games, players), dtype=np.int64),
        ended=np.zeros((games, players), dtype=np.bool_),
    )


def trajectory_bytes(env: Env, games: int) -> int:
    """Returns how much memory ``blank_trajectories`` takes when all games are as long as they can be."""
    a_step = 4 * env.observation_size + 2 + 4
    return games * env.sides * env.team_size * (env.longest * a_step + 4 * env.observation_size + 8 + 1)


def blank_results(env: Env, games: int, *, record: bool, room: Trajectories | None = None) -> Results:
    """Returns room for the results of ``games`` games; if ``record`` trajectories go to ``room``, or to a new one."""
    trajectories = room if record and room is not None else blank_trajectories(env, games if record else 0)
    return Results(
        np.zeros((games, env.sides)),
        np.zeros(games, dtype=np.int64),
        np.zeros((games, env.sides, len(EVENTS)), dtype=np.int64),
        np.zeros(games, dtype=np.bool_),
        *trajectories,
        np.zeros((games, env.sides, len(HABITS))),
    )
