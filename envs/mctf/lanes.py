"""The kernels behind the environment and the batch: games side by side, each in a lane, acted upon and looked at."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import typeof
from numpy.typing import NDArray

from mctf.commands import command
from mctf.compiled import kernel, part
from mctf.kernel import RUNNING, advance, finished
from mctf.observe import normalise, observation_size, observe
from mctf.rewards import TERMS, Reward, rewards
from mctf.rules import Rules
from mctf.start import forget, reset
from mctf.state import State, empty
from mctf.view import View

NO_GAME = -1


class Lanes(NamedTuple):
    """B games at a time, and room for a step of them.

    Attributes:
        state: of the games.
        raw: (B, V, O) what is seen, in units.
        seen: (B, V, O) float32, what learners see.
        actions: (B, V) int64 as of ``commands.command``, if they are whole numbers.
        commands: (B, V, 2) as of ``kernel.drive``, if they are not.
        paid: (B, V) for the last step.
        end: (B,) int64 as of ``kernel.finished``, after the last step.
        game: (B,) int64 the number of the game; NO_GAME for none.
    """

    state: State
    raw: NDArray[np.float64]
    seen: NDArray[np.float32]
    actions: NDArray[np.int64]
    commands: NDArray[np.float64]
    paid: NDArray[np.float64]
    end: NDArray[np.int64]
    game: NDArray[np.int64]


class Scratch(NamedTuple):
    """Room for one thread.

    Attributes:
        before: (V, O) what was seen before a step, in units.
        terms: (len(TERMS),) of a reward.
    """

    before: NDArray[np.float64]
    terms: NDArray[np.float64]


def empty_lanes(lanes: int, rules: Rules) -> Lanes:
    """Returns lanes without games."""
    vehicles = rules.blue_size + rules.red_size
    size = (lanes, vehicles, observation_size(rules))
    return Lanes(
        state=empty(lanes, rules),
        raw=np.zeros(size),
        seen=np.zeros(size, np.float32),
        actions=np.zeros((lanes, vehicles), np.int64),
        commands=np.zeros((lanes, vehicles, 2)),
        paid=np.zeros((lanes, vehicles)),
        end=np.full(lanes, RUNNING, np.int64),
        game=np.full(lanes, NO_GAME, np.int64),
    )


def empty_scratch(rules: Rules) -> Scratch:
    """Returns room for one thread."""
    return Scratch(np.zeros((rules.blue_size + rules.red_size, observation_size(rules))), np.zeros(len(TERMS)))


def direct(function: Any, *arguments: Any) -> Callable[..., Any]:
    """Returns the compiled code of a kernel for arguments of these types.

    Calling it spares what Numba needs to find out the types, which for a whole state and a reward takes longer than
    the step of a game. It must be given arguments of the same types, arrays of the same layout included.
    """
    return function.compile(tuple(typeof(argument) for argument in arguments))


@kernel
def step_lanes(lanes: Lanes, first: int, last: int, view: View, rules: Rules, reward: Reward, scratch: Scratch) -> None:
    """Plays one step in each of the lanes ``first`` to ``last - 1`` that have a game, and looks at what came of it.

    Args:
        lanes: changed; ``actions`` or ``commands`` say what is done.
        first: lane.
        last: lane to end before.
        view: how learners act and see.
        rules: the games' constants.
        reward: of every vehicle.
        scratch: of this thread.
    """
    for b in range(first, last):
        if lanes.game[b] == NO_GAME:
            for v in range(lanes.paid.shape[1]):
                lanes.paid[b, v] = 0.0
            continue
        for v in range(rules.blue_size + rules.red_size):
            speed, turn = lanes.commands[b, v, 0], lanes.commands[b, v, 1]
            if not view.continuous:
                speed, turn = command(lanes.state, b, v, lanes.actions[b, v], rules)
            lanes.state.command[b, v, 0], lanes.state.command[b, v, 1] = speed, turn
        advance(lanes.state, b, rules)
        if reward.has_own:
            for v in range(lanes.raw.shape[1]):
                for i in range(lanes.raw.shape[2]):
                    scratch.before[v, i] = lanes.raw[b, v, i]
        see(lanes, b, view, rules)
        rewards(reward, lanes.state, b, rules, scratch.before, lanes.raw[b], scratch.terms, lanes.paid[b])
        lanes.end[b] = finished(lanes.state, b, rules)


@kernel
def start_lanes(lanes: Lanes, which: np.ndarray, seeds: np.ndarray, first_game: int, view: View, rules: Rules) -> None:
    """Starts the games ``first_game``, ``first_game + 1`` and so on in lanes, as long as there are any.

    Args:
        lanes: changed.
        which: (N,) int64 lanes that are free, each gets the next game; those that get none have NO_GAME.
        seeds: (G,) uint64 of all games.
        first_game: not started yet, nor are those after it.
        view: what learners see.
        rules: the games' constants.
    """
    game = first_game
    for b in which:
        lanes.end[b] = RUNNING
        lanes.game[b] = NO_GAME
        forget(lanes.state, b, rules)
        for v in range(lanes.raw.shape[1]):
            for i in range(lanes.seen.shape[2]):
                lanes.seen[b, v, i] = 0.0
        if game < len(seeds):
            lanes.game[b] = game
            lanes.state.stream[b] = seeds[game]
            reset(lanes.state, b, rules)
            see(lanes, b, view, rules)
            game += 1


@kernel
def look(lanes: Lanes, b: int, view: View, rules: Rules) -> None:
    """Writes what is seen in lane ``b`` now, after its state was set."""
    see(lanes, b, view, rules)


@part
def see(lanes: Lanes, b: int, view: View, rules: Rules) -> None:
    """Writes what is seen in lane ``b`` to ``raw`` and ``seen``."""
    observe(lanes.state, b, rules, lanes.raw[b])
    if view.normalised:
        normalise(lanes.raw[b], view.scale, rules, lanes.seen[b])
    else:
        for v in range(lanes.raw.shape[1]):
            for i in range(lanes.raw.shape[2]):
                lanes.seen[b, v, i] = lanes.raw[b, v, i]
