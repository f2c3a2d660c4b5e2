"""All that changes in a game, as arrays over many games.

Shape letters: B games, V = 2n vehicles (blue 0..n-1, red n..2n-1), 2 teams (blue, red).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.compiled import kernel, part
from mctf.geometry import home_x
from mctf.rules import BLUE, RED, Rules

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

CAPTURES, TAGS, GRABS = 0, 1, 2
"""Columns of ``State.score``."""

EVENTS = (
    "grabs",
    "captures",
    "tags",
    "times_tagged",
    "flags_lost_by_tag",
    "flags_lost_by_wall",
    "wall_hits",
    "untags",
    "steps_carrying",
    "steps_tagged",
)
"""Names of the columns of ``State.events``; the numbers are below, in the same order."""
(
    GRABBED,
    CAPTURED,
    TAGGED,
    WAS_TAGGED,
    LOST_BY_TAG,
    LOST_BY_WALL,
    HIT_WALL,
    UNTAGGED,
    STEPS_CARRYING,
    STEPS_TAGGED,
) = range(len(EVENTS))


class State(NamedTuple):
    """State of B games; whatever a step needs is here, hidden controller memory included.

    Attributes:
        pos: (B, V, 2) m.
        prev_pos: (B, V, 2) m, position before the last sub-step.
        speed: (B, V) m/s in [0, max_speed].
        speed_is_f32: (B, V) whether the original held this speed in single precision.
        heading: (B, V) deg in [-180, 180], clockwise from +y.
        thrust: (B, V) in [-70, 70], accumulates over the steps.
        heading_error_prev: (B, V) deg, memory of the heading controller.
        has_flag: (B, V) carries the opponents' flag.
        on_own_side: (B, V) as tested at the start of the last sub-step.
        is_tagged: (B, V).
        cooldown: (B, V) s since the last tag, counts up to ``tagging_cooldown_s``: ready.
        oob: (B, V) hit a wall in the last sub-step.
        tagged_opponent: (B, V) whom this vehicle tagged in the last step, -1 nobody.
        flag_pos: (B, 2, 2) m.
        flag_taken: (B, 2) the team's flag is carried.
        pickup: (B, 2) the team carries the opponents' flag; as long as it does.
        capture: (B, 2) the team captured in the last step.
        score: (B, 2, 3) captures, tags, grabs of the team.
        time: (B,) s.
        steps: (B,) environment steps played.
        events: (B, V, 10) how often, columns as in ``EVENTS``.
        was_carrying: (B, V) ``has_flag`` before the last step; so the other four, for rewards.
        was_tagged: (B, V).
        was_pickup: (B, 2).
        was_capture: (B, 2).
        was_pos: (B, V, 2) m.
        direction: (B, V, 2) sine and cosine of ``heading`` within a step; every step starts with its own.
    """

    pos: Floats
    prev_pos: Floats
    speed: Floats
    speed_is_f32: Bools
    heading: Floats
    thrust: Floats
    heading_error_prev: Floats
    has_flag: Bools
    on_own_side: Bools
    is_tagged: Bools
    cooldown: Floats
    oob: Bools
    tagged_opponent: Ints
    flag_pos: Floats
    flag_taken: Bools
    pickup: Bools
    capture: Bools
    score: Ints
    time: Floats
    steps: Ints
    events: Ints
    was_carrying: Bools
    was_tagged: Bools
    was_pickup: Bools
    was_capture: Bools
    was_pos: Floats
    direction: Floats


def empty(games: int, team_size: int) -> State:
    """Returns zeros for ``games`` games of ``team_size`` a side; ``reset`` makes a game of each."""
    b, v = games, 2 * team_size
    floats = {
        name: np.zeros(shape)
        for name, shape in {
            "pos": (b, v, 2),
            "prev_pos": (b, v, 2),
            "speed": (b, v),
            "heading": (b, v),
            "thrust": (b, v),
            "heading_error_prev": (b, v),
            "cooldown": (b, v),
            "flag_pos": (b, 2, 2),
            "time": (b,),
            "was_pos": (b, v, 2),
            "direction": (b, v, 2),
        }.items()
    }
    of_vehicles = ("speed_is_f32", "has_flag", "on_own_side", "is_tagged", "oob", "was_carrying", "was_tagged")
    of_teams = ("flag_taken", "pickup", "capture", "was_pickup", "was_capture")
    return State(
        **floats,
        **{name: np.zeros((b, v), np.bool_) for name in of_vehicles},
        **{name: np.zeros((b, 2), np.bool_) for name in of_teams},
        tagged_opponent=np.full((b, v), -1, np.int64),
        score=np.zeros((b, 2, 3), np.int64),
        steps=np.zeros(b, np.int64),
        events=np.zeros((b, v, len(EVENTS)), np.int64),
    )


@part
def send_home(state: State, b: int, team: int, rules: Rules) -> None:
    """Puts the team's flag back to its home; the opponents no longer hold it."""
    state.flag_pos[b, team, 0] = home_x(team, rules)
    state.flag_pos[b, team, 1] = rules.height_m / 2.0
    state.flag_taken[b, team] = False
    state.pickup[b, 1 - team] = False


@kernel
def reset(state: State, b: int, rules: Rules) -> None:
    """Sets game ``b`` to the start, always the same: at rest, facing the opponents, counters at zero."""
    n = rules.team_size
    for v in range(2 * n):
        blue = v < n
        state.pos[b, v, 0] = 3.0 * rules.width_m / 4.0 if blue else rules.width_m / 4.0
        state.pos[b, v, 1] = rules.height_m / (n + 1) * (1 + v % n)
        state.heading[b, v] = -90.0 if blue else 90.0
        for axis in range(2):
            state.prev_pos[b, v, axis] = state.pos[b, v, axis]
            state.was_pos[b, v, axis] = state.pos[b, v, axis]
        state.speed[b, v] = 0.0
        state.speed_is_f32[b, v] = False
        state.thrust[b, v] = 0.0
        if rules.pid_reset:
            state.heading_error_prev[b, v] = 0.0
        state.has_flag[b, v] = False
        state.on_own_side[b, v] = True
        state.is_tagged[b, v] = False
        state.cooldown[b, v] = rules.tagging_cooldown_s
        state.oob[b, v] = False
        state.tagged_opponent[b, v] = -1
        state.was_carrying[b, v] = False
        state.was_tagged[b, v] = False
        for event in range(state.events.shape[2]):
            state.events[b, v, event] = 0
    for team in (BLUE, RED):
        send_home(state, b, team, rules)
        state.capture[b, team] = False
        state.was_pickup[b, team] = False
        state.was_capture[b, team] = False
        for kind in range(3):
            state.score[b, team, kind] = 0
    state.time[b] = 0.0
    state.steps[b] = 0
