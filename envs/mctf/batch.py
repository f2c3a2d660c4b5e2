"""Many games at once, for learners that act by vectors.

A game depends on its seed and its actions only, so it is the same to the last bit for any number of lanes and threads.
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mctf.kernel import RUNNING
from mctf.lanes import NO_GAME, direct, empty_lanes, empty_scratch, start_lanes, step_lanes
from mctf.rewards import make_reward
from mctf.rules import Rules
from mctf.view import allowed_action, limits, make_view


class Ended(NamedTuple):
    """Games that ended in a step, K of them, by lane.

    Attributes:
        lanes: (K,) where they were played.
        games: (K,) their numbers.
        ends: (K,) as of ``kernel.finished``; TIME_OUT is a truncation unless the reward pays the result
            (``rewards.Reward.ends_on_time``), all others are terminations.
        steps: (K,) how many they took.
        score: (K, 2, 3) captures, tags, grabs of blue and of red.
        events: (K, V, 11) columns as in ``state.EVENTS``.
        observations: (K, V, O) float32, the last ones.
    """

    lanes: NDArray[np.int64]
    games: NDArray[np.int64]
    ends: NDArray[np.int64]
    steps: NDArray[np.int64]
    score: NDArray[np.int64]
    events: NDArray[np.int64]
    observations: NDArray[np.float32]


class Turn(NamedTuple):
    """What learners need to know after a step; all but ``ended`` is overwritten by the next.

    Attributes:
        observations: (B, V, O) float32 of the games that the lanes play now; zeros where there is none.
        rewards: (B, V) of the step.
        done: (B,) whether the game of the step is over; then the lane plays another now.
        games: (B,) the number of the game that the lane plays now, -1 for none.
        ended: what became of the games that are over.
    """

    observations: NDArray[np.float32]
    rewards: NDArray[np.float64]
    done: NDArray[np.bool_]
    games: NDArray[np.int64]
    ended: Ended


class Batch:
    """B lanes in which games of one kind are played in step; a lane whose game is over takes the next that waits."""

    def __init__(
        self,
        lanes: int,
        rules: Rules,
        reward: Any = "custom_rew2",
        reward_weights: dict[str, float] | None = None,
        actions: str = "discrete",
        observations: str = "normalised",
        threads: int = 1,
        shaping: dict[str, float] | None = None,
    ) -> None:
        """Makes room; ``start`` begins.

        Args:
            lanes: B, how many games are played at a time.
            rules: of ``make_rules``.
            reward: as of ``rewards.make_reward``.
            reward_weights: as of ``rewards.make_reward``.
            actions: as of the environment.
            observations: as of the environment.
            threads: that share the lanes.
            shaping: as of ``rewards.make_reward``.

        Raises:
            ValueError: an argument is not allowed.
        """
        if not isinstance(rules, Rules):
            raise ValueError(f"rules must be of make_rules, but is {rules!r}.")
        self.rules, self._reward = rules, make_reward(reward, reward_weights, shaping)
        self._view = make_view(actions, observations, rules)
        self._chunks = chunks(checked_count("lanes", lanes), checked_count("threads", threads))
        self._lanes = empty_lanes(lanes, rules)
        self._scratch = [empty_scratch(rules) for _ in self._chunks]
        self._pool = ThreadPoolExecutor(max(1, len(self._chunks) - 1))
        self._seeds, self._waiting = np.zeros(0, np.uint64), 0
        self._done = np.zeros(lanes, np.bool_)
        self._everyone = np.arange(lanes)
        self._step = direct(step_lanes, self._lanes, 0, lanes, self._view, rules, self._reward, self._scratch[0])
        self._start = direct(start_lanes, self._lanes, self._everyone, self._seeds, 0, self._view, rules)

    def start(self, seeds: ArrayLike) -> Turn:
        """Forgets all games and begins new ones: one in each lane, and the others wait.

        Args:
            seeds: (G,) whole numbers in [0, 2**64), one for each game; a game's number is its place here.

        Raises:
            ValueError: seeds are of another kind.
        """
        self._seeds, self._waiting = checked_seeds(seeds), 0
        self._lanes.paid[:] = 0.0
        self._done[:] = False
        self._fill(self._everyone)
        return self._turn(self._everyone[:0])

    def step(self, actions: ArrayLike) -> Turn:
        """Plays one step of every game; afterwards lanes whose game is over play the next one.

        Args:
            actions: (B, V) whole numbers, or (B, V, 2) numbers if they are continuous; what they are for lanes without
                a game does not matter.

        Raises:
            RuntimeError: there is no game, or the reward function failed.
            ValueError: actions are not allowed; no game has been stepped then.
        """
        lanes = self._lanes
        if not (lanes.game != NO_GAME).any():
            raise RuntimeError("step must come after start and before the end of the last game, but no game is played.")
        self._take(actions)
        work = [
            self._pool.submit(self._step, lanes, first, last, self._view, self.rules, self._reward, scratch)
            for (first, last), scratch in zip(self._chunks[1:], self._scratch[1:], strict=True)
        ]
        self._step(lanes, *self._chunks[0], self._view, self.rules, self._reward, self._scratch[0])
        for one in work:
            one.result()
        unpaid = np.flatnonzero(~np.isfinite(lanes.paid).all(axis=1))
        if len(unpaid):
            raise RuntimeError(
                f"reward must be finite, but the function failed or gave {lanes.paid[unpaid[0]].tolist()} "
                f"in game {lanes.game[unpaid[0]]}."
            )
        np.not_equal(lanes.end, RUNNING, out=self._done)
        return self._turn(np.flatnonzero(self._done))

    def _take(self, actions: ArrayLike) -> None:
        """Copies actions to the lanes if all are allowed."""
        lanes, view = self._lanes, self._view
        given = np.asarray(actions)
        shape = lanes.commands.shape if view.continuous else lanes.actions.shape
        if given.shape != shape or given.dtype.kind not in ("fiu" if view.continuous else "iu"):
            kind = "numbers" if view.continuous else "whole numbers"
            raise ValueError(f"actions must be {kind} of shape {shape}, but has {given.shape} of {given.dtype}.")
        if view.continuous:
            fastest, sharpest = limits(self.rules)
            good = (given[..., 0] >= 0) & (given[..., 0] <= fastest) & (np.abs(given[..., 1]) <= sharpest)
        else:
            good = (given >= 0) & (given < view.actions)
        if not good.all():
            self._refuse(given, good)
        if view.continuous:
            lanes.commands[:] = given
        else:
            np.add(given, view.first_action, out=lanes.actions, casting="unsafe")

    def _refuse(self, given: NDArray[Any], good: NDArray[np.bool_]) -> None:
        """Raises for the first action that is not ``good`` (B, V), unless its lane has no game."""
        bad = np.argwhere(~good & (self._lanes.game != NO_GAME)[:, np.newaxis])
        if len(bad):
            b, v = bad[0]
            raise ValueError(
                f"actions of game {self._lanes.game[b]}, vehicle {v} must be {allowed_action(self._view, self.rules)}, "
                f"but is {given[b, v]}."
            )

    def _turn(self, done: NDArray[np.int64]) -> Turn:
        """Returns the turn after which the games in the lanes ``done`` are over, and has these play others."""
        lanes = self._lanes
        state = lanes.state
        ended = Ended(
            done,
            lanes.game[done],
            lanes.end[done],
            state.steps[done],
            state.score[done],
            state.events[done],
            lanes.seen[done],
        )
        if len(done):
            self._fill(done)
        return Turn(lanes.seen, lanes.paid, self._done, lanes.game, ended)

    def _fill(self, which: NDArray[np.int64]) -> None:
        self._start(self._lanes, which, self._seeds, self._waiting, self._view, self.rules)
        self._waiting = min(self._waiting + len(which), len(self._seeds))


def chunks(count: int, threads: int) -> list[tuple[int, int]]:
    """Returns first and end of the runs of 0 to ``count - 1`` that each of ``threads`` takes, none of them empty."""
    parts = min(threads, count)
    return [(count * i // parts, count * (i + 1) // parts) for i in range(parts)]


def checked_count(name: str, given: Any) -> int:
    """Returns a whole number >= 1, or raises a ValueError."""
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or given < 1:
        raise ValueError(f"{name} must be a whole number >= 1, but is {given!r}.")
    return int(given)


def checked_seeds(given: ArrayLike) -> NDArray[np.uint64]:
    """Returns (G,) uint64 seeds, or raises a ValueError; a copy."""
    seeds = np.asarray(given)
    if seeds.ndim != 1 or seeds.dtype.kind not in "iu":
        raise ValueError(
            f"seeds must be whole numbers in [0, 2**64) of shape (games,), but has {seeds.shape} of {seeds.dtype}."
        )
    if len(seeds) and seeds.min() < 0:
        raise ValueError(f"seeds must be in [0, 2**64), but has {seeds.min()}.")
    return seeds.astype(np.uint64)
