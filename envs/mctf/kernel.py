"""One step of one game, compiled. ``state`` holds many games; every function touches game ``b`` only.

So threads may step different games of one state at a time (the kernels release the GIL), and a game
comes out the same to the last bit whichever games stand beside it.
"""

import numpy as np

from mctf.commands import command
from mctf.compiled import kernel, part
from mctf.dynamics import move
from mctf.events import capture, collide, grab, leave, tag, untag
from mctf.rules import BLUE, RED, Rules
from mctf.state import CAPTURES, STEPS_CARRYING, STEPS_TAGGED, State

RUNNING, BLUE_WON, RED_WON, TIME_OUT, TIED = range(5)
"""What ``finished`` returns. TIED: both teams reached ``max_score`` in one step, and the rules call that a draw."""


@kernel
def step(state: State, b: int, actions: np.ndarray, rules: Rules) -> None:
    """Plays one environment step of game ``b``: ``substeps`` of motion, then the events once.

    Args:
        state: changed.
        b: game.
        actions: (V,) int64, as of ``commands.command``: 0..16, 17..61 for field points, -1 and -2.
        rules: the game's constants.
    """
    for v in range(rules.blue_size + rules.red_size):
        state.command[b, v, 0], state.command[b, v, 1] = command(state, b, v, actions[v], rules)
    advance(state, b, rules)


@kernel
def drive(state: State, b: int, commands: np.ndarray, rules: Rules) -> None:
    """Plays one step with continuous actions.

    Args:
        state: changed.
        b: game.
        commands: (V, 2) desired speed in m/s and turn in deg, clockwise positive, relative to the present heading.
        rules: the game's constants.
    """
    for v in range(rules.blue_size + rules.red_size):
        state.command[b, v, 0], state.command[b, v, 1] = commands[v, 0], commands[v, 1]
    advance(state, b, rules)


@part
def advance(state: State, b: int, rules: Rules) -> None:
    """Plays one step of game ``b`` with the commands that stand in the state."""
    duration = rules.substeps * rules.tau_s
    state.time[b] += duration
    state.steps[b] += 1
    for v in range(rules.blue_size + rules.red_size):
        state.was_carrying[b, v] = state.has_flag[b, v]
        state.was_tagged[b, v] = state.is_tagged[b, v]
        state.was_pos[b, v, 0], state.was_pos[b, v, 1] = state.pos[b, v, 0], state.pos[b, v, 1]
        if state.cooldown[b, v] != rules.tagging_cooldown_s:
            state.cooldown[b, v] = min(state.cooldown[b, v] + duration, rules.tagging_cooldown_s)
    for team in range(2):
        state.was_pickup[b, team] = state.pickup[b, team]
        state.was_capture[b, team] = state.capture[b, team]

    move(state, b, rules)
    if not rules.bounces:
        leave(state, b, rules)
    grab(state, b, rules)
    tag(state, b, rules)
    capture(state, b, rules)
    untag(state, b, rules)
    collide(state, b, rules)

    for v in range(rules.blue_size + rules.red_size):
        state.events[b, v, STEPS_CARRYING] += state.has_flag[b, v]
        state.events[b, v, STEPS_TAGGED] += state.is_tagged[b, v]


@kernel
def finished(state: State, b: int, rules: Rules) -> int:
    """Returns RUNNING, BLUE_WON, RED_WON, TIME_OUT or TIED for game ``b``."""
    if state.score[b, RED, CAPTURES] >= rules.max_score:
        tied = state.score[b, BLUE, CAPTURES] >= rules.max_score
        return TIED if tied and not rules.tie_is_reds else RED_WON
    if state.score[b, BLUE, CAPTURES] >= rules.max_score:
        return BLUE_WON
    over = state.time[b] >= rules.max_time_s
    if not rules.clock_overruns:
        over = over or abs(state.time[b] - rules.max_time_s) <= 1e-8 + 1e-5 * rules.max_time_s  # as numpy.isclose
    return TIME_OUT if over else RUNNING


@part
def lead(state: State, b: int, end: int) -> int:
    """Returns 1 if blue won game b, which ended as ``end`` says, -1 if red did, 0 for a draw.

    More captures win on time.
    """
    if end == BLUE_WON:
        return 1
    if end == RED_WON:
        return -1
    if end == TIED:
        return 0
    gap = state.score[b, BLUE, CAPTURES] - state.score[b, RED, CAPTURES]
    return 1 if gap > 0 else -1 if gap < 0 else 0
