"""Grabs, tags, captures and untagging, once at the end of an environment step.

All distances are between centres, all limits strict, and in each phase the lowest number comes first.
"""

from mctf.compiled import part
from mctf.geometry import apart, home_x
from mctf.rules import Rules
from mctf.state import (
    CAPTURED,
    CAPTURES,
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
def grab(state: State, b: int, rules: Rules) -> None:
    """Gives a flag at home to the first free opponent near it, wherever that one's own side is."""
    for v in range(2 * rules.team_size):
        team = v // rules.team_size
        if state.has_flag[b, v] or state.is_tagged[b, v] or state.flag_taken[b, 1 - team]:
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
    n = rules.team_size
    for v in range(2 * n):
        state.tagged_opponent[b, v] = -1
        ready = state.cooldown[b, v] == rules.tagging_cooldown_s
        if not (state.on_own_side[b, v] and ready and not state.is_tagged[b, v]):
            continue
        team = v // n
        for target in range((1 - team) * n, (1 - team) * n + n):
            if state.is_tagged[b, target] or state.on_own_side[b, target]:
                continue
            distance = apart(state.pos[b, v, 0], state.pos[b, v, 1], state.pos[b, target, 0], state.pos[b, target, 1])
            if 0.0 < distance < rules.catch_radius_m:
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
                break


@part
def capture(state: State, b: int, rules: Rules) -> None:
    """Scores for the first carrier on its own side; the others score a step later: blue wins a tie."""
    state.capture[b, 0] = state.capture[b, 1] = False
    for v in range(2 * rules.team_size):
        if not (state.has_flag[b, v] and state.on_own_side[b, v]):
            continue
        team = v // rules.team_size
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
    for v in range(2 * rules.team_size):
        x, y = home_x(v // rules.team_size, rules), rules.height_m / 2.0
        near = apart(state.pos[b, v, 0], state.pos[b, v, 1], x, y) < rules.untag_radius_m
        if state.is_tagged[b, v] and near:
            state.is_tagged[b, v] = False
            state.events[b, v, UNTAGGED] += 1
