"""Rock, paper, scissors between teams, for trying things out in seconds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from berteam_cli.acting import FIXED, Policies, act
from berteam_cli.env.base import Results
from berteam_cli.outcomes import Ints
from mctf.draws import next_uniform
from rps import HANDS, hands_beaten


@dataclass(frozen=True)
class Rps:
    """The game of package rps: one step, one number to see, three hands to show."""

    team_size: int
    name: str = "rps"
    observation_size: int = 1
    actions: int = len(HANDS)
    longest: int = 1
    fixed_policies: tuple[str, ...] = HANDS
    standard_policies: int = len(HANDS)

    def play(  # noqa: D102
        self, games: range, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        play_games(games.start, games.stop, players, policies, seeds, results)

    def fingerprint(self) -> dict[str, object]:  # noqa: D102
        return {"env": self.name, "team_size": self.team_size}


@njit(cache=True, nogil=True)
def play_games(
    first: int, last: int, players: np.ndarray, policies: Policies, seeds: np.ndarray, results: Results
) -> None:
    """Plays games ``first`` to ``last - 1``; see ``Env.play``. Changes ``results``."""
    vehicles = players.shape[1]
    size = vehicles // 2
    hands = np.zeros(vehicles, dtype=np.int64)
    seen = np.ones(1, dtype=np.float32)
    work = np.zeros(2 * (policies.sizes.max() + 1), dtype=np.float32)
    record = len(results.actions) > 0
    stream = np.zeros(1, dtype=np.uint64)
    for b in range(first, last):
        stream[0] = seeds[b]
        for v in range(vehicles):
            k = players[b, v]
            if policies.kind[k] == FIXED:
                hands[v] = policies.fixed[k]
            else:
                chance, choice = next_uniform(stream, 0), next_uniform(stream, 0)
                hands[v] = act(policies, k, seen, work, chance, choice)
        beaten = hands_beaten(hands[:size], hands[size:]), hands_beaten(hands[size:], hands[:size])
        for side in range(2):
            gap = beaten[1 - side] - beaten[side]
            results.scores[b, side] = 1.0 if gap > 0 else 0.5 if gap == 0 else 0.0
        results.steps[b] = 1
        results.terminated[b] = True
        if record:
            results.observations[b, :, :, :] = 1.0
            for v in range(vehicles):
                side = v // size
                results.actions[b, v, 0] = hands[v]
                results.rewards[b, v, 0] = (beaten[1 - side] - beaten[side]) / size
