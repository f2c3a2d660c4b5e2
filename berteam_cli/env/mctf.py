"""Marine Capture-the-Flag: whole games of package mctf, compiled, with the players' networks inside."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import FIXED, Policies, act
from berteam_cli.env.base import Results
from berteam_cli.outcomes import Ints
from mctf.compiled import kernel, part
from mctf.draws import next_uniform
from mctf.kernel import RUNNING, TIME_OUT, finished, step
from mctf.observe import normalise, observation_size, observe
from mctf.rewards import NAMES as REWARDS
from mctf.rewards import rewards
from mctf.rules import ACTIONS, Rules, make_rules
from mctf.scripted import NAMES as FIXED_POLICIES
from mctf.scripted import act as act_fixed
from mctf.state import CAPTURED, CAPTURES, GRABBED, HIT_WALL, TAGGED, State, empty, reset


@dataclass(frozen=True, init=False)
class Mctf:
    """The game of package mctf between two teams of equal size.

    Attributes:
        rules: of the game.
        reward: what learners are paid for, an index into mctf.rewards.NAMES.
    """

    team_size: int
    rules: Rules
    reward: int
    observation_size: int
    longest: int
    name: str = "mctf"
    actions: int = ACTIONS
    fixed_policies: tuple[str, ...] = field(default=FIXED_POLICIES)

    def __init__(self, team_size: int, reward: str, **settings: Any) -> None:
        """Takes the settings of mctf.rules.make_rules.

        Raises:
            ValueError: a setting is not allowed, or games would be too long to record.
        """
        rules = make_rules(team_size=team_size, **settings)
        longest = math.ceil(rules.max_time_s / (rules.substeps * rules.tau_s)) + 1  # the clock adds up with rounding
        if longest > 1_000_000:
            raise ValueError(f"max_time_s gives games of {longest} steps; at most 1000000 are allowed.")
        object.__setattr__(self, "team_size", team_size)
        object.__setattr__(self, "rules", rules)
        object.__setattr__(self, "reward", REWARDS.index(reward))
        object.__setattr__(self, "observation_size", observation_size(team_size))
        object.__setattr__(self, "longest", longest)

    def play(  # noqa: D102
        self, games: range, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        state = empty(1, self.team_size)
        play_games(games.start, games.stop, players, policies, seeds, results, self.rules, self.reward, state)

    def fingerprint(self) -> dict[str, object]:  # noqa: D102
        return {"env": self.name, **self.rules._asdict()}


@kernel
def play_games(
    first: int,
    last: int,
    players: np.ndarray,
    policies: Policies,
    seeds: np.ndarray,
    results: Results,
    rules: Rules,
    reward: int,
    state: State,
) -> None:
    """Plays games ``first`` to ``last - 1``, one after the other on the same ``state``; see ``Env.play``.

    Args:
        first: row to begin with.
        last: row to end before.
        players: (B, V) row in ``policies`` of each player.
        policies: how everybody acts.
        seeds: (B,) uint64.
        results: changed.
        rules: of the game.
        reward: an index into mctf.rewards.NAMES.
        state: of one game; changed.
    """
    vehicles = 2 * rules.team_size
    record = len(results.actions) > 0
    raw = np.zeros((vehicles, 13 + 16 * rules.team_size))
    seen = np.zeros((vehicles, raw.shape[1]), dtype=np.float32)
    actions = np.zeros(vehicles, dtype=np.int64)
    paid = np.zeros(vehicles)
    work = np.zeros((2, policies.sizes.max() + 1), dtype=np.float32)
    stream = np.zeros(1, dtype=np.uint64)

    for b in range(first, last):
        reset(state, 0, rules)
        stream[0] = seeds[b]
        moment = 0
        look(state, rules, raw, seen)
        while finished(state, 0, rules) == RUNNING:
            for v in range(vehicles):
                actions[v] = chosen(policies, players[b, v], raw[v], seen[v], rules, work, stream)
            if record:
                note(results, b, moment, seen)
                for v in range(vehicles):
                    results.actions[b, v, moment] = actions[v]
            step(state, 0, actions, rules)
            look(state, rules, raw, seen)
            if record:
                rewards(reward, state, 0, rules, paid)
                for v in range(vehicles):
                    results.rewards[b, v, moment] = paid[v]
            moment += 1
        if record:
            note(results, b, moment, seen)
        results.steps[b] = moment
        results.terminated[b] = finished(state, 0, rules) != TIME_OUT
        settle(state, rules, b, results)


@part
def look(state: State, rules: Rules, raw: np.ndarray, seen: np.ndarray) -> None:
    """Writes what all players see: ``raw`` (V, O) in units, ``seen`` (V, O) float32 as networks want it."""
    for v in range(len(raw)):
        observe(state, 0, v, rules, raw[v])
        normalise(raw[v], rules, seen[v])


@part
def note(results: Results, b: int, moment: int, seen: np.ndarray) -> None:
    """Writes what all players of game ``b`` see at ``moment`` to ``results``; loops compile faster than slices."""
    for v in range(seen.shape[0]):
        for i in range(seen.shape[1]):
            results.observations[b, v, moment, i] = seen[v, i]


@part
def chosen(
    policies: Policies, k: int, raw: np.ndarray, seen: np.ndarray, rules: Rules, work: np.ndarray, stream: np.ndarray
) -> int:
    """Returns the action of policy ``k``; every policy draws two numbers, whether it needs them or not."""
    chance, choice = next_uniform(stream, 0), next_uniform(stream, 0)
    if policies.kind[k] == FIXED:
        return act_fixed(policies.fixed[k], raw, rules, choice)
    return act(policies, k, seen, work, chance, choice)


@part
def settle(state: State, rules: Rules, b: int, results: Results) -> None:
    """Writes scores and events of the finished game to row ``b`` of ``results``; more captures win."""
    gap = state.score[0, 0, CAPTURES] - state.score[0, 1, CAPTURES]
    results.scores[b, 0] = 1.0 if gap > 0 else 0.5 if gap == 0 else 0.0
    results.scores[b, 1] = 1.0 - results.scores[b, 0]
    for v in range(2 * rules.team_size):
        side = v // rules.team_size
        results.events[b, side, 0] += state.events[0, v, CAPTURED]
        results.events[b, side, 1] += state.events[0, v, GRABBED]
        results.events[b, side, 2] += state.events[0, v, TAGGED]
        results.events[b, side, 3] += state.events[0, v, HIT_WALL]
