"""What a vehicle sees: O = 13 + 8 V numbers, V vehicles of both teams; relative to it, and so alike for both sides.

| index | what |
|---|---|
| 0, 1 | bearing and distance of the opponents' flag home |
| 2, 3 | of the own flag home |
| 4 to 11 | of the nearest point of walls 0 to 3; wall 1 is behind the own flag, wall 3 behind the opponents' |
| 12, 13 | of the nearest point of the line between the halves |
| 14 to 18 | own speed, has flag, is on own side, cooldown, is tagged |
| 19, 20 | score of the own team, of the opponents |
| then 8 each | team-mates, then opponents, by number: ``OTHER`` |
"""

import math

import numpy as np
from numpy.typing import NDArray

from mctf.compiled import kernel, part
from mctf.geometry import heading_of, home, is_right, length32, team_of, turned, vehicles_of
from mctf.rules import Rules
from mctf.state import CAPTURES, State

OWN = 21
"""Numbers before the first other vehicle."""
OTHER = 8
"""Numbers for each other vehicle: bearing, distance, its heading relative to the way from it to me
(0: it points at me), speed, has flag, is on its own side, cooldown, is tagged."""
FLAT = 1e-5
"""Slope up to which an angle is its tangent, to the last bit of a heading in deg."""


def observation_size(rules: Rules) -> int:
    """Returns O, the length of an observation."""
    return OWN + OTHER * (rules.blue_size + rules.red_size - 1)


@kernel
def observe(state: State, b: int, rules: Rules, raw_out: np.ndarray) -> None:
    """Writes what every vehicle of game ``b`` sees, in degrees, metres, m/s and seconds.

    Args:
        state: not changed.
        b: game.
        rules: the game's constants.
        raw_out: (V, O) float64, overwritten; the fixed policies read it.
    """
    for v in range(rules.blue_size + rules.red_size):
        see_field(state, b, v, rules, raw_out[v])
        team = team_of(v, rules)
        raw_out[v, 14] = state.speed[b, v]
        raw_out[v, 15] = state.has_flag[b, v]
        raw_out[v, 16] = state.on_own_side[b, v]
        raw_out[v, 17] = state.cooldown[b, v]
        raw_out[v, 18] = state.is_tagged[b, v]
        raw_out[v, 19] = state.score[b, team, CAPTURES]
        raw_out[v, 20] = state.score[b, 1 - team, CAPTURES]
        for other in range(v):
            see_each_other(state, b, v, other, rules, raw_out)


@part
def rounded(value: float, rules: Rules) -> float:
    """Returns ``value``, in single precision if the rules say so."""
    return np.float64(np.float32(value)) if rules.float32 else value


@part
def see_field(state: State, b: int, v: int, rules: Rules, out: np.ndarray) -> None:
    """Writes the first 14 numbers of vehicle ``v``: bearings in deg and distances in m of homes, walls, middle line.

    For the team on the right walls 0 to 3 are top, right, bottom, left; for the other half a circle further.
    """
    team = team_of(v, rules)
    heading = state.heading[b, v]
    x, y = rounded(state.pos[b, v, 0], rules), rounded(state.pos[b, v, 1], rules)
    width, height = rounded(rules.width_m, rules), rounded(rules.height_m, rules)
    for at, side in ((0, 1 - team), (2, team)):
        home_x, home_y = home(side, rules)
        dx, dy = home_x - x, home_y - y  # double precision in all versions
        out[at] = turned(heading_of(dx, dy) - heading)
        out[at + 1] = math.sqrt(dx * dx + dy * dy)
    top, right = (4, 6) if is_right(team, rules) else (8, 10)
    bottom, left = 12 - top, 16 - right
    look_up_or_down(x, y, nearest(x, 0.0, width, rules), height, heading, rules, out, top)
    look_aside(x, y, width, nearest(y, height, 0.0, rules), heading, rules, out, right)
    look_up_or_down(x, y, nearest(x, width, 0.0, rules), 0.0, heading, rules, out, bottom)
    look_aside(x, y, 0.0, nearest(y, 0.0, height, rules), heading, rules, out, left)
    look_aside(x, y, width / 2.0, nearest(y, 0.0, height, rules), heading, rules, out, 12)


@part
def nearest(at: float, start: float, end: float, rules: Rules) -> float:
    """Returns the coordinate in m of the point of a wall that is nearest to a vehicle.

    In single precision it is multiplied and divided by the wall's length as in the original, which walks along the
    walls clockwise: the rounding decides the bearing of a wall that is centimetres away.

    Args:
        at: m, the vehicle's coordinate along the wall; rounded as the other two.
        start: m, where the wall starts.
        end: m, where it ends.
        rules: the game's constants.
    """
    if not rules.float32:
        return min(max(at, min(start, end)), max(start, end))
    ahead = 1.0 if end > start else -1.0
    along, length = np.float32(ahead * (at - start)), np.float32(ahead * (end - start))
    if along <= 0.0:
        return start
    if along >= length:
        return end
    return np.float64(np.float32(start + ahead * np.float64(along * length / length)))


@part
def look_up_or_down(
    x: float, y: float, to_x: float, to_y: float, heading: float, rules: Rules, out: np.ndarray, at: int
) -> None:
    """Writes bearing in deg and distance in m from (x, y) to a point nearly north or south of it."""
    dx, dy = rounded(to_x - x, rules), rounded(to_y - y, rules)
    if abs(dx) < FLAT * abs(dy):
        way = math.degrees(dx / dy) if dy > 0.0 else 180.0 + math.degrees(dx / dy)
    else:
        way = heading_of(dx, dy)
    out[at] = turned(turned(way) - heading)
    out[at + 1] = length(dx, dy, rules)


@part
def look_aside(
    x: float, y: float, to_x: float, to_y: float, heading: float, rules: Rules, out: np.ndarray, at: int
) -> None:
    """Writes bearing in deg and distance in m from (x, y) to a point nearly east or west of it."""
    dx, dy = rounded(to_x - x, rules), rounded(to_y - y, rules)
    if abs(dy) < FLAT * abs(dx):
        east = 90.0 if dx > 0.0 else -90.0
        way = east - math.degrees(dy / dx)
    else:
        way = heading_of(dx, dy)
    out[at] = turned(turned(way) - heading)
    out[at + 1] = length(dx, dy, rules)


@part
def length(dx: float, dy: float, rules: Rules) -> float:
    """Returns the length in m of a vector."""
    return length32(dx, dy) if rules.float32 else math.sqrt(dx * dx + dy * dy)


@part
def see_each_other(state: State, b: int, v: int, other: int, rules: Rules, out: np.ndarray) -> None:
    """Writes what ``v`` sees of ``other`` and the reverse, which shares the way between them, to ``out`` (V, O)."""
    dx = rounded(rounded(state.pos[b, other, 0], rules) - rounded(state.pos[b, v, 0], rules), rules)
    dy = rounded(rounded(state.pos[b, other, 1], rules) - rounded(state.pos[b, v, 1], rules), rules)
    way, distance = heading_of(dx, dy), length(dx, dy, rules)
    back = heading_of(0.0, 0.0) if distance == 0.0 else turned(way + 180.0)
    describe(state, b, v, other, way, back, distance, rules, out[v])
    describe(state, b, other, v, back, way, distance, rules, out[other])


@part
def describe(
    state: State,
    b: int,
    v: int,
    other: int,
    way: float,
    back: float,
    distance: float,
    rules: Rules,
    out: np.ndarray,
) -> None:
    """Writes the eight numbers that ``v`` sees of ``other``, which is ``distance`` m away.

    Args:
        state: not changed.
        b: game.
        v: who sees.
        other: whom.
        way: heading in deg from ``v`` to ``other``.
        back: heading in deg from ``other`` to ``v``.
        distance: m.
        rules: the game's constants.
        out: (O,) of vehicle ``v``.
    """
    first, last = vehicles_of(team_of(v, rules), rules)
    if first <= other < last:
        place = other - first - (1 if other > v else 0)
    else:
        place = last - first - 1 + other - (rules.blue_size if first == 0 else 0)
    at = OWN + OTHER * place
    out[at] = turned(way - state.heading[b, v])
    out[at + 1] = distance
    out[at + 2] = turned(state.heading[b, other] - back)
    out[at + 3] = state.speed[b, other]
    out[at + 4] = state.has_flag[b, other]
    out[at + 5] = state.on_own_side[b, other]
    out[at + 6] = state.cooldown[b, other]
    out[at + 7] = state.is_tagged[b, other]


def ranges(rules: Rules) -> NDArray[np.float32]:
    """Returns (2, O) float32: middle and half width of the range of every number of an observation.

    Ranges: bearings +-180 deg; distances 0 to the diagonal + ``obs_margin_m``, of the middle line 0 to half the width
    or to the same; speed 0 to the maximum; yes and no 1 and 0; cooldown and score 0 to their maximum.
    """
    out = np.full((2, observation_size(rules)), 0.5, np.float32)
    far = math.sqrt(rules.width_m * rules.width_m + rules.height_m * rules.height_m) + rules.obs_margin_m
    for at in range(0, 14, 2):
        out[0, at], out[1, at] = 0.0, 180.0
        out[:, at + 1] = far / 2.0
    if rules.obs_line_half:
        out[:, 13] = rules.width_m / 2.0 / 2.0
    out[:, 14] = rules.max_speed / 2.0
    out[:, 17] = rules.tagging_cooldown_s / 2.0
    out[:, 19:21] = rules.max_score / 2.0
    for at in range(OWN, out.shape[1], OTHER):
        out[0, at], out[1, at] = 0.0, 180.0
        out[:, at + 1] = far / 2.0
        out[0, at + 2], out[1, at + 2] = 0.0, 180.0
        out[:, at + 3] = rules.max_speed / 2.0
        out[:, at + 6] = rules.tagging_cooldown_s / 2.0
    return out


@kernel
def normalise(raw: np.ndarray, scale: np.ndarray, rules: Rules, out: np.ndarray) -> None:
    """Scales every number of ``raw`` by its range to [-1, 1]; it is cut to that if ``rules.obs_clipped``.

    Args:
        raw: (V, O) as of ``observe``.
        scale: (2, O) as of ``ranges``.
        rules: the game's constants.
        out: (V, O) float32, overwritten.
    """
    for v in range(raw.shape[0]):
        for i in range(raw.shape[1]):
            out[v, i] = (np.float32(raw[v, i]) - scale[0, i]) / scale[1, i]
        if rules.obs_clipped:
            for i in range(raw.shape[1]):
                out[v, i] = min(max(out[v, i], np.float32(-1.0)), np.float32(1.0))
