"""What one vehicle sees: 13 + 16 n numbers, relative to itself, the same for both sides by symmetry.

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

from mctf.compiled import kernel, part
from mctf.geometry import bearing_of, heading_of, home_x, length32, turned
from mctf.rules import BLUE, Rules
from mctf.state import CAPTURES, State

OWN = 21
"""Numbers before the first other vehicle."""
OTHER = 8
"""Numbers for each other vehicle: bearing, distance, its heading relative to the way from it to me
(0: it points at me), speed, has flag, is on its own side, cooldown, is tagged."""


def observation_size(team_size: int) -> int:
    """Returns the length of an observation in games of ``team_size`` a side."""
    return OWN + OTHER * (2 * team_size - 1)


@part
def see(x: float, y: float, heading: float, to_x: float, to_y: float, out: np.ndarray, at: int) -> None:
    """Writes bearing in deg and distance in m from (x, y) to a point to ``out[at]`` and ``out[at + 1]``.

    All coordinates are single-precision numbers, and so is their difference.
    """
    dx, dy = np.float64(np.float32(to_x - x)), np.float64(np.float32(to_y - y))
    out[at] = bearing_of(dx, dy, heading)
    out[at + 1] = length32(dx, dy)


@part
def nearest(at: float, start: float, end: float) -> float:
    """Returns the coordinate in m of the point of a wall that is nearest to a vehicle.

    It is multiplied and divided by the wall's length as in the original, which walks along the walls
    clockwise: the rounding decides the bearing of a wall that is centimetres away.

    Args:
        at: m, the vehicle's coordinate along the wall; single precision as the other two.
        start: m, where the wall starts.
        end: m, where it ends.
    """
    ahead = 1.0 if end > start else -1.0
    along, length = np.float32(ahead * (at - start)), np.float32(ahead * (end - start))
    if along <= 0.0:
        return start
    if along >= length:
        return end
    return np.float64(np.float32(start + ahead * np.float64(along * length / length)))


@kernel
def observe(state: State, b: int, v: int, rules: Rules, raw_out: np.ndarray) -> None:
    """Writes what vehicle ``v`` of game ``b`` sees, in degrees, metres, m/s and seconds.

    Args:
        state: not changed.
        b: game.
        v: vehicle.
        rules: the game's constants.
        raw_out: (13 + 16 n,) float64, overwritten; the fixed policies read it.
    """
    n = rules.team_size
    team = v // n
    heading = state.heading[b, v]
    x = np.float64(np.float32(state.pos[b, v, 0]))
    y = np.float64(np.float32(state.pos[b, v, 1]))
    width, height = np.float64(np.float32(rules.width_m)), np.float64(np.float32(rules.height_m))

    # 1. The field. Blue's walls are top, right, bottom, left; red's are turned by half a circle
    for at, side in ((0, 1 - team), (2, team)):
        dx, dy = home_x(side, rules) - x, rules.height_m / 2.0 - y  # the one pair in double precision
        raw_out[at] = bearing_of(dx, dy, heading)
        raw_out[at + 1] = math.sqrt(dx * dx + dy * dy)
    top, right = (4, 6) if team == BLUE else (8, 10)
    bottom, left = 12 - top, 16 - right
    see(x, y, heading, nearest(x, 0.0, width), height, raw_out, top)
    see(x, y, heading, width, nearest(y, height, 0.0), raw_out, right)
    see(x, y, heading, nearest(x, width, 0.0), 0.0, raw_out, bottom)
    see(x, y, heading, 0.0, nearest(y, 0.0, height), raw_out, left)
    see(x, y, heading, width / 2.0, nearest(y, 0.0, height), raw_out, 12)

    # 2. Itself
    raw_out[14] = state.speed[b, v]
    raw_out[15] = state.has_flag[b, v]
    raw_out[16] = state.on_own_side[b, v]
    raw_out[17] = state.cooldown[b, v]
    raw_out[18] = state.is_tagged[b, v]
    raw_out[19] = state.score[b, team, CAPTURES]
    raw_out[20] = state.score[b, 1 - team, CAPTURES]

    # 3. The others: team-mates, then opponents
    at = OWN
    for side in range(2):
        first = (team if side == 0 else 1 - team) * n
        for other in range(first, first + n):
            if other == v:
                continue
            other_x = np.float64(np.float32(state.pos[b, other, 0]))
            other_y = np.float64(np.float32(state.pos[b, other, 1]))
            see(x, y, heading, other_x, other_y, raw_out, at)
            dx, dy = np.float64(np.float32(x - other_x)), np.float64(np.float32(y - other_y))
            raw_out[at + 2] = turned(state.heading[b, other] - heading_of(dx, dy))
            raw_out[at + 3] = state.speed[b, other]
            raw_out[at + 4] = state.has_flag[b, other]
            raw_out[at + 5] = state.on_own_side[b, other]
            raw_out[at + 6] = state.cooldown[b, other]
            raw_out[at + 7] = state.is_tagged[b, other]
            at += OTHER


@kernel
def normalise(raw: np.ndarray, rules: Rules, out: np.ndarray) -> None:
    """Scales every number of ``raw`` by its range to [-1, 1]; nothing is clipped.

    Ranges: bearings +-180 deg; distances 0 to the diagonal + 10 m, of the middle line 0 to half the width;
    speed 0 to the maximum; yes and no 1 and 0; cooldown and score 0 to their maximum.

    Args:
        raw: (13 + 16 n,) as of ``observe``.
        rules: the game's constants.
        out: (13 + 16 n,) float32, overwritten.
    """
    far = math.sqrt(rules.width_m * rules.width_m + rules.height_m * rules.height_m) + 10.0
    for i in range(0, 14, 2):
        out[i] = np.float32(raw[i]) / np.float32(180.0)
        out[i + 1] = scaled(raw[i + 1], far)
    out[13] = scaled(raw[13], rules.width_m / 2.0)
    out[14] = scaled(raw[14], rules.max_speed)
    out[15] = scaled(raw[15], 1.0)
    out[16] = scaled(raw[16], 1.0)
    out[17] = scaled(raw[17], rules.tagging_cooldown_s)
    out[18] = scaled(raw[18], 1.0)
    out[19] = scaled(raw[19], np.float64(rules.max_score))
    out[20] = scaled(raw[20], np.float64(rules.max_score))
    for at in range(OWN, len(raw), OTHER):
        out[at] = np.float32(raw[at]) / np.float32(180.0)
        out[at + 1] = scaled(raw[at + 1], far)
        out[at + 2] = np.float32(raw[at + 2]) / np.float32(180.0)
        out[at + 3] = scaled(raw[at + 3], rules.max_speed)
        out[at + 4] = scaled(raw[at + 4], 1.0)
        out[at + 5] = scaled(raw[at + 5], 1.0)
        out[at + 6] = scaled(raw[at + 6], rules.tagging_cooldown_s)
        out[at + 7] = scaled(raw[at + 7], 1.0)


@part
def scaled(value: float, top: float) -> float:
    """Returns ``value`` of the range 0 to ``top`` in the range -1 to 1, in single precision throughout."""
    half = np.float32(top / 2.0)
    return (np.float32(value) - half) / half
