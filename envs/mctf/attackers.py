"""Fixed policies that attack: to the opponents' flag, and home with it."""

import numpy as np

from mctf.compiled import part
from mctf.rules import Rules
from mctf.steering import CARRIES, FAST, SLOW, away_from, opponents_flag, turn, unit

EASY, MEDIUM, HARD, COMPETITION = range(4)
"""Levels of skill."""


@part
def attack(level: int, raw: np.ndarray, enemies: int, rules: Rules) -> int:
    """Returns the action of an attacker: to the flag, and home when anyone of the team holds it.

    EASY drives straight there at half speed; MEDIUM keeps away from opponents within 10 m; HARD does so within 30 m at
    full speed, keeps away from walls too, and goes round an opponent in the way; COMPETITION does so within 60 m, and
    goes home only if it holds the flag itself: else it follows the mate who does.

    Args:
        level: EASY, MEDIUM, HARD or COMPETITION.
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it.
        rules: the game's constants.
    """
    goal, _, carrying = opponents_flag(raw, enemies)
    if level == COMPETITION:
        carrying = raw[CARRIES] > 0.0
    goal_x, goal_y = unit(raw[2] if carrying else goal)
    if level == EASY:
        return turn(goal_x, goal_y, SLOW)

    within = 10.0 if level == MEDIUM else 30.0 if level == HARD else 60.0
    walls_within = 0.0 if level == MEDIUM else 10.0
    away_x, away_y = away_from(raw, enemies, within, walls_within, rules)
    if level == MEDIUM:
        return turn(2.0 * goal_x + away_x, 2.0 * goal_y + away_y, SLOW)
    if not carrying:
        # Goal and dangers cancel: along the middle, to the wall with more room
        gap_x, gap_y = abs(abs(goal_x) - abs(away_x)), abs(abs(goal_y) - abs(away_y))
        opposed = goal_x + away_x == 0.0 and goal_y + away_y == 0.0
        if opposed or (gap_x <= 0.1 and gap_y <= 0.1):
            x, y = unit(raw[4] if raw[5] > 1.25 * raw[9] else raw[8])
            return turn(x, y, FAST)
    return turn(1.25 * goal_x + away_x, 1.25 * goal_y + away_y, FAST)
