"""Fixed policies that defend the own flag."""

import math

import numpy as np

from mctf.commands import STOP
from mctf.compiled import part
from mctf.rules import POLICIES_2024, POLICIES_2025, Rules
from mctf.steering import FAST, IS_TAGGED, SLOW, away_from, nearest, nearest_free, own_flag, turn, unit, vector


@part
def guard(chases: bool, raw: np.ndarray, enemies: int, rules: Rules) -> int:
    """Returns the action of an easy or medium defender: around the own flag at a tag's distance.

    Args:
        chases: whether it follows who carries the flag, at any distance.
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it.
        rules: the game's constants.
    """
    bearing, distance, taken = own_flag(raw, enemies)
    x, y = unit(bearing)
    if distance > rules.flag_keepout_m + rules.catch_radius_m + 1.0 or (taken and chases):
        return turn(x, y, SLOW)
    # With the flag dead ahead the original of 2024 turns to port, as -0.0 is negative, and that of 2025 to starboard
    return turn(-x, -y if rules.policy_version == POLICIES_2024 else 0.0 - y, SLOW)


@part
def block(raw: np.ndarray, enemies: int, rules: Rules) -> int:
    """Returns the action of a hard defender: between the flag and the nearest enemy, at it when it comes close.

    It follows who carries the flag, and keeps away from walls within 7 m. The nearest enemy is an untagged one if
    there is any.
    """
    bearing, distance, taken = own_flag(raw, enemies)
    away_x, away_y = away_from(raw, len(raw), 10.0, 7.0, rules)
    if taken:
        x, y = unit(bearing)
        return turn(x + away_x, y + away_y, FAST)
    enemy = nearest_free(raw, enemies, False)
    if enemy < 0:
        enemy = nearest(raw, enemies)
    flag_x, flag_y = vector(bearing, distance)
    enemy_x, enemy_y = vector(raw[enemy], raw[enemy + 1])
    x, y = blocking_point(flag_x, flag_y, enemy_x, enemy_y, raw[enemy + IS_TAGGED] > 0.0, rules)
    x, y = x + away_x, y + away_y
    return STOP if math.isnan(x + y) else turn(x, y, FAST)


@part
def blocking_point(
    flag_x: float, flag_y: float, enemy_x: float, enemy_y: float, tagged: bool, rules: Rules
) -> tuple[float, float]:
    """Returns where a hard defender, at (0, 0), goes while its flag is at home.

    Let D be a point between flag and enemy: midway in 2025, else the one nearest to the defender. It goes to the enemy
    if that is free and within the perimeter of the flag, else to D if the enemy is free and D within the perimeter,
    else to the perimeter: on the enemy's side, but in 2024 on the side away from D.

    Args:
        flag_x: m.
        flag_y: m.
        enemy_x: m.
        enemy_y: m.
        tagged: whether the enemy is.
        rules: the game's constants.
    """
    line_x, line_y = enemy_x - flag_x, enemy_y - flag_y
    length = math.sqrt(line_x * line_x + line_y * line_y)
    share = 0.5
    if rules.policy_version != POLICIES_2025:
        share = -(flag_x * line_x + flag_y * line_y) / (length * length)
        share = min(max(share, 0.0), 1.0)
    block_x, block_y = flag_x + share * line_x, flag_y + share * line_y
    to_flag_x, to_flag_y = flag_x - block_x, flag_y - block_y
    apart = math.sqrt(to_flag_x * to_flag_x + to_flag_y * to_flag_y)

    perimeter = 5.0 * rules.flag_keepout_m
    if length <= perimeter and not tagged:
        return enemy_x, enemy_y
    if apart <= perimeter and not tagged:
        return block_x, block_y
    if rules.policy_version == POLICIES_2024:
        # 0 / 0 if D is the flag: NaN, and the defender stops
        return flag_x + perimeter * (to_flag_x / apart), flag_y + perimeter * (to_flag_y / apart)
    if length == 0.0:
        return flag_x, flag_y
    return flag_x + perimeter * (line_x / length), flag_y + perimeter * (line_y / length)


@part
def chase(raw: np.ndarray, enemies: int) -> int:
    """Returns the action of a competition's medium defender, and -1 if there is nobody to chase.

    It follows who carries the flag, or else the nearest untagged opponent on the wrong side.
    """
    bearing, _, taken = own_flag(raw, enemies)
    if not taken:
        intruder = nearest_free(raw, enemies, True)
        if intruder < 0:
            return -1
        bearing = raw[intruder]
    x, y = unit(bearing)
    return turn(x, y, FAST)
