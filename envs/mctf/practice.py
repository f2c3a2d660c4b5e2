"""Starts for practice: what a game by the rules comes to only after minutes, if at all.

Games that are to tell who is stronger start by ``start.reset`` alone.
"""

import math
from typing import NamedTuple

from mctf.compiled import kernel, part
from mctf.draws import next_uniform
from mctf.geometry import home, own_side, team_of, vehicles_of
from mctf.rules import Rules
from mctf.start import scatter
from mctf.state import State


class Starts(NamedTuple):
    """Chances of a game to start otherwise than the rules say; together at most 1.

    Attributes:
        random: everybody anywhere on the own half.
        near_flag: the same, but one vehicle of either team near the opponents' flag.
        carrying: the same, but one vehicle of either team anywhere on the opponents' half, carrying their flag.
        near_flag_m: how far that is from the flag's home at most, in m.
    """

    random: float = 0.0
    near_flag: float = 0.0
    carrying: float = 0.0
    near_flag_m: float = 0.0


BY_THE_RULES = Starts()
"""No chance of anything else."""


@kernel
def practise(state: State, b: int, starts: Starts, rules: Rules) -> None:
    """Moves the vehicles of a game to a start for practice, or leaves them where they are.

    Args:
        state: of games that were reset; draws from ``stream[b]``, nothing if all chances are 0.
        b: game.
        starts: how likely each kind is.
        rules: the game's constants.
    """
    chance = starts.random + starts.near_flag + starts.carrying
    if chance == 0.0:
        return
    drawn = next_uniform(state.stream, b)
    if drawn >= chance:
        return
    for v in range(rules.blue_size + rules.red_size):
        scatter(state, b, v, team_of(v, rules), rules)
    if drawn >= starts.random:
        us = int(2.0 * next_uniform(state.stream, b))
        first, last = vehicles_of(us, rules)
        raider = first + int((last - first) * next_uniform(state.stream, b))
        if drawn < starts.random + starts.near_flag:
            approach(state, b, raider, 1 - us, starts.near_flag_m, rules)
        else:
            scatter(state, b, raider, 1 - us, rules)
            hand_over(state, b, raider, us)
    for v in range(rules.blue_size + rules.red_size):
        settle(state, b, v, rules)


@part
def approach(state: State, b: int, v: int, them: int, near_m: float, rules: Rules) -> None:
    """Draws a place in the circle of ``near_m`` m around the home of the flag of team ``them``, inside the walls."""
    home_x, home_y = home(them, rules)
    far = near_m * math.sqrt(next_uniform(state.stream, b))
    way = 2.0 * math.pi * next_uniform(state.stream, b)
    margin = rules.agent_radius_m
    state.pos[b, v, 0] = min(max(home_x + far * math.sin(way), margin), rules.width_m - margin)
    state.pos[b, v, 1] = min(max(home_y + far * math.cos(way), margin), rules.height_m - margin)


@part
def hand_over(state: State, b: int, v: int, us: int) -> None:
    """Gives the opponents' flag to vehicle ``v`` of team ``us``; nobody has grabbed it."""
    state.has_flag[b, v] = True
    state.flag_taken[b, 1 - us] = True
    state.pickup[b, us] = True
    state.flag_pos[b, 1 - us, 0], state.flag_pos[b, 1 - us, 1] = state.pos[b, v, 0], state.pos[b, v, 1]


@part
def settle(state: State, b: int, v: int, rules: Rules) -> None:
    """Makes the rest of the state of vehicle ``v`` agree with its new place."""
    for axis in range(2):
        state.prev_pos[b, v, axis] = state.pos[b, v, axis]
        state.was_pos[b, v, axis] = state.pos[b, v, axis]
    state.on_own_side[b, v] = own_side(team_of(v, rules), state.pos[b, v, 0], rules)
