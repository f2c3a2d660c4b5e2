"""What the runner asks of a game."""

from __future__ import annotations

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.outcomes import EVENTS, Bools, Floats, Ints


class Results(NamedTuple):
    """Where games write what came of them; row b belongs to game b alone.

    The last five have no rows where nobody is to learn from the games.

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


class Env(Protocol):
    """A kind of game between S = 2 teams of T places; keeps settings only.

    Attributes:
        name: of the config choice.
        team_size: T.
        observation_size: O.
        actions: A, how many discrete actions there are.
        longest: L, steps after which every game is over.
        fixed_policies: names of the scripted players that come with the game.
        standard_policies: how many of them, the first, tournaments are among and teams are measured against.
    """

    name: str
    team_size: int
    observation_size: int
    actions: int
    longest: int
    fixed_policies: tuple[str, ...]
    standard_policies: int

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


def blank_results(env: Env, games: int, *, record: bool) -> Results:
    """Returns room for the results of ``games`` games, and for their trajectories if ``record``."""
    players, kept = 2 * env.team_size, games if record else 0
    return Results(
        scores=np.zeros((games, 2)),
        steps=np.zeros(games, dtype=np.int64),
        events=np.zeros((games, 2, len(EVENTS)), dtype=np.int64),
        terminated=np.zeros(games, dtype=np.bool_),
        observations=np.empty((kept, players, env.longest + 1, env.observation_size), dtype=np.float32),
        actions=np.empty((kept, players, env.longest), dtype=np.int16),
        rewards=np.empty((kept, players, env.longest), dtype=np.float32),
        lengths=np.zeros((kept, players), dtype=np.int64),
        ended=np.zeros((kept, players), dtype=np.bool_),
    )
