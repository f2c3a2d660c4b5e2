"""Grabs, tags, captures and untagging, once at the end of an environment step.

All distances are between centres, all limits strict, and in each phase the lowest number comes first.
"""

from mctf.compiled import part
from mctf.dynamics import count_hit, penalise, within
from mctf.geometry import apart, home, team_of, vehicles_of
from mctf.rules import Rules
from mctf.state import (
    CAPTURED,
    CAPTURES,
    COLLIDED,
    GRABBED,
    GRABS,
    LOST_BY_TAG,
    TAGGED,
    TAGS,
    UNTAGGED,
    WAS_TAGGED,
    State,
    send_home,
)


@part
def leave(state: State, b: int, rules: Rules) -> None:
    """Marks who is out of bounds, for rules without bouncing; whoever is loses its flag and may be tagged."""
    for v in range(rules.blue_size + rules.red_size):
        outside = not within(state.pos[b, v, 0], state.pos[b, v, 1], 0.0, rules)
        if outside:
            if not state.oob[b, v]:
                count_hit(state, b, v, team_of(v, rules), rules)
            penalise(state, b, v, team_of(v, rules), rules)
        state.oob[b, v] = outside


@part
def grab(state: State, b: int, rules: Rules) -> None:
    """Gives a flag at home to the first free opponent near it."""
    for v in range(rules.blue_size + rules.red_size):
        team = team_of(v, rules)
        if state.has_flag[b, v] or state.is_tagged[b, v] or state.flag_taken[b, 1 - team]:
            continue
        if state.on_own_side[b, v] and not rules.grab_from_own_side:
            continue
        flag_x, flag_y = state.flag_pos[b, 1 - team, 0], state.flag_pos[b, 1 - team, 1]
        if apart(state.pos[b, v, 0], state.pos[b, v, 1], flag_x, flag_y) < rules.catch_radius_m:
            state.has_flag[b, v] = True
            state.flag_taken[b, 1 - team] = True
            state.pickup[b, team] = True
            state.score[b, team, GRABS] += 1
            state.events[b, v, GRABBED] += 1


@part
def tag(state: State, b: int, rules: Rules) -> None:
    """Lets every ready defender tag one opponent: the one with the lowest number, carrier or not."""
    for v in range(rules.blue_size + rules.red_size):
        state.tagged_opponent[b, v] = -1
        ready = state.cooldown[b, v] == rules.tagging_cooldown_s and (rules.oob_may_tag or not state.oob[b, v])
        if state.on_own_side[b, v] and ready and not state.is_tagged[b, v]:
            tag_one(state, b, v, rules)


@part
def tag_one(state: State, b: int, v: int, rules: Rules) -> None:
    """Lets vehicle ``v``, which is ready, tag the first opponent that it can."""
    team = team_of(v, rules)
    first, last = vehicles_of(1 - team, rules)
    for target in range(first, last):
        if state.is_tagged[b, target] or state.on_own_side[b, target]:
            continue
        distance = apart(state.pos[b, v, 0], state.pos[b, v, 1], state.pos[b, target, 0], state.pos[b, target, 1])
        if distance >= rules.catch_radius_m or (distance == 0.0 and not rules.tag_at_zero):
            continue
        state.is_tagged[b, target] = True
        state.tagged_opponent[b, v] = target
        state.cooldown[b, v] = 0.0
        state.score[b, team, TAGS] += 1
        state.events[b, v, TAGGED] += 1
        state.events[b, target, WAS_TAGGED] += 1
        if state.has_flag[b, target]:
            state.has_flag[b, target] = False
            state.events[b, target, LOST_BY_TAG] += 1
            send_home(state, b, team, rules)
        return


@part
def capture(state: State, b: int, rules: Rules) -> None:
    """Scores for the carriers on their own side, or for the first of them only; the other scores a step later."""
    state.capture[b, 0] = state.capture[b, 1] = False
    for v in range(rules.blue_size + rules.red_size):
        if not (state.has_flag[b, v] and state.on_own_side[b, v]):
            continue
        team = team_of(v, rules)
        state.has_flag[b, v] = False
        send_home(state, b, 1 - team, rules)
        state.capture[b, team] = True
        state.score[b, team, CAPTURES] += 1
        state.events[b, v, CAPTURED] += 1
        if rules.capture_first_only:
            return


@part
def untag(state: State, b: int, rules: Rules) -> None:
    """Frees every tagged vehicle near its own flag's home."""
    for v in range(rules.blue_size + rules.red_size):
        if not state.is_tagged[b, v]:
            continue
        x, y = home(team_of(v, rules), rules)
        if apart(state.pos[b, v, 0], state.pos[b, v, 1], x, y) < rules.untag_radius_m:
            state.is_tagged[b, v] = False
            state.events[b, v, UNTAGGED] += 1


@part
def collide(state: State, b: int, rules: Rules) -> None:
    """Counts, for both, every contact of two vehicles when it begins; contact changes nothing else."""
    vehicles = rules.blue_size + rules.red_size
    for v in range(vehicles):
        for other in range(v + 1, vehicles):
            dx = state.pos[b, v, 0] - state.pos[b, other, 0]
            dy = state.pos[b, v, 1] - state.pos[b, other, 1]
            contact = dx * dx + dy * dy <= 4.0 * rules.agent_radius_m * rules.agent_radius_m
            if contact and not state.touching[b, v, other]:
                state.events[b, v, COLLIDED] += 1
                state.events[b, other, COLLIDED] += 1
            state.touching[b, v, other] = contact
