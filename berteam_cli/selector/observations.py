"""What the members of a team saw, as a selector reads it: every few steps, in half precision."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.env.base import Env
from berteam_cli.outcomes import Experience, Ints

LARGEST = float(np.finfo(np.float16).max)


@dataclass(frozen=True)
class Looking:
    """What of the opponent is known before a team is chosen.

    Attributes:
        use: "none"; "self", winners are learnt together with what their own members saw while they won, as in the
            paper, and teams are chosen without; or "previous_game", every second game of an epoch is against the
            opponents of the one before, and the team for it is chosen on what was seen there.
        stride: steps from one observation that is kept to the next.
        drop_input: chance of an example to be learnt as if nothing had been seen.
        drop_player: chance of each member to be learnt as if it had seen nothing.
        embed: "lstm" (the paper's), "mean" or "attention": what makes one token of what a member saw.
        lstm_layers: of the LSTM.
        rows: R, most observations kept of a member; 0 where nothing is.
        numbers: O of an observation; 0 where none is kept.
    """

    use: str
    stride: int
    drop_input: float
    drop_player: float
    embed: str
    lstm_layers: int
    rows: int
    numbers: int


def looking(settings: dict[str, Any], env: Env) -> Looking:
    """Returns what is known of opponents in ``env`` by the ``settings`` of selector.observations."""
    if settings["use"] == "none":
        return Looking(**settings, rows=0, numbers=0)
    return Looking(**settings, rows=env.longest // settings["stride"] + 1, numbers=env.observation_size)


@dataclass(frozen=True)
class Seen:
    """What was seen by the members of a batch of teams; the leading axes are those of the batch.

    Attributes:
        rows: (..., T, R, O) float16.
        lengths: (..., T) how many of the R rows hold something; 0 for a member who saw nothing.
    """

    rows: npt.NDArray[np.float16]
    lengths: Ints

    def __getitem__(self, which: Any) -> Seen:
        """Returns that of some of the teams."""
        return Seen(self.rows[which], self.lengths[which])


def nothing_seen(batch: tuple[int, ...], team_size: int, rows: int = 0, numbers: int = 0) -> Seen:
    """Returns a batch of teams whose members saw nothing."""
    return Seen(
        np.zeros((*batch, team_size, rows, numbers), dtype=np.float16), np.zeros((*batch, team_size), dtype=np.int64)
    )


def seen_in(experience: Experience, games: int, sides: int, looking: Looking) -> Seen:
    """Returns what the members of all teams saw in their games, (B, S).

    The last observation of each player and every ``stride``-th before it, in the order of time, so that the end of a
    game is never left out.

    Args:
        experience: of the games; a row for each game, or for each player of each game.
        games: B.
        sides: S.
        looking: what is kept.
    """
    observations = experience.observations.reshape(games, sides, -1, *experience.observations.shape[-2:])
    size, stride = observations.shape[2], looking.stride
    each = sides * size * games // len(experience.lengths)  # players that share a length: those of a game, or one
    lengths = experience.lengths.repeat(each).reshape(games, sides, size)
    kept = lengths // stride + 1  # (B, S, T)
    rows = np.zeros((games, sides, size, looking.rows, looking.numbers), dtype=np.float16)
    for k in range(looking.rows):
        b, s, t = np.nonzero(kept > k)
        step = lengths[b, s, t] - stride * (kept[b, s, t] - 1 - k)
        rows[b, s, t, k] = np.clip(observations[b, s, t, step], -LARGEST, LARGEST)
    return Seen(rows, kept)
