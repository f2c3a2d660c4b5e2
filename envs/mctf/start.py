"""The start of a game."""

import math

from mctf.compiled import kernel, part
from mctf.draws import next_uniform
from mctf.geometry import apart, home, is_right, team_of, vehicles_of
from mctf.rules import BLUE, RED, STARTS_QUARTER, STARTS_RANDOM, Rules
from mctf.state import State, send_home


@kernel
def reset(state: State, b: int, rules: Rules) -> None:
    """Sets game ``b`` to the start: at rest, facing the opponents, counters at zero.

    With ``STARTS_RANDOM`` places and headings are drawn from ``state.stream[b]``; seed it before.
    """
    if rules.pid_reset:
        forget(state, b, rules)
    for v in range(rules.blue_size + rules.red_size):
        place(state, b, v, rules)
        for axis in range(2):
            state.prev_pos[b, v, axis] = state.pos[b, v, axis]
            state.was_pos[b, v, axis] = state.pos[b, v, axis]
            state.command[b, v, axis] = 0.0
        state.speed[b, v] = 0.0
        state.speed_is_f32[b, v] = False
        state.thrust[b, v] = 0.0
        state.has_flag[b, v] = False
        state.on_own_side[b, v] = True
        state.is_tagged[b, v] = False
        state.cooldown[b, v] = rules.tagging_cooldown_s
        state.oob[b, v] = False
        state.tagged_opponent[b, v] = -1
        state.was_carrying[b, v] = False
        state.was_tagged[b, v] = False
        state.goal[b, v] = 0
        state.reach[b, v] = math.nan
        for event in range(state.events.shape[2]):
            state.events[b, v, event] = 0
        for other in range(state.touching.shape[2]):
            state.touching[b, v, other] = False
    for team in (BLUE, RED):
        send_home(state, b, team, rules)
        state.capture[b, team] = False
        state.was_pickup[b, team] = False
        state.was_capture[b, team] = False
        for kind in range(3):
            state.score[b, team, kind] = 0
    state.time[b] = 0.0
    state.steps[b] = 0


@part
def forget(state: State, b: int, rules: Rules) -> None:
    """Empties the controllers' memory of game ``b``, as in a new environment object; call it before ``reset``."""
    for v in range(rules.blue_size + rules.red_size):
        state.heading_error_prev[b, v] = 0.0
        state.heading_error_known[b, v] = False


@part
def place(state: State, b: int, v: int, rules: Rules) -> None:
    """Writes position in m and heading in deg at which vehicle ``v`` starts."""
    team = team_of(v, rules)
    first, last = vehicles_of(team, rules)
    size, place_in_team = last - first, v - first
    right = is_right(team, rules)
    state.heading[b, v] = -90.0 if right else 90.0
    if rules.starts == STARTS_RANDOM:
        scatter(state, b, v, team, rules)
    elif rules.starts == STARTS_QUARTER:
        # On the team's quarter of the field; number 0 is the lowest
        state.pos[b, v, 0] = 3.0 * rules.width_m / 4.0 if right else rules.width_m / 4.0
        state.pos[b, v, 1] = rules.height_m / (size + 1) * (1 + place_in_team)
    else:
        # Midway between the flag and the middle line, facing it; number 0 is the highest
        state.pos[b, v, 0] = (home(team, rules)[0] + rules.width_m / 2.0) / 2.0
        state.pos[b, v, 1] = rules.height_m - rules.height_m * (place_in_team + 1) / (size + 1)


@part
def scatter(state: State, b: int, v: int, team: int, rules: Rules) -> None:
    """Draws a start: anywhere on a team's half, inside the walls, outside its keep-out circle, with any heading."""
    home_x, home_y = home(team, rules)
    margin = rules.agent_radius_m
    left = rules.width_m / 2.0 if is_right(team, rules) else margin
    while True:
        x = left + next_uniform(state.stream, b) * (rules.width_m / 2.0 - margin)
        y = margin + next_uniform(state.stream, b) * (rules.height_m - 2.0 * margin)
        if apart(x, y, home_x, home_y) > rules.flag_keepout_m + margin:
            break
    state.pos[b, v, 0], state.pos[b, v, 1] = x, y
    state.heading[b, v] = 360.0 * next_uniform(state.stream, b) - 180.0
