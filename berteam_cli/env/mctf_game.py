"""One whole game of Marine Capture-the-Flag, compiled, with the players' networks inside."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import FIXED, Policies, act
from berteam_cli.env.base import Results
from berteam_cli.outcomes import HABITS, Floats, Ints
from mctf.compiled import kernel, part
from mctf.draws import next_uniform
from mctf.geometry import apart, is_right, team_of, vehicles_of
from mctf.kernel import RUNNING, finished, lead, step
from mctf.observe import normalise, observe
from mctf.practice import Starts, practise
from mctf.rewards import Reward, is_over, rewards
from mctf.rules import ACTIONS, Rules
from mctf.scripted import act as act_fixed
from mctf.start import forget, reset
from mctf.state import CAPTURED, GRABBED, HIT_WALL, TAGGED, State


class Scratch(NamedTuple):
    """Room for one game at a time.

    Attributes:
        state: of one game.
        raw: (V, O / k) what is seen, in units.
        before: (V, O / k) the same a step ago; kept only where a reward wants it.
        seen: (V, O) float32, normalised; of the last k steps, the newest first.
        actions: (V,).
        paid: (V,).
        terms: (len(TERMS),).
        work: (2 * widest layer,) float32, for networks.
        factors: (V, P) of the reward's weights, as of ``Policies.pay``.
    """

    state: State
    raw: Floats
    before: Floats
    seen: npt.NDArray[np.float32]
    actions: Ints
    paid: Floats
    terms: Floats
    work: npt.NDArray[np.float32]
    factors: Floats


@kernel
def play_games(
    first: int,
    last: int,
    players: np.ndarray,
    policies: Policies,
    seeds: np.ndarray,
    results: Results,
    rules: Rules,
    reward: Reward,
    scale: np.ndarray,
    starts: Starts,
    scratch: Scratch,
) -> None:
    """Plays games ``first`` to ``last - 1``, one after the other; see ``Env.play``.

    Args:
        first: row to begin with.
        last: row to end before.
        players: (B, V) row in ``policies`` of each player.
        policies: how everybody acts.
        seeds: (B,) uint64.
        results: changed.
        rules: of the game.
        reward: of learners, with the factors of ``scratch``.
        scale: (2, O / k) as of mctf.observe.ranges.
        starts: of the games.
        scratch: changed.
    """
    state, raw, before, seen, actions = scratch.state, scratch.raw, scratch.before, scratch.seen, scratch.actions
    record = len(results.actions) > 0
    for b in range(first, last):
        state.stream[0] = seeds[b]
        forget(state, 0, rules)
        reset(state, 0, rules)
        practise(state, 0, starts, rules)
        for v in range(scratch.factors.shape[0]):
            for term in range(scratch.factors.shape[1]):
                scratch.factors[v, term] = policies.pay[players[b, v], term]
        moment = 0
        look(state, scale, rules, raw, seen)
        repeat(seen, raw.shape[1])
        while finished(state, 0, rules) == RUNNING:
            for v in range(len(actions)):
                actions[v] = chosen(policies, players[b, v], state, v, raw[v], seen[v], rules, scratch.work)
            if record:
                note(results, b, moment, seen)
                for v in range(len(actions)):
                    results.actions[b, v, moment] = actions[v]
            step(state, 0, actions, rules)
            watch(state, rules, results, b)
            if record and reward.has_own:
                remember(raw, before)
            age(seen, raw.shape[1])
            look(state, scale, rules, raw, seen)
            if record:
                rewards(reward, state, 0, rules, before, raw, scratch.terms, scratch.paid)
                for v in range(len(actions)):
                    results.rewards[b, v, moment] = scratch.paid[v]
            moment += 1
        if record:
            note(results, b, moment, seen)
        results.steps[b] = moment
        results.terminated[b] = is_over(finished(state, 0, rules), reward)
        settle(state, rules, b, results)


@part
def look(state: State, scale: np.ndarray, rules: Rules, raw: np.ndarray, seen: np.ndarray) -> None:
    """Writes what all players see: ``raw`` (V, O / k) in units, the first of ``seen`` (V, O) as networks want it."""
    observe(state, 0, rules, raw)
    normalise(raw, scale, rules, seen)


@part
def age(seen: np.ndarray, numbers: int) -> None:
    """Moves what all players saw, (V, O) with ``numbers`` of each step, one step back; the oldest is forgotten."""
    for v in range(seen.shape[0]):
        for i in range(seen.shape[1] - 1, numbers - 1, -1):
            seen[v, i] = seen[v, i - numbers]


@part
def repeat(seen: np.ndarray, numbers: int) -> None:
    """Fills (V, O) with the first ``numbers`` of each row, as if all steps before had been like this one."""
    for v in range(seen.shape[0]):
        for i in range(numbers, seen.shape[1]):
            seen[v, i] = seen[v, i - numbers]


@part
def remember(raw: np.ndarray, before: np.ndarray) -> None:
    """Copies (V, O) ``raw`` to ``before``; without Numba's memory there are no slices."""
    for v in range(raw.shape[0]):
        for i in range(raw.shape[1]):
            before[v, i] = raw[v, i]


@part
def note(results: Results, b: int, moment: int, seen: np.ndarray) -> None:
    """Writes what all players of game ``b`` see at ``moment`` to ``results``; loops compile faster than slices."""
    for v in range(seen.shape[0]):
        for i in range(seen.shape[1]):
            results.observations[b, v, moment, i] = seen[v, i]


@part
def chosen(
    policies: Policies,
    k: int,
    state: State,
    v: int,
    raw: np.ndarray,
    seen: np.ndarray,
    rules: Rules,
    work: np.ndarray,
) -> int:
    """Returns the action of policy ``k`` for vehicle ``v``; a network draws two numbers, even if it needs none."""
    if policies.kind[k] == FIXED:
        if policies.epsilon[k] > 0.0 and next_uniform(state.stream, 0) < policies.epsilon[k]:
            return min(int(next_uniform(state.stream, 0) * ACTIONS), ACTIONS - 1)
        return act_fixed(policies.fixed[k], state, 0, v, raw, rules)
    chance, choice = next_uniform(state.stream, 0), next_uniform(state.stream, 0)
    return act(policies, k, seen, work, chance, choice)


@part
def watch(state: State, rules: Rules, results: Results, b: int) -> None:
    """Adds where the vehicles of either side are after a step to the row ``b`` of the habits of ``results``."""
    diagonal = math.sqrt(rules.width_m * rules.width_m + rules.height_m * rules.height_m)
    for side in range(2):
        first, last = vehicles_of(side, rules)
        advance, spread = 0.0, 0.0
        for v in range(first, last):
            x, y = state.pos[0, v, 0], state.pos[0, v, 1]
            advance += (rules.width_m - x if is_right(side, rules) else x) / rules.width_m
            for mate in range(v + 1, last):
                spread += apart(x, y, state.pos[0, mate, 0], state.pos[0, mate, 1]) / diagonal
        size = last - first
        results.habits[b, side, 0] += advance / size
        results.habits[b, side, 1] += spread / max(size * (size - 1) // 2, 1)


@part
def settle(state: State, rules: Rules, b: int, results: Results) -> None:
    """Writes scores, events and habits of the finished game to row ``b`` of ``results``; more captures win on time."""
    for side in range(2):
        for habit in range(len(HABITS)):
            results.habits[b, side, habit] /= max(results.steps[b], 1)
    ahead = lead(state, 0, finished(state, 0, rules))
    results.scores[b, 0] = 1.0 if ahead > 0 else 0.5 if ahead == 0 else 0.0
    results.scores[b, 1] = 1.0 - results.scores[b, 0]
    for v in range(rules.blue_size + rules.red_size):
        side = team_of(v, rules)
        results.events[b, side, 0] += state.events[0, v, CAPTURED]
        results.events[b, side, 1] += state.events[0, v, GRABBED]
        results.events[b, side, 2] += state.events[0, v, TAGGED]
        results.events[b, side, 3] += state.events[0, v, HIT_WALL]
