"""Motion of one vehicle in one sub-step.

Directions are kept as unit vectors and turned by small angles, so that a sub-step costs no sine and no arctangent of
the library. With ``rules.float32`` every position has the last bit of the Pyquaticus of 2024 all the same, as contacts
with the keep-out circle would multiply a difference of 1e-13 m until it decides a rounding, and metres. Its velocities
are in single precision, which swallows how they were computed. Where a sum could be rounded otherwise, one in ten, it
is computed again through angles as there.
"""

import math
from typing import NamedTuple

import numpy as np

from mctf.compiled import part
from mctf.controllers import new_speed_of, new_thrust, rudder_for, turn_of
from mctf.geometry import apart, heading_of, home, length32, wrapped
from mctf.keepout import pushed_out, slid
from mctf.rules import HERON_2024, Rules

TO_RADIANS = math.pi / 180.0
SIN1, SIN2, SIN3, SIN4, SIN5 = ((-1.0) ** i / math.factorial(2 * i + 1) for i in range(1, 6))
COS1, COS2, COS3, COS4, COS5 = ((-1.0) ** i / math.factorial(2 * i) for i in range(1, 6))
"""Coefficients of the power series."""


class Boat(NamedTuple):
    """What a sub-step changes of one vehicle, as plain numbers, which compiled code keeps in registers.

    The fields of ``State`` with the same names; the last four are columns of ``State.direction``: sine and cosine of
    the heading, and the velocity in m/s that decides the heading. If that is not NaN, ``heading`` is out of date.
    """

    x: float
    y: float
    prev_x: float
    prev_y: float
    speed: float
    speed_is_f32: bool
    heading: float
    thrust: float
    error: float
    error_known: bool
    sine: float
    cosine: float
    vel_x: float
    vel_y: float


@part
def moved(
    boat: Boat, desired: float, error: float, tagged: bool, guarded: bool, at_wall: bool, team: int, rules: Rules
) -> Boat:
    """Returns a vehicle after one sub-step.

    Args:
        boat: before.
        desired: speed in m/s.
        error: of the heading, deg.
        tagged: whether the autopilot steers.
        guarded: whether the keep-out circle of its flag holds.
        at_wall: whether it bounces instead of moving.
        team: of the vehicle.
        rules: the game's constants.
    """
    # 1. What its controllers make of what is wanted
    speed_error = desired - boat.speed
    if boat.speed_is_f32 and not tagged:
        speed_error = single(speed_error)
    thrust = new_thrust(boat.thrust, speed_error, rules.dynamics)
    rudder, error_prev, known = 0.0, boat.error, boat.error_known
    if thrust > 0.0 or rules.dynamics == HERON_2024:
        rudder = rudder_for(error, error_prev, known, rules)
        error_prev, known = error, True
    if at_wall:
        return bounced(boat, error_prev, known)
    new_speed = new_speed_of(thrust, rudder, boat.speed, rules)
    turn = turn_of(thrust, rudder, boat.speed, new_speed, rules)

    # 2. Its new course; it moves with the mean of old and new speed, in the mean of old and new direction
    course = steered(boat, new_speed, turn, guarded, team, rules)
    dx, dy, mean_speed = way_of(boat, course, rules)
    x, y = course.x + dx, course.y + dy
    kept = mean_speed if rules.speed_is_mean else course.speed
    speed = min(max(kept, 0.0), rules.max_speed)
    is_f32 = course.is_f32 and course.speed <= rules.max_speed
    heading, sine, cosine, vel_x = course.heading, course.sine, course.cosine, course.vel_x

    # 3. Under the later rules it is put out of the keep-out circle now
    radius = rules.flag_keepout_m + rules.agent_radius_m
    home_x, home_y = home(team, rules)
    if not rules.keepout_before and guarded and rules.flag_keepout_m > 0.0 and apart(x, y, home_x, home_y) < radius:
        x, y, normal_x, normal_y = pushed_out(x, y, boat.x, boat.y, home_x, home_y, radius + 0.1, rules.float32)
        speed, heading, sine, cosine = slid(speed * sine, speed * cosine, normal_x, normal_y)
        vel_x = math.nan
    return Boat(
        x, y, boat.x, boat.y, speed, is_f32, heading, thrust, error_prev, known, sine, cosine, vel_x, course.vel_y
    )


class Course(NamedTuple):
    """Where a vehicle is and where it goes, before it moves; fields as of ``Boat``, and the mean of two directions."""

    x: float
    y: float
    speed: float
    is_f32: bool
    heading: float
    sine: float
    cosine: float
    vel_x: float
    vel_y: float
    mean_sine: float
    mean_cosine: float


@part
def steered(boat: Boat, speed: float, turn: float, guarded: bool, team: int, rules: Rules) -> Course:
    """Returns the new course of a vehicle; inside the keep-out circle it is put outside and slides along.

    Args:
        boat: before.
        speed: m/s, new.
        turn: deg.
        guarded: whether the keep-out circle of its flag holds.
        team: of the vehicle.
        rules: the game's constants.
    """
    home_x, home_y = home(team, rules)
    mean_sine, mean_cosine, sine, cosine = rotated(boat.sine, boat.cosine, turn * TO_RADIANS)
    vel_x, vel_y = speed * sine, speed * cosine
    if rules.float32:
        vel_x, vel_y = single(vel_x), single(vel_y)
    if rules.keepout_before and guarded and apart(boat.x, boat.y, home_x, home_y) < rules.flag_keepout_m:
        x, y, normal_x, normal_y = pushed_out(
            boat.x, boat.y, boat.prev_x, boat.prev_y, home_x, home_y, rules.flag_keepout_m + 0.1, rules.float32
        )
        if speed > 0.1:
            speed, heading, sine, cosine = slid(vel_x, vel_y, normal_x, normal_y)
        else:
            heading, sine, cosine = turned_by(boat, turn)
        mean_sine, mean_cosine = midway(sine + boat.sine, cosine + boat.cosine)
        return Course(x, y, speed, False, heading, sine, cosine, math.nan, math.nan, mean_sine, mean_cosine)
    if not rules.float32:
        heading = wrapped(boat.heading + turn)
        return Course(boat.x, boat.y, speed, False, heading, sine, cosine, math.nan, math.nan, mean_sine, mean_cosine)
    if speed > 0.1:
        # Rounding turned the velocity by ``off`` rad, below 1e-7: the direction by that, the mean by half of it
        off = (vel_x * cosine - vel_y * sine) / speed
        near = 1.0 - 0.5 * off * off
        sine, cosine = near * sine + off * cosine, near * cosine - off * sine
        mean_sine, mean_cosine = mean_sine + 0.5 * off * mean_cosine, mean_cosine - 0.5 * off * mean_sine
        speed = length32(vel_x, vel_y)
        return Course(boat.x, boat.y, speed, True, boat.heading, sine, cosine, vel_x, vel_y, mean_sine, mean_cosine)
    heading, sine, cosine = turned_by(boat, turn)
    return Course(boat.x, boat.y, speed, False, heading, sine, cosine, math.nan, math.nan, mean_sine, mean_cosine)


@part
def way_of(boat: Boat, course: Course, rules: Rules) -> tuple[float, float, float]:
    """Returns dx and dy in m, and the mean speed in m/s, of a vehicle that takes a new course."""
    both_speeds = course.speed + boat.speed
    if course.is_f32 and boat.speed_is_f32:
        both_speeds = single(both_speeds)
    speed = both_speeds / 2.0
    dx, dy = course.mean_sine * speed * rules.tau_s, course.mean_cosine * speed * rules.tau_s
    doubt = 2e-15 * abs(speed) * rules.tau_s
    if rules.float32 and not (course.is_f32 and is_certain(course.x, dx, doubt) and is_certain(course.y, dy, doubt)):
        old = direction_of(heading_now(boat.heading, boat.vel_x, boat.vel_y))
        new = direction_of(heading_now(course.heading, course.vel_x, course.vel_y))
        mean = math.atan2(new[0] + old[0], new[1] + old[1])
        dx, dy = math.sin(mean) * speed * rules.tau_s, math.cos(mean) * speed * rules.tau_s
    return dx, dy, speed


@part
def turned_by(boat: Boat, turn: float) -> tuple[float, float, float]:
    """Returns the heading in deg after a turn by ``turn`` deg, and its sine and cosine."""
    heading = wrapped(heading_now(boat.heading, boat.vel_x, boat.vel_y) + turn)
    sine, cosine = direction_of(heading)
    return heading, sine, cosine


@part
def heading_now(heading: float, vel_x: float, vel_y: float) -> float:
    """Returns the heading in deg: that of the velocity in m/s unless that is NaN."""
    return heading if math.isnan(vel_x) else heading_of(vel_x, vel_y)


@part
def is_certain(at: float, way: float, doubt: float) -> bool:
    """Returns whether ``at + way`` is rounded the same wherever in its ``doubt`` the way is; all in m.

    Of 20 million directions the worst was off by 1.1e-15 rad in the original, through roundings of angles up to
    360 deg; products add 0.2e-15 there and here, and directions here 0.3e-15.
    """
    return at + (way - doubt) == at + (way + doubt)


@part
def bounced(boat: Boat, error: float, known: bool) -> Boat:
    """Returns a vehicle turned round at a wall: at rest where it was before; ``error`` is its controller's memory."""
    x, y = boat.prev_x, boat.prev_y
    heading, sine, cosine = turned_by(boat, 180.0)
    return Boat(x, y, x, y, 0.0, False, heading, 0.0, error, known, sine, cosine, math.nan, math.nan)


@part
def single(value: float) -> float:
    """Returns ``value`` rounded to single precision."""
    return np.float64(np.float32(value))


@part
def rotated(sine: float, cosine: float, angle: float) -> tuple[float, float, float, float]:
    """Returns sine and cosine of a heading after half a turn by ``angle`` rad, clockwise positive, and after all of it.

    What they lack to the length 1 is made good, so that it does not add up.
    """
    half = 0.5 * angle
    square = half * half
    if (
        square < 0.0175
    ):  # rad²: all turns of a sub-step of 0.1 s; the first terms left out of the series are below 1e-17
        s = 1.0 + square * (SIN1 + square * (SIN2 + square * (SIN3 + square * (SIN4 + square * SIN5))))
        s *= half
        c = 1.0 + square * (COS1 + square * (COS2 + square * (COS3 + square * (COS4 + square * COS5))))
    else:
        s, c = math.sin(half), math.cos(half)
    scale = 1.5 - 0.5 * (sine * sine + cosine * cosine)
    sine, cosine = scale * sine, scale * cosine
    double, rest = 2.0 * s * c, 1.0 - 2.0 * s * s
    return (
        sine * c + cosine * s,
        cosine * c - sine * s,
        sine * rest + cosine * double,
        cosine * rest - sine * double,
    )


@part
def midway(x: float, y: float) -> tuple[float, float]:
    """Returns sine and cosine of the heading midway between two, given the sum of their unit vectors."""
    square = x * x + y * y
    if square < 1e-12:  # opposite to each other
        course = math.atan2(x, y)
        return math.sin(course), math.cos(course)
    scale = 1.0 / math.sqrt(square)
    return x * scale, y * scale


@part
def direction_of(heading: float) -> tuple[float, float]:
    """Returns sine and cosine of a heading in deg."""
    course = math.radians(heading)
    return math.sin(course), math.cos(course)
