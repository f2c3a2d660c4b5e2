"""Plays recorded episodes again: every step from its recorded state, and whole episodes from their start alone."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.compiled import kernel
from mctf.kernel import RUNNING, TIME_OUT, finished, step
from mctf.observe import normalise, observation_size, observe, ranges
from mctf.recording import STATE, Recording
from mctf.rewards import TERMS, Reward, make_reward, rewards
from mctf.rules import Rules
from mctf.scripted import NAMES, RANDOM, act
from mctf.start import reset
from mctf.state import State, empty

REWARD = make_reward("custom_rew2")
"""The reward of all recordings."""
FORESEEN = NAMES[:RANDOM]
"""Names of the policies whose action follows from what is seen alone."""


class Stepped(NamedTuple):
    """An episode of L rows, each of them computed from the recorded row before.

    Attributes:
        fields: (L, ...) as in the recording; what is not computed, such as random actions, is as recorded.
        choices: number of actions of fixed policies among them.
        kept_out: (L, V) the vehicle touches the keep-out circle in the step that leads away from the row.
    """

    fields: dict[str, NDArray[Any]]
    choices: int
    kept_out: NDArray[np.bool_]


def stepped(recording: Recording, episode: int) -> Stepped:
    """Returns an episode of which each recorded state was put into the kernel and played for one step.

    Contact with a keep-out circle is exact: without the circle the vehicle would have come elsewhere.
    """
    recorded, rules = recording.of(episode), recording.rules[episode]
    actions = recorded["action"].astype(np.int64)
    length, vehicles = actions.shape
    state = _started(recording, episode, length)
    for name in STATE:
        getattr(state, name)[1:] = recorded[name][:-1]
    state.steps[1:] = np.arange(length - 1)

    raw = np.zeros((vehicles, observation_size(rules)))
    chosen = np.full((length, vehicles), -1)
    policies = _policies(recorded["policy"][0], recording.policies)
    choose_each(state, policies, rules, raw, chosen)
    unbounded = State._make(array.copy() for array in state)
    step_each(state, actions, rules)
    step_each(unbounded, actions, rules._replace(flag_keepout_m=0.0))
    seen = np.zeros((length, *raw.shape), np.float32)
    earned, ends = np.zeros((length, vehicles)), np.zeros(length, np.int64)
    perceive_each(state, rules, ranges(rules), REWARD, raw, np.zeros(len(TERMS)), seen, earned, ends)

    fields = {name: getattr(state, name) for name in STATE} | {"obs": seen, "reward": earned} | _over(ends)
    fields["action"] = np.where(chosen >= 0, chosen, actions)
    fields["action"][-1] = -1
    kept_out = np.zeros((length, vehicles), np.bool_)
    kept_out[:-1] = (state.pos != unbounded.pos)[1:].any(axis=-1)
    return Stepped(fields, int((chosen >= 0).sum()), kept_out)


def replayed(recording: Recording, episode: int, names: tuple[str, ...]) -> dict[str, NDArray[Any]]:
    """Returns (L, ...) the fields ``names`` of an episode that was played from its start with the recorded actions."""
    actions, rules = recording.of(episode)["action"].astype(np.int64), recording.rules[episode]
    state, ends = _started(recording, episode, 1), np.zeros(len(actions), np.int64)
    fields = {name: np.repeat(getattr(state, name), len(actions), axis=0) for name in names if name in STATE}
    for row in range(1, len(actions)):
        step(state, 0, actions[row - 1], rules)
        ends[row] = finished(state, 0, rules)
        for name, rows in fields.items():
            rows[row] = getattr(state, name)[0]
    return fields | _over(ends)


def _started(recording: Recording, episode: int, games: int) -> State:
    """Returns games of which the first is at the start of an episode."""
    rules = recording.rules[episode]
    state = empty(games, rules)
    reset(state, 0, rules)
    state.heading_error_prev[0] = recording.memory(episode)
    return state


def _policies(numbers: NDArray[np.int8], names: list[str]) -> NDArray[np.int64]:
    """Returns (V,) the places in ``scripted.NAMES`` of the vehicles' policies, -1 for what cannot be foretold."""
    known = [FORESEEN.index(name) if name in FORESEEN else -1 for name in names]
    return np.array([known[number] for number in numbers], np.int64)


def _over(ends: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
    """Returns what the original calls the ends of ``finished``."""
    return {"terminated": (ends != RUNNING) & (ends != TIME_OUT), "truncated": ends == TIME_OUT}


@kernel
def choose_each(state: State, policies: np.ndarray, rules: Rules, raw: np.ndarray, chosen: np.ndarray) -> None:
    """Writes what the fixed policies do in each of the games 1 to L-1, which are the rows 0 to L-2 of an episode.

    Args:
        state: L games, not changed.
        policies: (V,) places in ``scripted.NAMES``, -1 for others.
        rules: the games' constants.
        raw: (V, O) scratch.
        chosen: (L, V) by row; written for the fixed policies only.
    """
    for row in range(len(chosen) - 1):
        observe(state, row + 1, rules, raw)
        for v in range(len(policies)):
            if policies[v] >= 0:
                chosen[row, v] = act(policies[v], state, row + 1, v, raw[v], rules)


@kernel
def step_each(state: State, actions: np.ndarray, rules: Rules) -> None:
    """Plays one step of each of the games 1 to L-1 with the (L, V) actions of the rows 0 to L-2."""
    for b in range(1, len(actions)):
        step(state, b, actions[b - 1], rules)


@kernel
def perceive_each(
    state: State,
    rules: Rules,
    scale: np.ndarray,
    reward: Reward,
    raw: np.ndarray,
    terms: np.ndarray,
    seen: np.ndarray,
    earned: np.ndarray,
    ends: np.ndarray,
) -> None:
    """Writes what the vehicles of all games see and earn after the step, and which games are over.

    Args:
        state: L games, not changed.
        rules: the games' constants.
        scale: (2, O) as of ``observe.ranges``.
        reward: one that depends on the step alone.
        raw: (V, O) scratch.
        terms: (len(TERMS),) scratch.
        seen: (L, V, O) float32, observations.
        earned: (L, V) rewards.
        ends: (L,) as of ``finished``.
    """
    for b in range(len(ends)):
        observe(state, b, rules, raw)
        normalise(raw, scale, rules, seen[b])
        rewards(reward, state, b, rules, raw, raw, terms, earned[b])
        ends[b] = finished(state, b, rules)
