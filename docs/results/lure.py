"""Looks for a way past scripted teams, by chance: python docs/results/lure.py GAMES SEEDS RED ..., RED as in replay.

Two vehicles drive from place to place by a plan that sees nothing: a place for each of them and each span of the game.
Who is tagged goes home to be freed, and who has the flag drives to the own half, at the height of the place. A quarter
of the plans is drawn anew; then the best is changed at random, and a change stays if it is worth as much. A row of the
table is for a team, its seeds side by side.
"""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
from numba import njit
from tables import markdown

from mctf.commands import STOP
from mctf.kernel import RUNNING, finished, lead, step
from mctf.observe import observation_size, observe
from mctf.rules import Rules, make_rules
from mctf.scripted import NAMES, act
from mctf.start import reset
from mctf.state import State, empty

SPANS, SPAN_S = 10, 42
TURNS = 8  # that an action may ask for, 45 deg apart
DRAWN = 0.25  # of the games: with plans that are drawn anew
CHANGES_M, CHANGED = (2.0, 8.0, 25.0), (0.1, 0.3)  # deviations of changes, and shares of the places that change


class Way(NamedTuple):
    """The first plan that won.

    Attributes:
        games: that were played until then, this one included.
        time_s: that it took.
        apart_m: how far the nearest opponent was at the last grab.
    """

    games: int
    time_s: float
    apart_m: float


SAID = ("won after so many games", "it took, s", "nearest opponent at the grab, m")


@njit  # type: ignore[untyped-decorator]
def between(state: State, v: int, place: tuple[float, float]) -> float:
    """Returns the distance in m of vehicle ``v`` from ``place``."""
    return math.hypot(state.pos[0, v, 0] - place[0], state.pos[0, v, 1] - place[1])


@njit  # type: ignore[untyped-decorator]
def heads_for(state: State, v: int, x: float, y: float) -> int:
    """Returns the action that turns vehicle ``v`` towards (x, y) m, or that stops it there."""
    way_x, way_y = x - state.pos[0, v, 0], y - state.pos[0, v, 1]
    if way_x * way_x + way_y * way_y < 1.0:
        return STOP
    turn = 90.0 - math.degrees(math.atan2(way_y, way_x)) - state.heading[0, v]  # deg, clockwise; action 0 turns by 180
    return round((180.0 - turn) % 360.0 / 45.0) % TURNS


@njit  # type: ignore[untyped-decorator]
def play(state: State, seen: np.ndarray, plan: np.ndarray, red: np.ndarray, rules: Rules) -> tuple[float, float, bool]:
    """Plays a game of blue by ``plan`` (2, SPANS, 2) m against the fixed policies ``red`` (2,).

    Returns:
        What the plan is worth, in m: how far red let itself be lured from its flag while a raider was near, and how far
        the flag was carried; how far in m the nearest opponent was at the last grab; and whether blue won.
    """
    reset(state, 0, rules)
    actions, apart = np.zeros(4, np.int64), math.nan
    lured, carried, held = 0.0, 0.0, False
    while finished(state, 0, rules) == RUNNING:
        observe(state, 0, rules, seen)
        near, away, carrier = math.inf, math.inf, -1
        for v in range(2):
            x, y = plan[v, min(state.steps[0] // SPAN_S, SPANS - 1)]
            if state.is_tagged[0, v]:
                x, y = rules.blue_home_m
            else:
                near = min(near, between(state, v, rules.red_home_m))
            if state.has_flag[0, v]:
                x, carrier = rules.blue_home_m[0], v
            actions[v] = heads_for(state, v, x, y)
            actions[2 + v] = act(red[v], state, 0, 2 + v, seen[2 + v], rules)
            away = min(away, between(state, 2 + v, rules.red_home_m))
        if carrier >= 0:
            carried = max(carried, between(state, carrier, rules.red_home_m))
            if not held:
                place = (state.pos[0, carrier, 0], state.pos[0, carrier, 1])
                apart = min(between(state, 2, place), between(state, 3, place))
        else:
            lured = max(lured, min(away, 3.0 * rules.catch_radius_m) - max(near - rules.catch_radius_m, 0.0))
        held = carrier >= 0
        step(state, 0, actions, rules)
    return lured + 2.0 * carried, apart, lead(state, 0, finished(state, 0, rules)) == 1


def found(red: npt.NDArray[np.int64], games: int, seed: int) -> Way | None:
    """Returns the first plan that wins, if there is one within so many games."""
    rng, rules = np.random.default_rng([seed, *red]), make_rules()  # each team meets plans of its own
    state, seen = empty(1, rules), np.zeros((4, observation_size(rules)))
    field, best, most = np.array([rules.width_m, rules.height_m]), np.zeros((2, SPANS, 2)), -math.inf
    for game in range(games):
        if game < DRAWN * games:
            plan = rng.uniform(0.0, field, best.shape)
        else:
            changed = rng.random((2, SPANS, 1)) < rng.choice(CHANGED)
            plan = np.clip(best + changed * rng.normal(0.0, rng.choice(CHANGES_M), best.shape), 0.0, field)
        worth, apart, won = play(state, seen, plan, red, rules)
        if won:
            return Way(game + 1, float(state.time[0]), apart)
        if worth >= most:
            best, most = plan, worth
    return None


def row(red: str, games: int, seeds: int) -> dict[str, str]:
    """Returns what was found against one team."""
    team = np.array([NAMES.index(name) for name in red.split("-")])
    ways = [found(team, games, seed) for seed in range(seeds)]
    found_by_seed = {
        said: ["none" if way is None else f"{way[at]:,.0f}" for way in ways] for at, said in enumerate(SAID)
    }
    return {"against": red.replace("-", " + ")} | {said: "; ".join(cells) for said, cells in found_by_seed.items()}


if __name__ == "__main__":
    games, seeds = map(int, sys.argv[1:3])
    print(markdown(pd.DataFrame([row(red, games, seeds) for red in sys.argv[3:]])))
