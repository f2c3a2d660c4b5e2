"""All vehicles through the sub-steps of one step: what is wanted of each, its motion, and the walls."""

import math

from mctf.compiled import part
from mctf.geometry import bearing_of, home, own_side, team_of, turned
from mctf.motion import Boat, direction_of, heading_now, moved
from mctf.rules import Rules
from mctf.state import HIT_WALL, LOST_BY_WALL, TAGS, WAS_TAGGED, State, send_home


@part
def read(state: State, b: int, v: int) -> Boat:
    """Returns vehicle ``v`` of game ``b``."""
    return Boat(
        state.pos[b, v, 0],
        state.pos[b, v, 1],
        state.prev_pos[b, v, 0],
        state.prev_pos[b, v, 1],
        state.speed[b, v],
        state.speed_is_f32[b, v],
        state.heading[b, v],
        state.thrust[b, v],
        state.heading_error_prev[b, v],
        state.heading_error_known[b, v],
        state.direction[b, v, 0],
        state.direction[b, v, 1],
        state.direction[b, v, 2],
        state.direction[b, v, 3],
    )


@part
def write(state: State, b: int, v: int, boat: Boat) -> None:
    """Puts a vehicle back."""
    state.pos[b, v, 0] = boat.x
    state.pos[b, v, 1] = boat.y
    state.prev_pos[b, v, 0] = boat.prev_x
    state.prev_pos[b, v, 1] = boat.prev_y
    state.speed[b, v] = boat.speed
    state.speed_is_f32[b, v] = boat.speed_is_f32
    state.heading[b, v] = boat.heading
    state.thrust[b, v] = boat.thrust
    state.heading_error_prev[b, v] = boat.error
    state.heading_error_known[b, v] = boat.error_known
    state.direction[b, v, 0] = boat.sine
    state.direction[b, v, 1] = boat.cosine
    state.direction[b, v, 2] = boat.vel_x
    state.direction[b, v, 3] = boat.vel_y


@part
def move(state: State, b: int, rules: Rules) -> None:
    """Moves every vehicle of game ``b`` for all sub-steps, in each of them in the order of their numbers."""
    vehicles = rules.blue_size + rules.red_size
    for v in range(vehicles):
        state.direction[b, v, 0], state.direction[b, v, 1] = direction_of(state.heading[b, v])
        state.direction[b, v, 2] = math.nan
    for _ in range(rules.substeps):
        for v in range(vehicles):
            team = team_of(v, rules)
            boat = read(state, b, v)
            tagged, guarded = state.is_tagged[b, v], not state.flag_taken[b, team]
            outside = state.oob[b, v] and not rules.bounces
            speed, turn = state.command[b, v, 0], state.command[b, v, 1]
            desired, error = wanted(boat, tagged, outside, speed, turn, team, rules)
            at_wall = rules.bounces and not within(boat.x, boat.y, rules.agent_radius_m, rules)
            on_own_side = own_side(team, boat.x, rules)
            boat = moved(boat, desired, error, tagged, guarded, at_wall, team, rules)
            write(state, b, v, boat)
            state.on_own_side[b, v] = (
                own_side(team, boat.x, rules) if not (rules.stale_side or at_wall) else on_own_side
            )
            if rules.bounces:
                state.oob[b, v] = at_wall
            if at_wall:
                count_hit(state, b, v, team, rules)
                penalise(state, b, v, team, rules)
            elif state.has_flag[b, v]:
                state.flag_pos[b, 1 - team, 0], state.flag_pos[b, 1 - team, 1] = boat.x, boat.y
    for v in range(vehicles):
        state.heading[b, v] = heading_now(state.heading[b, v], state.direction[b, v, 2], state.direction[b, v, 3])


@part
def wanted(
    boat: Boat, tagged: bool, outside: bool, speed: float, turn: float, team: int, rules: Rules
) -> tuple[float, float]:
    """Returns desired speed in m/s and heading error in deg: the pilot's command, unless it is tagged or outside.

    Args:
        boat: the vehicle.
        tagged: whether it must go home.
        outside: whether it must drive back into the field.
        speed: m/s, commanded.
        turn: deg, commanded.
        team: of the vehicle.
        rules: the game's constants.
    """
    if tagged:
        home_x, home_y = home(team, rules)
        speed = rules.max_speed / 2.0 if outside else rules.max_speed
        heading = heading_now(boat.heading, boat.vel_x, boat.vel_y)
        return speed, bearing_of(home_x - boat.x, home_y - boat.y, heading)
    if outside:
        heading = heading_now(boat.heading, boat.vel_x, boat.vel_y)
        return rules.max_speed / 2.0, turned(inward(boat.x, boat.y, rules) - heading)
    return speed, turn


@part
def within(x: float, y: float, margin: float, rules: Rules) -> bool:
    """Returns whether (``x``, ``y``) m is at least ``margin`` m from all walls; with none, strictly inside."""
    if margin == 0.0:
        return 0.0 < x < rules.width_m and 0.0 < y < rules.height_m
    return margin <= x <= rules.width_m - margin and margin <= y <= rules.height_m - margin


@part
def inward(x: float, y: float, rules: Rules) -> float:
    """Returns the heading in deg from the nearest wall straight into the field; of equally near ones the first."""
    beside = max(-x, x - rules.width_m, 0.0)
    above = max(-y, y - rules.height_m, 0.0)
    nearest, heading = math.hypot(beside, y), 0.0
    right, top = math.hypot(above, rules.width_m - x), math.hypot(beside, rules.height_m - y)
    if right < nearest:
        nearest, heading = right, -90.0
    if top < nearest:
        nearest, heading = top, 180.0
    if math.hypot(above, x) < nearest:
        heading = 90.0
    return heading


@part
def count_hit(state: State, b: int, v: int, team: int, rules: Rules) -> None:
    """Counts that a vehicle has come to a wall."""
    state.events[b, v, HIT_WALL] += 1
    if rules.oob_counts_as_tag:
        state.score[b, 1 - team, TAGS] += 1


@part
def penalise(state: State, b: int, v: int, team: int, rules: Rules) -> None:
    """Takes the flag from a vehicle at a wall, and tags it if the rules say so."""
    if state.has_flag[b, v]:
        state.has_flag[b, v] = False
        state.events[b, v, LOST_BY_WALL] += 1
        send_home(state, b, 1 - team, rules)
    if rules.wall_tags and not state.is_tagged[b, v]:
        state.is_tagged[b, v] = True
        state.events[b, v, WAS_TAGGED] += 1
