"""Motion: controllers, speed and turn of one vehicle, walls, keep-out circle; one sub-step at a time.

The equations are those of the paper's Pyquaticus, its mistakes included. Where it computed in single
precision so does this, if ``rules.float32_emulation``; else whole games drift apart after a hundred steps.
"""

import math

import numpy as np

from mctf.compiled import part
from mctf.geometry import apart, bearing_of, heading_of, home_x, length32, own_side, wrapped
from mctf.rules import ACTIONS, Rules
from mctf.state import HIT_WALL, LOST_BY_WALL, TAGS, State, send_home

SPEED_FACTOR = 20.0  # thrust per m/s of speed error
MAX_THRUST = 70.0
MAX_RUDDER = 100.0
TURN_LOSS = 0.85
TURN_RATE = 70.0
MAX_ACCELERATION = 1.0  # m/s²
HEADING_KP, HEADING_KD = 0.35, 0.07
STEEP = 1e4  # slope from which a line is taken as x of y instead of y of x


@part
def command(action: int) -> tuple[float, float]:
    """Returns desired speed in m/s and turn in deg, clockwise positive, of an action 0..16; -1 is 16: stop.

    The speeds are the same for every ``max_speed``, as in the original.
    """
    if action < 0 or action >= ACTIONS - 1:
        return 0.0, 0.0
    return (1.5 if action < 8 else 0.75), 180.0 - 45.0 * (action % 8)


@part
def speed_from(thrust: float) -> float:
    """Returns the speed in m/s that ``thrust`` holds: linear between (-100, -2) (0, 0) (60, 3) (80, 5)."""
    if thrust < 0.0:
        return 0.02 * (thrust + 100.0) - 2.0
    if thrust < 20.0:
        return 0.05 * thrust
    if thrust < 40.0:
        return 0.05 * (thrust - 20.0) + 1.0
    if thrust < 60.0:
        return 0.05 * (thrust - 40.0) + 2.0
    return min(0.1 * (thrust - 60.0) + 3.0, 5.0)


@part
def control(
    speed_error: float, error: float, error_prev: float, speed: float, heading: float, thrust: float, rules: Rules
) -> tuple[float, float, float]:
    """Returns thrust, speed in m/s and heading in deg after one sub-step of both controllers.

    Args:
        speed_error: desired minus present speed in m/s.
        error: desired minus present heading in deg.
        error_prev: ``error`` of the sub-step before; deg.
        speed: m/s.
        heading: deg.
        thrust: of the sub-step before.
        rules: the game's constants.
    """
    dt = rules.tau_s
    thrust = min(max(thrust + SPEED_FACTOR * speed_error, -MAX_THRUST), MAX_THRUST)
    rudder = HEADING_KP * error + HEADING_KD * ((error - error_prev) / dt)
    rudder = min(max(rudder, -MAX_RUDDER), MAX_RUDDER)

    turn_loss = TURN_LOSS * (abs(rudder) / 100.0)
    if rules.turn_loss_subtracts:
        new_speed = min(speed_from(thrust) - turn_loss, rules.max_speed)
    else:
        new_speed = min(speed_from(thrust) * (1.0 - turn_loss), rules.max_speed)
    if (new_speed - speed) / dt > MAX_ACCELERATION:
        new_speed = (new_speed if rules.accel_overshoots else speed) + MAX_ACCELERATION * dt
    elif (speed - new_speed) / dt > MAX_ACCELERATION:
        new_speed = (new_speed if rules.accel_overshoots else speed) - MAX_ACCELERATION * dt

    turn = rudder * (TURN_RATE / 100.0) * dt * (1.0 + (abs(thrust) - 50.0) / 50.0)
    if thrust < 0.0:
        turn = -turn
    if (new_speed + speed) / 2.0 < 0.5:
        turn = 0.0
    return thrust, new_speed, wrapped(heading + turn)


@part
def bounce(state: State, b: int, v: int, rules: Rules) -> None:
    """Turns a vehicle that is out of bounds round: it stops, and loses the flag that it carries."""
    team = v // rules.team_size
    state.events[b, v, HIT_WALL] += 1
    if rules.oob_counts_as_tag:
        state.score[b, 1 - team, TAGS] += 1
    if state.has_flag[b, v]:
        state.has_flag[b, v] = False
        state.events[b, v, LOST_BY_WALL] += 1
        send_home(state, b, 1 - team, rules)
    state.oob[b, v] = True
    state.speed[b, v] = 0.0
    state.speed_is_f32[b, v] = False
    state.thrust[b, v] = 0.0
    state.heading[b, v] = wrapped(state.heading[b, v] + 180.0)
    course = math.radians(state.heading[b, v])
    state.direction[b, v, 0], state.direction[b, v, 1] = math.sin(course), math.cos(course)
    state.pos[b, v, 0], state.pos[b, v, 1] = state.prev_pos[b, v, 0], state.prev_pos[b, v, 1]


@part
def pushed_out(
    x: float, y: float, prev_x: float, prev_y: float, flag_x: float, flag_y: float, radius: float
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
    """
    if x == prev_x and y == prev_y:
        away_x, away_y = x - flag_x, y - flag_y
    else:
        away_x, away_y = prev_x - x, prev_y - y
    if abs(away_y) < STEEP * abs(away_x):
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
        # (x, y) + s (lean, 1) on the circle; rounding would swamp the form above
        lean = away_x / away_y if away_y != 0.0 else 0.0
        out_x, out_y = x - flag_x, y - flag_y
        a, b = 1.0 + lean * lean, out_x * lean + out_y
        s = (-b + math.copysign(math.sqrt(b * b - a * (out_x * out_x + out_y * out_y - radius * radius)), away_y)) / a
        exit_x, exit_y = x + s * lean, y + s
    normal_x, normal_y = exit_x - flag_x, exit_y - flag_y
    length = math.sqrt(normal_x * normal_x + normal_y * normal_y)
    return exit_x, exit_y, normal_x / length, normal_y / length


@part
def slid(vel_x: float, vel_y: float, normal_x: float, normal_y: float) -> tuple[float, float]:
    """Returns the part of a velocity along the circle, given the unit normal there."""
    through = vel_x * normal_x + vel_y * normal_y
    return vel_x - through * normal_x, vel_y - through * normal_y


@part
def single(value: float, rules: Rules) -> float:
    """Returns ``value`` rounded to single precision, if the rules say so."""
    return np.float64(np.float32(value)) if rules.float32_emulation else value


@part
def within_margins(x: float, y: float, rules: Rules) -> bool:
    """Returns whether a vehicle at (``x``, ``y``) m is clear of all walls."""
    margin = rules.agent_radius_m
    return margin <= x <= rules.width_m - margin and margin <= y <= rules.height_m - margin


@part
def move(state: State, b: int, actions: np.ndarray, rules: Rules) -> None:
    """Moves every vehicle of game ``b`` for all sub-steps, in each of them in the order of their numbers.

    Args:
        state: changed.
        b: game.
        actions: (V,) -1..16.
        rules: the game's constants.
    """
    n = rules.team_size
    flag_y = rules.height_m / 2.0
    for v in range(2 * n):
        course = math.radians(state.heading[b, v])
        state.direction[b, v, 0], state.direction[b, v, 1] = math.sin(course), math.cos(course)

    for _ in range(rules.substeps):
        for v in range(2 * n):
            team = v // n
            flag_x = home_x(team, rules)
            x, y = state.pos[b, v, 0], state.pos[b, v, 1]
            speed, is_f32, heading = state.speed[b, v], state.speed_is_f32[b, v], state.heading[b, v]
            state.on_own_side[b, v] = own_side(team, x, rules)

            # 1. What it wants: the pilot's command, or home if tagged; and what its controllers make of it
            if state.is_tagged[b, v]:
                speed_error, error = rules.max_speed - speed, bearing_of(flag_x - x, flag_y - y, heading)
            else:
                desired, error = command(actions[v])
                speed_error = single(desired - speed, rules) if is_f32 else desired - speed
            thrust, new_speed, new_heading = control(
                speed_error, error, state.heading_error_prev[b, v], speed, heading, state.thrust[b, v], rules
            )
            state.heading_error_prev[b, v] = error

            # 2. At a wall it turns round instead of moving
            if not within_margins(x, y, rules):
                bounce(state, b, v, rules)
                continue
            state.oob[b, v] = False
            prev_x, prev_y = state.prev_pos[b, v, 0], state.prev_pos[b, v, 1]
            state.prev_pos[b, v, 0], state.prev_pos[b, v, 1] = x, y

            # 3. Its velocity; inside the keep-out circle it is put outside and slides along
            course = math.radians(wrapped(90.0 - new_heading))
            vel_x, vel_y = single(new_speed * math.cos(course), rules), single(new_speed * math.sin(course), rules)
            kept_out = not state.flag_taken[b, team] and apart(x, y, flag_x, flag_y) < rules.flag_keepout_m
            if kept_out:
                x, y, normal_x, normal_y = pushed_out(x, y, prev_x, prev_y, flag_x, flag_y, rules.flag_keepout_m + 0.1)
                vel_x, vel_y = slid(vel_x, vel_y, normal_x, normal_y)
            will_be_f32 = rules.float32_emulation and new_speed > 0.1 and not kept_out
            if new_speed > 0.1:
                new_heading = heading_of(vel_x, vel_y)
                new_speed = length32(vel_x, vel_y) if will_be_f32 else math.sqrt(vel_x * vel_x + vel_y * vel_y)

            # 4. It moves with the mean of old and new speed, in the mean of old and new direction
            course = math.radians(new_heading)
            sine, cosine = math.sin(course), math.cos(course)
            mean_course = math.atan2(sine + state.direction[b, v, 0], cosine + state.direction[b, v, 1])
            state.direction[b, v, 0], state.direction[b, v, 1] = sine, cosine
            mean_speed = (single(new_speed + speed, rules) if is_f32 and will_be_f32 else new_speed + speed) / 2.0
            x += math.sin(mean_course) * mean_speed * rules.tau_s
            y += math.cos(mean_course) * mean_speed * rules.tau_s
            state.pos[b, v, 0], state.pos[b, v, 1] = x, y
            if state.has_flag[b, v]:
                state.flag_pos[b, 1 - team, 0], state.flag_pos[b, 1 - team, 1] = x, y
            if not rules.stale_side:
                state.on_own_side[b, v] = own_side(team, x, rules)
            state.speed[b, v] = min(max(new_speed, 0.0), rules.max_speed)
            state.speed_is_f32[b, v] = will_be_f32 and new_speed <= rules.max_speed
            state.heading[b, v] = new_heading
            state.thrust[b, v] = thrust
