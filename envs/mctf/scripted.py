"""The seven fixed policies: three that attack, three that defend, one at random.

Each is a function of the unnormalised observation. Vectors are (forward, starboard) as seen by the vehicle.
All mistakes are the original's: recorded games are reproduced action by action.
"""

import math

import numpy as np

from mctf.compiled import kernel, part
from mctf.geometry import wrapped
from mctf.observe import OTHER, OWN
from mctf.rules import ACTIONS, Rules

NAMES = (
    "attack_easy",
    "attack_medium",
    "attack_hard",
    "defend_easy",
    "defend_medium",
    "defend_hard",
    "random",
)
"""Names of the policies; a policy's number is its place here."""
ATTACK_EASY, ATTACK_MEDIUM, ATTACK_HARD, DEFEND_EASY, DEFEND_MEDIUM, DEFEND_HARD, RANDOM = range(len(NAMES))

STOP = ACTIONS - 1
SLOW, FAST = 8, 0
"""First of the eight actions of half and of full speed."""
HAS_FLAG, IS_TAGGED = 4, 7
"""Places in what is seen of another vehicle."""


@kernel
def act(policy: int, raw: np.ndarray, rules: Rules, draw: float) -> int:
    """Returns the action 0..16 of a fixed policy.

    Args:
        policy: place in ``NAMES``.
        raw: (13 + 16 n,) as of ``observe``.
        rules: the game's constants.
        draw: uniform in [0, 1); read by the random policy only.
    """
    if policy == RANDOM:
        return int(draw * ACTIONS)
    if policy <= ATTACK_HARD:
        return attack(policy, raw, rules)
    if policy == DEFEND_HARD:
        return block(raw, rules)
    return guard(policy, raw, rules)


@part
def attack(policy: int, raw: np.ndarray, rules: Rules) -> int:
    """Returns the action of an attacker: to the flag, and home when anyone of the team holds it."""
    goal, _, carrying = opponents_flag(raw, rules)
    if carrying:
        goal = raw[2]
    goal_x, goal_y = unit(goal)
    if policy == ATTACK_EASY:
        return turn(goal_x, goal_y, SLOW)
    if policy == ATTACK_MEDIUM:
        away_x, away_y = away_from(raw, rules, 10.0, 0.0)
        return turn(2.0 * goal_x + away_x, 2.0 * goal_y + away_y, SLOW)

    away_x, away_y = away_from(raw, rules, 30.0, 10.0)
    if not carrying:
        # Goal and dangers cancel: along the middle, to the wall with more room
        gap_x, gap_y = abs(abs(goal_x) - abs(away_x)), abs(abs(goal_y) - abs(away_y))
        opposed = goal_x + away_x == 0.0 and goal_y + away_y == 0.0
        if opposed or (gap_x <= 0.1 and gap_y <= 0.1):
            x, y = unit(raw[4] if raw[5] > 1.25 * raw[9] else raw[8])
            return turn(x, y, FAST)
    return turn(1.25 * goal_x + away_x, 1.25 * goal_y + away_y, FAST)


@part
def guard(policy: int, raw: np.ndarray, rules: Rules) -> int:
    """Returns the action of an easy or medium defender: around the own flag at a tag's distance."""
    bearing, distance, taken = own_flag(raw, rules)
    x, y = unit(bearing)
    if distance > rules.flag_keepout_m + rules.catch_radius_m + 1.0 or (taken and policy == DEFEND_MEDIUM):
        return turn(x, y, SLOW)
    return turn(-x, -y, SLOW)


@part
def block(raw: np.ndarray, rules: Rules) -> int:
    """Returns the action of a hard defender: onto the line between the flag and the nearest enemy."""
    flag_bearing, flag_distance, taken = own_flag(raw, rules)
    flag_x, flag_y = unit(flag_bearing)
    wall_x, wall_y = away_from_walls(raw, 10.0, 7.0)
    if taken:
        return turn(flag_x + wall_x, flag_y + wall_y, FAST)
    flag_x, flag_y = flag_distance * flag_x, flag_distance * flag_y

    # 1. E: the nearest enemy, an untagged one if there is any within 1000 m
    enemy = -1
    for wanted in range(2):
        nearest = 1000.0
        for at in range(OWN + OTHER * (rules.team_size - 1), len(raw), OTHER):
            if raw[at + 1] < nearest and raw[at + IS_TAGGED] == wanted:
                enemy, nearest = at, raw[at + 1]
        if enemy >= 0:
            break
    enemy_x, enemy_y = unit(raw[enemy])
    enemy_x, enemy_y = raw[enemy + 1] * enemy_x, raw[enemy + 1] * enemy_y
    tagged = raw[enemy + IS_TAGGED] > 0.0

    # 2. D: the point between the flag and E that is nearest to the vehicle, which is at (0, 0)
    line_x, line_y = enemy_x - flag_x, enemy_y - flag_y
    length = math.sqrt(line_x * line_x + line_y * line_y)
    share = -(flag_x * line_x + flag_y * line_y) / (length * length)
    share = min(max(share, 0.0), 1.0)
    block_x, block_y = flag_x + share * line_x, flag_y + share * line_y

    # 3. At E if it is close, else to D, else behind the flag
    perimeter = 5.0 * rules.flag_keepout_m
    to_flag_x, to_flag_y = flag_x - block_x, flag_y - block_y
    apart = math.sqrt(to_flag_x * to_flag_x + to_flag_y * to_flag_y)
    if length > perimeter or tagged:
        if apart > perimeter or tagged:
            x = flag_x + perimeter * (to_flag_x / apart)  # 0 / 0 if D is the flag: NaN, and the action is stop
            y = flag_y + perimeter * (to_flag_y / apart)
        else:
            x, y = block_x, block_y
    else:
        x, y = enemy_x, enemy_y
    return turn(x + wall_x, y + wall_y, FAST)


@part
def unit(bearing: float) -> tuple[float, float]:
    """Returns the vector of length 1 towards ``bearing`` in deg."""
    angle = math.radians(bearing)
    return math.cos(angle), math.sin(angle)


@part
def turn(x: float, y: float, speed: int) -> int:
    """Returns the action that turns towards (``x``, ``y``): straight on within 1 deg, else 90 deg to a side."""
    bearing = wrapped(math.degrees(math.atan2(y, x)))
    if math.isnan(bearing):
        return STOP
    if bearing < -1.0:
        return speed + 6
    return speed + 2 if bearing > 1.0 else speed + 4


@part
def opponents_flag(raw: np.ndarray, rules: Rules) -> tuple[float, float, bool]:
    """Returns bearing and distance of the opponents' flag, and whether this vehicle's team holds it."""
    bearing, distance, carrying = raw[0], raw[1], raw[15] > 0.0
    for mate in range(rules.team_size - 1):
        at = OWN + OTHER * mate
        if raw[at + HAS_FLAG] > 0.0:
            bearing, distance, carrying = raw[at], raw[at + 1], True
    return bearing, distance, carrying


@part
def own_flag(raw: np.ndarray, rules: Rules) -> tuple[float, float, bool]:
    """Returns bearing and distance of the own flag, and whether an opponent carries it."""
    bearing, distance, taken = raw[2], raw[3], False
    for at in range(OWN + OTHER * (rules.team_size - 1), len(raw), OTHER):
        if raw[at + HAS_FLAG] > 0.0:
            bearing, distance, taken = raw[at], raw[at + 1], True
    return bearing, distance, taken


@part
def away_from(raw: np.ndarray, rules: Rules, within: float, walls_within: float) -> tuple[float, float]:
    """Returns the unit vector away from opponents and walls, each with weight ``within`` / distance.

    Args:
        raw: (13 + 16 n,) as of ``observe``.
        rules: the game's constants.
        within: m; what is farther does not count.
        walls_within: m; walls nearer than this are in the sum.
    """
    x, y = 0.0, 0.0
    for at in range(OWN + OTHER * (rules.team_size - 1), len(raw), OTHER):
        x, y = repelled(x, y, raw[at + 1], raw[at], within)
    return opposite(*with_walls(x, y, raw, within, walls_within))


@part
def away_from_walls(raw: np.ndarray, within: float, walls_within: float) -> tuple[float, float]:
    """Returns the unit vector away from walls nearer than ``walls_within``, as ``away_from``."""
    return opposite(*with_walls(0.0, 0.0, raw, within, walls_within))


@part
def with_walls(x: float, y: float, raw: np.ndarray, within: float, walls_within: float) -> tuple[float, float]:
    """Returns the sum (``x``, ``y``) with the walls ahead: wall 0 or else 2, wall 1 or else 3.

    The original hands on the pair (d² cos b, d² sin b) where (distance, bearing) is read.
    """
    for pair in range(2):
        for wall in (pair, pair + 2):
            bearing, distance = raw[4 + 2 * wall], raw[5 + 2 * wall]
            if distance < walls_within and -90.0 < bearing < 90.0:
                ahead, starboard = unit(bearing)
                square = distance * distance
                x, y = repelled(x, y, square * ahead, square * starboard, within)
                break
    return x, y


@part
def repelled(x: float, y: float, distance: float, bearing: float, within: float) -> tuple[float, float]:
    """Returns the sum (``x``, ``y``) with one more danger, if it is nearer than ``within``."""
    if distance < within:
        ahead, starboard = unit(bearing)
        x += within / distance * ahead
        y += within / distance * starboard
    return x, y


@part
def opposite(x: float, y: float) -> tuple[float, float]:
    """Returns the unit vector against (``x``, ``y``), and (0, 0) for that."""
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 0.0, 0.0
    return -x / length, -y / length
