"""Angles and points: degrees clockwise from north (+y), metres from the lower left corner."""

import math

import numpy as np

from mctf.compiled import part
from mctf.rules import BLUE, RED, Rules


@part
def wrapped(angle: float) -> float:
    """Returns ``angle`` in [-180, 180] deg; both ends occur, neither is turned into the other."""
    while angle > 180.0:
        angle -= 360.0
    while angle < -180.0:
        angle += 360.0
    return angle


@part
def turned(angle: float) -> float:
    """Returns ``angle``, from -360 to below 720 deg, modulo 360 and then wrapped.

    To the bit what ``wrapped(angle % 360)`` is; without the division that took a fifth of a step.
    """
    if angle < 0.0:
        angle += 360.0
    elif angle >= 360.0:
        angle -= 360.0
    return angle - 360.0 if angle > 180.0 else angle


@part
def heading_of(x: float, y: float) -> float:
    """Returns the heading in deg of the vector (``x``, ``y``)."""
    return turned(90.0 - math.degrees(math.atan2(y, x)))


@part
def bearing_of(x: float, y: float, heading: float) -> float:
    """Returns the heading in deg of the vector (``x``, ``y``) relative to ``heading``."""
    return turned(heading_of(x, y) - heading)


@part
def length32(x: float, y: float) -> float:
    """Returns the length of (``x``, ``y``), computed in single precision throughout."""
    x32, y32 = np.float32(x), np.float32(y)
    return np.float64(np.sqrt(x32 * x32 + y32 * y32))


@part
def apart(x1: float, y1: float, x2: float, y2: float) -> float:
    """Returns the distance in m between two points."""
    return math.sqrt((x1 - x2) * (x1 - x2) + (y1 - y2) * (y1 - y2))


@part
def team_of(v: int, rules: Rules) -> int:
    """Returns the team of a vehicle."""
    return BLUE if v < rules.blue_size else RED


@part
def vehicles_of(team: int, rules: Rules) -> tuple[int, int]:
    """Returns the team's first vehicle and the one behind its last."""
    return (0, rules.blue_size) if team == BLUE else (rules.blue_size, rules.blue_size + rules.red_size)


@part
def home(team: int, rules: Rules) -> tuple[float, float]:
    """Returns x and y in m of the home of the team's flag."""
    return rules.blue_home_m if team == BLUE else rules.red_home_m


@part
def is_right(team: int, rules: Rules) -> bool:
    """Returns whether the team has the right half of the field."""
    return rules.blue_right == (team == BLUE)


@part
def own_side(team: int, x: float, rules: Rules) -> bool:
    """Returns whether ``x`` is on the team's half; the line between belongs to both."""
    return x >= rules.width_m / 2.0 if is_right(team, rules) else x <= rules.width_m / 2.0
