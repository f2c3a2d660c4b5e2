"""Whole games of the fixed policies, compiled; for tournaments of them, for checks and for timing."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike

from mctf.batch import checked_count, checked_seeds, chunks
from mctf.compiled import kernel
from mctf.kernel import RUNNING, finished, step
from mctf.observe import observation_size, observe
from mctf.rules import Rules
from mctf.scripted import NAMES, act
from mctf.start import reset
from mctf.state import State, empty


def play_scripted(policies: ArrayLike, seeds: ArrayLike, rules: Rules, threads: int = 1) -> State:
    """Plays one game with each row of ``policies`` and returns the state after the last step of each.

    Args:
        policies: (B, V) places in ``scripted.NAMES``, blue first.
        seeds: (B,) uint64, where the random policies' draws of each game start.
        rules: the games' constants.
        threads: that share the games; the state is the same for any number.

    Raises:
        ValueError: a shape or a policy does not fit, or threads are none.
    """
    if not isinstance(rules, Rules):
        raise ValueError(f"rules must be of make_rules, but is {rules!r}.")
    given = np.asarray(policies)
    if given.dtype.kind not in "iu":
        raise ValueError(f"policies must be whole numbers, places in scripted.NAMES, but is of {given.dtype}.")
    policies = np.ascontiguousarray(given, dtype=np.int64)
    vehicles = rules.blue_size + rules.red_size
    if policies.ndim != 2 or policies.shape[1] != vehicles:
        raise ValueError(f"policies must have shape (games, {vehicles}), but has {policies.shape}.")
    if policies.size and not (policies.min() >= 0 and policies.max() < len(NAMES)):
        raise ValueError(f"policies must be 0..{len(NAMES) - 1}, but is {policies.min()}..{policies.max()}.")
    streams = checked_seeds(seeds)
    if streams.shape != (len(policies),):
        raise ValueError(f"seeds must have shape ({len(policies)},), one for each game, but has {streams.shape}.")
    state = empty(len(policies), rules)
    state.stream[:] = streams
    seen = (vehicles, observation_size(rules))
    with ThreadPoolExecutor(checked_count("threads", threads)) as pool:
        work = [
            pool.submit(play_games, state, policies, first, last, rules, np.zeros(seen), np.zeros(vehicles, np.int64))
            for first, last in chunks(len(policies), threads)
        ]
    for one in work:
        one.result()
    return state


@kernel
def play_games(
    state: State, policies: np.ndarray, first: int, last: int, rules: Rules, raw: np.ndarray, actions: np.ndarray
) -> None:
    """Plays the games ``first`` to ``last - 1`` of ``state`` from their start to their end.

    Args:
        state: B games, overwritten but for ``stream``, from which the games draw.
        policies: (B, V) int64.
        first: game.
        last: game to end before.
        rules: the games' constants.
        raw: (V, O) scratch.
        actions: (V,) int64 scratch.
    """
    vehicles = rules.blue_size + rules.red_size
    for b in range(first, last):
        reset(state, b, rules)
        while finished(state, b, rules) == RUNNING:
            observe(state, b, rules, raw)
            for v in range(vehicles):
                actions[v] = act(policies[b, v], state, b, v, raw[v], rules)
            step(state, b, actions, rules)
