"""Fixed policies that attack or defend, as the opponents' distance from the own flag suggests.

Catch radius and keep-out circle are the game's. The original's do not ask for them: they have those of its default
game unless they are told.
"""

import math

import numpy as np

from mctf.attackers import EASY, HARD
from mctf.commands import STOP
from mctf.compiled import part
from mctf.draws import next_uniform
from mctf.geometry import home
from mctf.observe import OTHER
from mctf.rules import POLICIES_2024, Rules
from mctf.steering import (
    AHEAD,
    CARRIES,
    FAST,
    IS_TAGGED,
    ON_OWN_SIDE,
    SLOW,
    away_from,
    nearest,
    opponents_flag,
    own_flag,
    turn,
    unit,
    vector,
)

ATTACKS, DEFENDS, ROAMS = range(3)
"""What ``role`` returns."""
CLOSE, FAR = 30.0, 50.0
"""m between the own flag and the middle of the opponents."""
DEFENSIVENESS = 20.0
"""m; how far from the middle a roaming vehicle stays that is at its flag."""


@part
def role(level: int, raw: np.ndarray, enemies: int) -> int:
    """Returns ATTACKS, DEFENDS or ROAMS; the last for MEDIUM only.

    Args:
        level: EASY, MEDIUM or HARD.
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it.
    """
    bearing, distance, taken = own_flag(raw, enemies)
    flag_x, flag_y = vector(bearing, distance)
    x, y, free = 0.0, 0.0, False
    for at in range(enemies, len(raw), OTHER):
        enemy_x, enemy_y = vector(raw[at], raw[at + 1])
        x, y = x + enemy_x, y + enemy_y
        free = free or raw[at + IS_TAGGED] == 0.0
    count = (len(raw) - enemies) // OTHER
    gap_x, gap_y = x / count - flag_x, y / count - flag_y
    gap = math.sqrt(gap_x * gap_x + gap_y * gap_y)
    close = gap < CLOSE and free
    if level == EASY:
        return DEFENDS if close else ATTACKS
    if raw[CARRIES] > 0.0:
        return ATTACKS
    if taken or close:
        return DEFENDS
    return ATTACKS if gap > FAR or level == HARD else ROAMS


@part
def reach_of(raw: np.ndarray, enemies: int) -> float:
    """Returns how far in m the vehicle of 2024 roams: what it sees ahead of the opponents' flag and half of the own."""
    bearing, distance, _ = opponents_flag(raw, enemies)
    own_bearing, own_distance, _ = own_flag(raw, enemies)
    return vector(bearing, distance)[0] + vector(own_bearing, own_distance)[0] / 2.0


@part
def roam(stream: np.ndarray, b: int, reach: float, raw: np.ndarray, enemies: int, team: int, rules: Rules) -> int:
    """Returns an action of a defence at random: to a place in front of the flag, to an opponent or to the flag.

    It draws two numbers, and a third for a place near the flag.

    Args:
        stream: (B,) as of ``draws``, changed.
        b: game.
        reach: m, as of ``reach_of``; read in 2024 only.
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it.
        team: of the vehicle.
        rules: the game's constants.
    """
    first, second = next_uniform(stream, b), next_uniform(stream, b)
    bearing, distance, _ = own_flag(raw, enemies)
    anywhere = first < 0.25
    if not anywhere and second < 0.5:
        x, y = unit(raw[nearest(raw, enemies)])
    elif not anywhere and distance > rules.flag_keepout_m + 2.0:
        x, y = unit(bearing)
    else:
        share, spared = (second, 0.0) if anywhere else (next_uniform(stream, b), DEFENSIVENESS)
        if rules.policy_version == POLICIES_2024:
            x, y = share * (reach - spared), 0.0
        else:
            x, y = before_flag(share, spared, raw, team, rules)
    if raw[ON_OWN_SIDE] > 0.0:
        # An error, caught: the vehicle of 2024 drives on straight, and at full speed
        return FAST + AHEAD if rules.policy_version == POLICIES_2024 else turn(x, y, SLOW)
    away_x, away_y = away_from(raw, enemies, 15.0, 0.0, rules)
    x, y = x + away_x, y + away_y
    if rules.policy_version != POLICIES_2024 and x * x + y * y < 1e-20:
        return SLOW + AHEAD  # to the one opponent near and away from it: only errors of rounding are left
    return STOP if math.isnan(x + y) else turn(x, y, SLOW)


@part
def before_flag(share: float, spared: float, raw: np.ndarray, team: int, rules: Rules) -> tuple[float, float]:
    """Returns the vector in m to a place on the line from the own flag's home to the opponents'.

    Args:
        share: of the way to the middle of the field, in [0, 1).
        spared: m of that way, at its end, that are left out.
        raw: (O,) as of ``observe``.
        team: of the vehicle.
        rules: the game's constants.
    """
    flag_x, flag_y = vector(raw[2], raw[3])
    other_x, other_y = vector(raw[0], raw[1])
    own_home, other_home = home(team, rules)[0], home(1 - team, rules)[0]
    to_middle = (rules.width_m / 2.0 - own_home) / (other_home - own_home)
    way_x, way_y = to_middle * (other_x - flag_x), to_middle * (other_y - flag_y)
    length = math.sqrt(way_x * way_x + way_y * way_y)
    share *= 1.0 - min(spared / length, 1.0)
    return flag_x + share * way_x, flag_y + share * way_y
