"""Fixed policies that drive from field point to field point; their memory is the place in the route, 0 at first."""

import numpy as np

from mctf.commands import FIELD_POINTS, field_point
from mctf.compiled import part
from mctf.defenders import chase
from mctf.geometry import apart
from mctf.rules import ACTIONS, POLICIES_REPAIRED, Rules
from mctf.steering import TAGGED

RAID, BEAT, ROUND = range(3)
"""Routes of a competition's easy attacker and easy defender, and of ``waypoint``."""
RAID_POINTS = tuple(FIELD_POINTS.index(name) for name in ("SC", "CFX", "PC", "CF"))
"""To the opponents' flag along one wall, home along the other."""
BEAT_POINTS = tuple(FIELD_POINTS.index(name) for name in ("PM", "SM", "SC"))
"""To and fro between the first two; the third only after a tag."""
ROUND_POINTS = tuple(FIELD_POINTS.index(name) for name in ("PM", "PHX", "CFX", "SHX", "SM", "CH"))
"""Out on one side, over the opponents' flag, home on the other; over and over, and anew after a tag."""
IDLE = -1
"""The action of who does nothing: the original's other word for stop."""
POST = FIELD_POINTS.index("CH")
"""Where a competition's medium defender waits, in front of its flag."""

REACHED = 2.5
"""m; so near to a field point a vehicle has been there."""
HOME_REACHED = 6.0
"""m; the same for the own flag's, which the keep-out circle surrounds."""


@part
def distance_to(point: int, raw: np.ndarray, right: bool, rules: Rules) -> float:
    """Returns how far in m the vehicle is from a field point, by the walls that it sees.

    Args:
        point: 0..44, as the team on the left names it.
        raw: (O,) as of ``observe``.
        right: whether the team has the right half.
        rules: the game's constants.
    """
    x, y = (raw[11], raw[9]) if right else (raw[7], raw[5])  # left and bottom wall
    to_x, to_y = field_point(point, right, rules)
    return apart(x, y, to_x, to_y)


@part
def point_of(route: int, goal: int) -> int:
    """Returns the field point 0..44 at place ``goal`` of a route."""
    if route == RAID:
        return RAID_POINTS[goal]
    return BEAT_POINTS[goal] if route == BEAT else ROUND_POINTS[goal]


@part
def drive_on(route: int, goal: int, raw: np.ndarray, right: bool, rules: Rules) -> tuple[int, int]:
    """Returns the next place in the route, and the field point to drive to.

    Args:
        route: RAID, BEAT or ROUND.
        goal: place in it.
        raw: (O,) as of ``observe``.
        right: whether the team has the right half.
        rules: the game's constants.
    """
    distance = distance_to(point_of(route, goal), raw, right, rules)
    tagged = raw[TAGGED] > 0.0
    if route == ROUND:
        near = distance <= max(REACHED, rules.field_point_reach_m)
        goal = 0 if tagged else (goal + 1) % len(ROUND_POINTS) if near else goal
    elif rules.policy_version == POLICIES_REPAIRED:
        goal = next_repaired(route, goal, distance, tagged)
    else:
        goal = next_original(route, goal, distance, tagged)
    return goal, point_of(route, goal)


@part
def next_repaired(route: int, goal: int, distance: float, tagged: bool) -> int:
    """Returns the next place in RAID or BEAT; with a tag they begin anew in the middle, at SC.

    Args:
        route: RAID or BEAT.
        goal: the present place.
        distance: m from it.
        tagged: whether the vehicle is.
    """
    if route == RAID:
        if tagged:
            return 0
        return (goal + 1) % 4 if distance <= (HOME_REACHED if goal == 3 else REACHED) else goal
    if tagged:
        return 2
    return (0 if goal == 1 else 1) if distance <= REACHED else goal


@part
def next_original(route: int, goal: int, distance: float, tagged: bool) -> int:
    """Returns the next place as ``next_repaired``, but the distance is always from the place before.

    So a vehicle that is tagged at that place goes on at once from SC; and who has been at PC would drive to CF, but
    is found near it and goes to SC.
    """
    if tagged:
        goal = 0 if route == RAID else 2
    if distance <= REACHED:
        goal = (goal + 1) % 4 if route == RAID else 0 if goal == 1 else 1
    return 0 if route == RAID and goal == 3 and distance <= HOME_REACHED else goal


@part
def watch(raw: np.ndarray, enemies: int, right: bool, rules: Rules) -> int:
    """Returns the action of a competition's medium defender: after intruders, or else at its post.

    Args:
        raw: (O,) as of ``observe``.
        enemies: place of the first opponent in it.
        right: whether the team has the right half.
        rules: the game's constants.
    """
    action = chase(raw, enemies)
    if action >= 0:
        return action
    return IDLE if distance_to(POST, raw, right, rules) <= REACHED else ACTIONS + POST
