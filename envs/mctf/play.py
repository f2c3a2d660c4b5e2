"""Whole games of the fixed policies, compiled; for tournaments of them, for checks and for timing."""

import numpy as np
from numpy.typing import NDArray

from mctf.compiled import kernel
from mctf.draws import next_uniform
from mctf.kernel import RUNNING, finished, step
from mctf.observe import observation_size, observe
from mctf.rules import Rules
from mctf.scripted import NAMES, act
from mctf.state import State, empty, reset


def play_scripted(policies: NDArray[np.int64], seeds: NDArray[np.uint64], rules: Rules) -> State:
    """Plays one game with each row of ``policies`` and returns the state after the last step of each.

    Args:
        policies: (B, V) places in ``scripted.NAMES``, blue first.
        seeds: (B,) uint64, where the random policies' draws of each game start.
        rules: the games' constants.

    Raises:
        ValueError: a shape or a policy does not fit.
    """
    policies = np.ascontiguousarray(policies, dtype=np.int64)
    vehicles = 2 * rules.team_size
    if policies.ndim != 2 or policies.shape[1] != vehicles:
        raise ValueError(f"policies must have shape (games, {vehicles}), but has {policies.shape}.")
    if policies.size and not (policies.min() >= 0 and policies.max() < len(NAMES)):
        raise ValueError(f"policies must be 0..{len(NAMES) - 1}, but is {policies.min()}..{policies.max()}.")
    streams = np.array(seeds, dtype=np.uint64)
    if streams.shape != (len(policies),):
        raise ValueError(f"seeds must have shape ({len(policies)},), one for each game, but has {streams.shape}.")
    state = empty(len(policies), rules.team_size)
    play_games(
        state, policies, streams, rules, np.zeros(observation_size(rules.team_size)), np.zeros(vehicles, np.int64)
    )
    return state


@kernel
def play_games(
    state: State, policies: np.ndarray, streams: np.ndarray, rules: Rules, raw: np.ndarray, actions: np.ndarray
) -> None:
    """Plays every game of ``state`` from its start to its end.

    Args:
        state: B games, overwritten.
        policies: (B, V) int64.
        streams: (B,) uint64, changed.
        rules: the games' constants.
        raw: (13 + 16 n,) scratch.
        actions: (V,) int64 scratch.
    """
    for b in range(len(policies)):
        reset(state, b, rules)
        while finished(state, b, rules) == RUNNING:
            for v in range(2 * rules.team_size):
                observe(state, b, v, rules, raw)
                actions[v] = act(policies[b, v], raw, rules, next_uniform(streams, b))
            step(state, b, actions, rules)
