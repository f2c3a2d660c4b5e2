"""Marine Capture-the-Flag: whole games of package mctf, compiled, with the players' networks inside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import FIXED, Policies, act
from berteam_cli.env.base import Results
from berteam_cli.errors import RunError
from berteam_cli.outcomes import HABITS, Floats, Ints
from mctf.compiled import kernel, part
from mctf.draws import next_uniform
from mctf.geometry import apart, is_right, team_of, vehicles_of
from mctf.kernel import RUNNING, TIME_OUT, finished, lead, step
from mctf.observe import normalise, observe, ranges
from mctf.practice import BY_THE_RULES, Starts, practise
from mctf.rewards import TERMS, Reward, make_reward, rewards
from mctf.rules import ACTIONS, Rules, make_rules
from mctf.scripted import NAMES as FIXED_POLICIES
from mctf.scripted import PAPER
from mctf.scripted import act as act_fixed
from mctf.shaping import BOUNDS
from mctf.start import forget, reset
from mctf.state import CAPTURED, GRABBED, HIT_WALL, TAGGED, State, empty


@dataclass(frozen=True, init=False, eq=False)
class Mctf:
    """The game of package mctf between two teams of equal size.

    Attributes:
        rules: of the game.
        reward: what learners are paid for.
        scale: (2, O / k) ranges of what players see in a step.
        last_steps: k, how many steps' observations networks see in one, the newest first.
        given: the settings it was made from, besides team_size.
        starts: how games start; other than as the rules say only in ``practice``.
    """

    team_size: int
    rules: Rules
    reward: Reward
    scale: npt.NDArray[np.float32]
    observation_size: int
    last_steps: int
    longest: int
    given: Mapping[str, Any]
    name: str = "mctf"
    sides: int = 2
    actions: int = ACTIONS
    fixed_policies: tuple[str, ...] = field(default=FIXED_POLICIES)
    standard_policies: int = len(PAPER)
    starts: Starts = BY_THE_RULES
    habits: tuple[str, ...] = HABITS

    def __init__(
        self,
        team_size: int,
        reward: str,
        reward_weights: Mapping[str, float | None] | None = None,
        last_steps: int = 1,
        **settings: Any,
    ) -> None:
        """Takes the settings of mctf.rules.make_rules, mctf.rewards.make_reward and mctf.shaping.make_shaping.

        Raises:
            ValueError: a setting is not allowed, or games would be too long to record.
        """
        given = {"reward": reward, "reward_weights": reward_weights, "last_steps": last_steps, **settings}
        shaping = {name: settings.pop(name) for name in BOUNDS if name in settings}
        rules = make_rules(team_size=team_size, **settings)
        if not 1 <= last_steps <= 16:  # rollouts and buffers hold each step so many times
            raise ValueError(f"last_steps must be a whole number from 1 to 16, but is {last_steps!r}.")
        longest = math.ceil(rules.max_time_s / (rules.substeps * rules.tau_s)) + 1  # the clock adds up with rounding
        if longest > 1_000_000:
            raise ValueError(f"max_time_s gives games of {longest} steps; at most 1000000 are allowed.")
        object.__setattr__(self, "team_size", team_size)
        object.__setattr__(self, "rules", rules)
        object.__setattr__(self, "reward", make_reward(reward, reward_weights, shaping))
        object.__setattr__(self, "scale", ranges(rules))
        object.__setattr__(self, "last_steps", last_steps)
        object.__setattr__(self, "observation_size", last_steps * self.scale.shape[1])
        object.__setattr__(self, "longest", longest)
        object.__setattr__(self, "given", given)

    def __reduce__(self) -> tuple[Any, ...]:
        """Returns how it is made again elsewhere: a compiled reward cannot travel, but its name can."""
        return partial(Mctf, self.team_size, **self.given), (), {"starts": self.starts}

    def practice(self, starts: Starts) -> Mctf:
        """Returns the game as it is played for practice, with other starts than the rules'."""
        other = object.__new__(Mctf)
        other.__dict__.update(self.__dict__, starts=starts)
        return other

    def play(  # noqa: D102
        self, games: range, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        span, scratch = (games.start, games.stop), blank_scratch(self, policies)
        reward = self.reward._replace(factors=scratch.factors)
        play_games(*span, players, policies, seeds, results, self.rules, reward, self.scale, self.starts, scratch)
        if self.reward.has_own and len(results.rewards):
            check_paid(games, seeds, results)

    @property
    def reward_weights(self) -> dict[str, float]:
        """The weight of each term of the reward, besides what a function pays."""
        return dict(zip(TERMS, self.reward.weights.tolist(), strict=True))

    def fingerprint(self) -> dict[str, object]:  # noqa: D102
        return {"env": "mctf", **self.rules._asdict()}


def check_paid(games: range, seeds: npt.NDArray[np.uint64], results: Results) -> None:
    """Checks what a function of the user's paid in ``games``.

    Raises:
        RunError: it failed, or gave something else than a finite number.
    """
    for b in games:
        if not np.isfinite(results.rewards[b, :, : results.steps[b]]).all():
            raise RunError(
                f"env.reward must give finite numbers, but failed or did not in game {b}, of seed {seeds[b]}."
            )


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


def blank_scratch(env: Mctf, policies: Policies) -> Scratch:
    """Returns room for the games of ``env``, played by ``policies``."""
    vehicles, numbers = 2 * env.team_size, env.scale.shape[1]
    return Scratch(
        state=empty(1, env.rules),
        raw=np.zeros((vehicles, numbers)),
        before=np.zeros((vehicles, numbers)),
        seen=np.zeros((vehicles, env.observation_size), dtype=np.float32),
        actions=np.zeros(vehicles, dtype=np.int64),
        paid=np.zeros(vehicles),
        terms=np.zeros(len(TERMS)),
        work=np.zeros(2 * (policies.sizes.max() + 1), dtype=np.float32),
        factors=np.ones((vehicles, policies.pay.shape[1])),
    )


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
        results.terminated[b] = finished(state, 0, rules) != TIME_OUT
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
