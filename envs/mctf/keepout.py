"""The circle around a team's own flag that its vehicles are kept out of while the flag is there."""

import math

from mctf.compiled import part
from mctf.geometry import heading_of

STEEP = 1e4  # slope from which rounding would swamp the original's formula


@part
def pushed_out(
    x: float, y: float, prev_x: float, prev_y: float, flag_x: float, flag_y: float, radius: float, as_recorded: bool
) -> tuple[float, float, float, float]:
    """Returns the point where a vehicle leaves a circle, going back the way it came, and the unit normal there.

    Args:
        x: m, inside the circle; as ``y``.
        y: m.
        prev_x: m, where it came from; if it has not moved it leaves straight away from the centre.
        prev_y: m.
        flag_x: m, centre of the circle.
        flag_y: m.
        radius: m, of the circle.
        as_recorded: with the rounding of the original, not the best one.
    """
    if x == prev_x and y == prev_y:
        away_x, away_y = x - flag_x, y - flag_y
    else:
        away_x, away_y = prev_x - x, prev_y - y
    if as_recorded and abs(away_y) < STEEP * abs(away_x):
        # The line y = slope x + start in the equation of the circle: a x² + b x + c = 0. Badly conditioned, but
        # the terms and their order are those that come nearest to the recorded games.
        slope = away_y / away_x
        start = y - slope * x
        a = 1.0 + slope * slope
        b = -2.0 * flag_x + 2.0 * slope * start - 2.0 * slope * flag_y
        c = flag_x * flag_x - 2.0 * start * flag_y + start * start + flag_y * flag_y - radius * radius
        exit_x = (-b + math.copysign(math.sqrt(b * b - 4.0 * a * c), away_x)) / (2.0 * a)
        exit_y = slope * exit_x + start
    else:
        # (x, y) + s (unit vector away) on the circle
        length = math.sqrt(away_x * away_x + away_y * away_y)
        if length == 0.0:  # at rest on the very centre
            away_x, length = 1.0, 1.0
        away_x, away_y = away_x / length, away_y / length
        out_x, out_y = x - flag_x, y - flag_y
        along = out_x * away_x + out_y * away_y
        s = -along + math.sqrt(along * along - (out_x * out_x + out_y * out_y - radius * radius))
        exit_x, exit_y = x + s * away_x, y + s * away_y
    normal_x, normal_y = exit_x - flag_x, exit_y - flag_y
    length = math.sqrt(normal_x * normal_x + normal_y * normal_y)
    return exit_x, exit_y, normal_x / length, normal_y / length


@part
def slid(vel_x: float, vel_y: float, normal_x: float, normal_y: float) -> tuple[float, float, float, float]:
    """Returns the part of a velocity in m/s along the circle, given the unit normal there.

    As speed in m/s, heading in deg, and sine and cosine of it.
    """
    through = vel_x * normal_x + vel_y * normal_y
    along_x, along_y = vel_x - through * normal_x, vel_y - through * normal_y
    heading = heading_of(along_x, along_y)
    course = math.radians(heading)
    return math.sqrt(along_x * along_x + along_y * along_y), heading, math.sin(course), math.cos(course)
