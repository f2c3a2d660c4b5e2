"""How fixed policies see and steer: flags, opponents and walls in an observation, and the turn to take.

Vectors are (forward, starboard) as the vehicle sees them. Places below are those of ``observe``.
"""

import math

import numpy as np

from mctf.compiled import part
from mctf.observe import OTHER, OWN
from mctf.rules import POLICIES_2024, Rules

SLOW, FAST = 8, 0
"""First of the eight actions of half and of full speed."""
AHEAD, RIGHT, LEFT = 4, 2, 6
"""Added to these: straight on, 90 deg to starboard, 90 deg to port."""

CARRIES, ON_OWN_SIDE, TAGGED = 15, 16, 18
"""Places of what a vehicle sees of itself."""
HAS_FLAG, ON_SIDE, IS_TAGGED = 4, 5, 7
"""Places in what it sees of another."""
SIGHT = 1000.0
"""m; an opponent farther off is not chosen."""

ONE_DEGREE = math.tan(math.radians(1.0))
CLOSEST = 1e-6  # m; a danger at no distance at all would make the sum of dangers NaN


@part
def unit(bearing: float) -> tuple[float, float]:
    """Returns the vector of length 1 towards ``bearing`` in deg."""
    angle = math.radians(bearing)
    return math.cos(angle), math.sin(angle)


@part
def vector(bearing: float, distance: float) -> tuple[float, float]:
    """Returns the vector in m to what is seen at ``bearing`` in deg and ``distance`` in m."""
    x, y = unit(bearing)
    return distance * x, distance * y


@part
def turn(x: float, y: float, speed: int) -> int:
    """Returns the action that turns towards (``x``, ``y``): straight on within 1 deg and for NaN, else 90 deg aside."""
    if abs(y) > ONE_DEGREE * x:
        return speed + (LEFT if math.copysign(1.0, y) < 0.0 else RIGHT)
    return speed + AHEAD


@part
def opponents_flag(raw: np.ndarray, enemies: int) -> tuple[float, float, bool]:
    """Returns bearing and distance of the opponents' flag, and whether this vehicle's team holds it."""
    bearing, distance, carrying = raw[0], raw[1], raw[CARRIES] > 0.0
    for at in range(OWN, enemies, OTHER):
        if raw[at + HAS_FLAG] > 0.0:
            bearing, distance, carrying = raw[at], raw[at + 1], True
    return bearing, distance, carrying


@part
def own_flag(raw: np.ndarray, enemies: int) -> tuple[float, float, bool]:
    """Returns bearing and distance of the own flag, and whether an opponent carries it."""
    bearing, distance, taken = raw[2], raw[3], False
    for at in range(enemies, len(raw), OTHER):
        if raw[at + HAS_FLAG] > 0.0:
            bearing, distance, taken = raw[at], raw[at + 1], True
    return bearing, distance, taken


@part
def nearest(raw: np.ndarray, enemies: int) -> int:
    """Returns the place of the nearest opponent, tagged or not; of equally near ones the first."""
    found = enemies
    for at in range(enemies, len(raw), OTHER):
        if raw[at + 1] < raw[found + 1]:
            found = at
    return found


@part
def nearest_free(raw: np.ndarray, enemies: int, intruders: bool) -> int:
    """Returns the place of the nearest untagged opponent in ``SIGHT``, and -1 for none.

    Args:
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it.
        intruders: only those count that are not on their own side.
    """
    found, distance = -1, SIGHT
    for at in range(enemies, len(raw), OTHER):
        counts = raw[at + IS_TAGGED] == 0.0 and not (intruders and raw[at + ON_SIDE] > 0.0)
        if counts and raw[at + 1] < distance:
            found, distance = at, raw[at + 1]
    return found


@part
def away_from(raw: np.ndarray, enemies: int, within: float, walls_within: float, rules: Rules) -> tuple[float, float]:
    """Returns the unit vector away from opponents and walls, each with weight ``within`` / distance.

    Args:
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it; its length leaves out the opponents.
        within: m; what is farther does not count.
        walls_within: m; walls nearer than this are in the sum.
        rules: the game's constants.
    """
    x, y = 0.0, 0.0
    for at in range(enemies, len(raw), OTHER):
        x, y = repelled(x, y, raw[at + 1], raw[at], within, rules)
    for pair in range(2):  # of the walls ahead: wall 0 or else 2, wall 1 or else 3
        for wall in (pair, pair + 2):
            bearing, distance = raw[4 + 2 * wall], raw[5 + 2 * wall]
            if distance < walls_within and -90.0 < bearing < 90.0:
                if rules.policy_version == POLICIES_2024:
                    # The original hands on the pair (d² cos b, d² sin b) where (distance, bearing) is read
                    distance, bearing = vector(bearing, distance * distance)
                x, y = repelled(x, y, distance, bearing, within, rules)
                break
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0, 0.0
    return -x / length, -y / length


@part
def repelled(x: float, y: float, distance: float, bearing: float, within: float, rules: Rules) -> tuple[float, float]:
    """Returns the sum (``x``, ``y``) with one more danger, if it is nearer than ``within``."""
    if distance < within:
        ahead, starboard = unit(bearing)
        if rules.policy_version != POLICIES_2024:
            distance = max(distance, CLOSEST)
        x += within / distance * ahead
        y += within / distance * starboard
    return x, y
