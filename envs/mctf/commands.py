"""From actions to what the controllers are asked for: a speed, and a turn relative to the present heading."""

from mctf.compiled import part
from mctf.geometry import apart, bearing_of, is_right, team_of
from mctf.rules import ACTIONS, Rules
from mctf.state import State

STOP = ACTIONS - 1
MISSING = -2
"""Stands for the action of a vehicle that was given none."""

ROWS, COLUMNS = ("PP", "P", "C", "S", "SS"), ("B", "F", "H", "M", "C", "MX", "HX", "FX", "BX")
FIELD_POINTS = tuple(row + column for row in ROWS for column in COLUMNS)
"""Names of the field points: rows from the upper wall to the lower, columns from the left wall to the right.

Action ``ACTIONS`` + i drives to point i as the team on the left sees it; for the other the field is turned by half a
circle, so that the same action means the same to both.
"""


@part
def command(state: State, b: int, v: int, action: int, rules: Rules) -> tuple[float, float]:
    """Returns desired speed in m/s and turn in deg, clockwise positive.

    A turn is an error that holds for the whole step, not a target: the vehicle goes on turning.

    Args:
        state: not changed.
        b: game.
        v: vehicle.
        action: 0..7 full speed, 8..15 half speed, both with the turns 180, 135, .. -135 deg; 16 and -1 stop; 17..61
            drive to a field point; -2 is no action.
        rules: the game's constants.
    """
    if 0 <= action < STOP:
        full = 1.5 if rules.fixed_action_speeds else rules.max_speed
        return (full if action < 8 else full / 2.0), 180.0 - 45.0 * (action % 8)
    if action > STOP:
        return to_field_point(state, b, v, action - ACTIONS, rules)
    if action == MISSING and rules.missing_action_turns:
        return 0.0, state.heading[b, v]
    return 0.0, 0.0


@part
def field_point(point: int, right: bool, rules: Rules) -> tuple[float, float]:
    """Returns x and y in m of field point 0..44 for the team on the ``right`` or on the left."""
    width, height = (160.0, 80.0) if rules.field_points_fixed else (rules.width_m, rules.height_m)
    row, column = point // 9, point % 9
    if right:
        row, column = 4 - row, 8 - column
    return width * column / 8.0, height * (4 - row) / 4.0


@part
def to_field_point(state: State, b: int, v: int, point: int, rules: Rules) -> tuple[float, float]:
    """Returns speed in m/s and turn in deg towards a field point; speed 0 when it is reached."""
    x, y = state.pos[b, v, 0], state.pos[b, v, 1]
    to_x, to_y = field_point(point, is_right(team_of(v, rules), rules), rules)
    full = 1.5 if rules.fixed_action_speeds else rules.max_speed
    there = apart(x, y, to_x, to_y) <= rules.field_point_reach_m
    return (0.0 if there else full), bearing_of(to_x - x, to_y - y, state.heading[b, v])
