"""One step of one game, compiled. ``state`` holds many games; every function touches game ``b`` only.

So threads may step different games of one state at a time (the kernels release the GIL), and a game
comes out the same to the last bit whichever games stand beside it.
"""

import numpy as np

from mctf.compiled import kernel
from mctf.dynamics import move
from mctf.events import capture, grab, tag, untag
from mctf.rules import BLUE, RED, Rules
from mctf.state import CAPTURES, STEPS_CARRYING, STEPS_TAGGED, State

RUNNING, BLUE_WON, RED_WON, TIME_OUT = range(4)
"""What ``finished`` returns."""


@kernel
def step(state: State, b: int, actions: np.ndarray, rules: Rules) -> None:
    """Plays one environment step of game ``b``: ``substeps`` of motion, then the events once.

    Args:
        state: changed.
        b: game.
        actions: (V,) int64, -1..16; -1 is 16: stop. A command is a turn relative to the heading that the
            vehicle has at every moment, not a target, so it goes on turning through all sub-steps.
        rules: the game's constants.
    """
    duration = rules.substeps * rules.tau_s
    state.time[b] += duration
    state.steps[b] += 1
    for v in range(2 * rules.team_size):
        state.was_carrying[b, v] = state.has_flag[b, v]
        state.was_tagged[b, v] = state.is_tagged[b, v]
        state.was_pos[b, v, 0], state.was_pos[b, v, 1] = state.pos[b, v, 0], state.pos[b, v, 1]
        if state.cooldown[b, v] != rules.tagging_cooldown_s:
            state.cooldown[b, v] = min(state.cooldown[b, v] + duration, rules.tagging_cooldown_s)
    for team in range(2):
        state.was_pickup[b, team] = state.pickup[b, team]
        state.was_capture[b, team] = state.capture[b, team]

    move(state, b, actions, rules)
    grab(state, b, rules)
    tag(state, b, rules)
    capture(state, b, rules)
    untag(state, b, rules)

    for v in range(2 * rules.team_size):
        state.events[b, v, STEPS_CARRYING] += state.has_flag[b, v]
        state.events[b, v, STEPS_TAGGED] += state.is_tagged[b, v]


@kernel
def finished(state: State, b: int, rules: Rules) -> int:
    """Returns RUNNING, BLUE_WON, RED_WON or TIME_OUT for game ``b``; red first, should both have the score."""
    if state.score[b, RED, CAPTURES] >= rules.max_score:
        return RED_WON
    if state.score[b, BLUE, CAPTURES] >= rules.max_score:
        return BLUE_WON
    return TIME_OUT if state.time[b] >= rules.max_time_s else RUNNING
