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
    """The game of package rps: one step, three hands to show, and two sides or more.

    A player sees a 1, and for each other side in turn, its own side + 1 first, the share of the members that show each
    hand: zeros before the step, when nobody has shown any.
    """

    team_size: int
    sides: int = 2
    name: str = "rps"
    actions: int = len(HANDS)
    longest: int = 1
    fixed_policies: tuple[str, ...] = HANDS
    standard_policies: int = len(HANDS)

    @property
    def observation_size(self) -> int:  # noqa: D102
        return 1 + len(HANDS) * (self.sides - 1)

    def play(  # noqa: D102
        self, games: range, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        play_games(games.start, games.stop, self.sides, players, policies, seeds, results)

    def fingerprint(self) -> dict[str, object]:  # noqa: D102
        return {"env": self.name, "team_size": self.team_size, "sides": self.sides}


@njit(cache=True, nogil=True)
def play_games(
    first: int, last: int, sides: int, players: np.ndarray, policies: Policies, seeds: np.ndarray, results: Results
) -> None:
    """Plays games ``first`` to ``last - 1`` between ``sides`` teams; see ``Env.play``. Changes ``results``."""
    vehicles = players.shape[1]
    size = vehicles // sides
    hands = np.zeros(vehicles, dtype=np.int64)
    beaten = np.zeros(sides, dtype=np.int64)
    seen = np.zeros(1 + len(HANDS) * (sides - 1), dtype=np.float32)
    seen[0] = 1.0
    work = np.zeros(2 * (policies.sizes.max() + 1), dtype=np.float32)
    record = len(results.actions) > 0
    stream = np.zeros(1, dtype=np.uint64)
    for b in range(first, last):
        stream[0] = seeds[b]
        for v in range(vehicles):
            k = players[b, v]
            if policies.kind[k] == FIXED:
                hands[v] = policies.fixed[k]
                if policies.epsilon[k] > 0.0 and next_uniform(stream, 0) < policies.epsilon[k]:
                    hands[v] = min(int(next_uniform(stream, 0) * len(HANDS)), len(HANDS) - 1)
            else:
                chance, choice = next_uniform(stream, 0), next_uniform(stream, 0)
                hands[v] = act(policies, k, seen, work, chance, choice)
        count_beaten(hands, beaten)
        share(beaten, results.scores[b])
        results.steps[b] = 1
        results.terminated[b] = True
        if record:
            for v in range(vehicles):
                side = v // size
                results.actions[b, v, 0] = hands[v]
                results.rewards[b, v, 0] = ((beaten.sum() - beaten[side]) / (sides - 1) - beaten[side]) / size
                results.observations[b, v, 0] = seen
                look(hands, side, sides, results.observations[b, v, 1])


@njit(cache=True, nogil=True)
def count_beaten(hands: np.ndarray, beaten: np.ndarray) -> None:
    """Writes to ``beaten``, (S,), how many of each side's hands are beaten; ``hands``, (V,), are of all players."""
    size = len(hands) // len(beaten)
    for side in range(len(beaten)):
        start, end = side * size, (side + 1) * size
        beaten[side] = hands_beaten(hands[start:end], np.concatenate((hands[:start], hands[end:])))


@njit(cache=True, nogil=True)
def share(beaten: np.ndarray, scores: np.ndarray) -> None:
    """Writes to ``scores``, (S,), equal shares of 1 for the sides with fewest ``beaten`` hands, (S,), and 0 else."""
    best = beaten == beaten.min()
    scores[:] = best / best.sum()


@njit(cache=True, nogil=True)
def look(hands: np.ndarray, side: int, sides: int, seen: np.ndarray) -> None:
    """Writes to ``seen``, (O,), what a member of ``side`` sees of the ``hands``, (V,), when they are shown."""
    size = len(hands) // sides
    seen[:] = 0.0
    seen[0] = 1.0
    for turn in range(sides - 1):
        other = (side + 1 + turn) % sides
        for v in range(other * size, (other + 1) * size):
            seen[1 + len(HANDS) * turn + hands[v]] += 1.0
    seen[1:] /= size
