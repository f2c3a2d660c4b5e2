"""All that changes in a game, as arrays over many games.

Shape letters: B games, V vehicles (blue first, then red), 2 teams (blue, red).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.compiled import part
from mctf.geometry import home
from mctf.rules import Rules

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
    "collisions",
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
    COLLIDED,
) = range(len(EVENTS))


class State(NamedTuple):
    """State of B games; whatever a step needs is here, hidden controller memory included.

    Attributes:
        pos: (B, V, 2) m.
        prev_pos: (B, V, 2) m, position before the last sub-step.
        speed: (B, V) m/s in [0, max_speed].
        speed_is_f32: (B, V) whether the original held this speed in single precision.
        heading: (B, V) deg in [-180, 180], clockwise from +y.
        thrust: (B, V) in [-100, 100], accumulates over the steps.
        heading_error_prev: (B, V) deg, memory of the heading controller.
        heading_error_known: (B, V) whether the heading controller has such a memory.
        has_flag: (B, V) carries the opponents' flag.
        on_own_side: (B, V) as tested at the start of the last sub-step.
        is_tagged: (B, V).
        cooldown: (B, V) s since the last tag, counts up to ``tagging_cooldown_s``: ready.
        oob: (B, V) hit a wall in the last sub-step, or is out of bounds.
        tagged_opponent: (B, V) whom this vehicle tagged in the last step, -1 nobody.
        flag_pos: (B, 2, 2) m.
        flag_taken: (B, 2) the team's flag is carried.
        pickup: (B, 2) the team carries the opponents' flag; as long as it does.
        capture: (B, 2) the team captured in the last step.
        score: (B, 2, 3) captures, tags, grabs of the team.
        time: (B,) s.
        steps: (B,) environment steps played.
        events: (B, V, 11) how often, columns as in ``EVENTS``.
        was_carrying: (B, V) ``has_flag`` before the last step; so the other four, for rewards.
        was_tagged: (B, V).
        was_pickup: (B, 2).
        was_capture: (B, 2).
        was_pos: (B, V, 2) m.
        touching: (B, V, V) whether two vehicles are in contact, entry (i, j) for i < j.
        goal: (B, V) memory of fixed policies: where they go next.
        reach: (B, V) m, memory of fixed policies: how far they defend; NaN before the first time.
        stream: (B,) random numbers of the game: the counter of ``draws``.
        command: (B, V, 2) of the last step: desired speed in m/s, turn in deg.
        direction: (B, V, 4) of the motion within a step, ``dynamics.Boat``; every step starts with its own.
    """

    pos: Floats
    prev_pos: Floats
    speed: Floats
    speed_is_f32: Bools
    heading: Floats
    thrust: Floats
    heading_error_prev: Floats
    heading_error_known: Bools
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
    touching: Bools
    goal: Ints
    reach: Floats
    stream: NDArray[np.uint64]
    command: Floats
    direction: Floats


def empty(games: int, rules: Rules) -> State:
    """Returns zeros for ``games`` games; ``reset`` makes a game of each."""
    b, v = games, rules.blue_size + rules.red_size
    floats: dict[str, tuple[int, ...]] = {
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
        "reach": (b, v),
        "command": (b, v, 2),
        "direction": (b, v, 4),
    }
    of_vehicles = (
        "speed_is_f32",
        "heading_error_known",
        "has_flag",
        "on_own_side",
        "is_tagged",
        "oob",
        "was_carrying",
        "was_tagged",
    )
    of_teams = ("flag_taken", "pickup", "capture", "was_pickup", "was_capture")
    arrays: dict[str, NDArray[Any]] = {name: np.zeros(shape) for name, shape in floats.items()}
    arrays |= {name: np.zeros((b, v), np.bool_) for name in of_vehicles}
    arrays |= {name: np.zeros((b, 2), np.bool_) for name in of_teams}
    return State(
        **arrays,
        tagged_opponent=np.full((b, v), -1, np.int64),
        score=np.zeros((b, 2, 3), np.int64),
        steps=np.zeros(b, np.int64),
        events=np.zeros((b, v, len(EVENTS)), np.int64),
        touching=np.zeros((b, v, v), np.bool_),
        goal=np.zeros((b, v), np.int64),
        stream=np.zeros(b, np.uint64),
    )


@part
def send_home(state: State, b: int, team: int, rules: Rules) -> None:
    """Puts the team's flag back to its home; the opponents no longer hold it."""
    state.flag_pos[b, team, 0], state.flag_pos[b, team, 1] = home(team, rules)
    state.flag_taken[b, team] = False
    state.pickup[b, 1 - team] = False
