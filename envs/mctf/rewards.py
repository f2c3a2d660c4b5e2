"""Rewards of one step, for every vehicle of a game, from the state after the step and what it keeps of before.

In the first step of a game nothing counts as new, as there is nothing to compare with.
"""

import numpy as np

from mctf.compiled import kernel, part
from mctf.geometry import apart, home_x
from mctf.rules import Rules
from mctf.state import State

NAMES = ("custom_rew2", "custom_rew", "sparse")
"""Names of the rewards; a reward's number is its place here."""
CUSTOM_REW2, CUSTOM_REW, SPARSE = range(len(NAMES))


@kernel
def rewards(kind: int, state: State, b: int, rules: Rules, out: np.ndarray) -> None:
    """Writes the reward of every vehicle for the last step of game ``b``.

    Args:
        kind: place in ``NAMES``. ``custom_rew2`` is what the paper trains with.
        state: after the step; not changed.
        b: game.
        rules: the game's constants.
        out: (V,) float64, overwritten.
    """
    first = state.steps[b] <= 1
    for v in range(2 * rules.team_size):
        us = v // rules.team_size
        them = 1 - us
        # What is new to this vehicle's team, +1 for its own success and -1 for the opponents'
        grab = int(state.pickup[b, us] and not (first or state.was_pickup[b, us]))
        lost_flag = int(state.pickup[b, them] and not (first or state.was_pickup[b, them]))
        capture = int(state.capture[b, us] and not (first or state.was_capture[b, us]))
        defeat = int(state.capture[b, them] and not (first or state.was_capture[b, them]))
        # What is new to this vehicle
        carries = state.has_flag[b, v]
        carried = carries if first else state.was_carrying[b, v]
        tagged = state.is_tagged[b, v]
        newly_tagged = tagged and not (first or state.was_tagged[b, v])
        target = state.tagged_opponent[b, v]
        target_carried = target >= 0 and (state.has_flag[b, target] if first else state.was_carrying[b, target])
        oob = state.oob[b, v]

        if kind == CUSTOM_REW2:
            dropped = carried and not carries and not state.capture[b, us]
            grabbed = carries and not carried
            out[v] = custom_rew2(
                capture - defeat, int(grabbed) - lost_flag, dropped, newly_tagged, target >= 0, target_carried, oob
            )
        elif kind == SPARSE:
            out[v] = sparse(capture - defeat, grab - lost_flag, tagged, carried, target >= 0, target_carried, oob)
        else:
            goal_x, goal_y = home_x(us if carries else them, rules), rules.height_m / 2.0
            nearer = 0.0
            if not first:
                nearer = apart(state.was_pos[b, v, 0], state.was_pos[b, v, 1], goal_x, goal_y)
                nearer -= apart(state.pos[b, v, 0], state.pos[b, v, 1], goal_x, goal_y)
            out[v] = custom_rew(tagged, capture > 0, carries, nearer)


@part
def custom_rew2(
    captures: int, grabs: int, dropped: bool, newly_tagged: bool, tags: bool, target_carried: bool, oob: bool
) -> float:
    """Returns +-1 for flags, captures and walls, +-0.05 for tags; the paper's training reward.

    Args:
        captures: own minus opponents', of the teams.
        grabs: of this vehicle, minus the opponents' of their team.
        dropped: lost the flag that it carried, other than by capture.
        newly_tagged: it has been tagged.
        tags: it tagged an opponent.
        target_carried: that opponent carried the flag the step before.
        oob: it hit a wall in the last sub-step.
    """
    reward = np.float64(captures + grabs)
    if dropped:
        reward -= 1.0
    if newly_tagged:
        reward -= 0.05
    if tags:
        reward += 1.05 if target_carried else 0.05
    return reward - 1.0 if oob else reward


@part
def custom_rew(tagged: bool, captured: bool, carries: bool, nearer: float) -> float:
    """Returns 10 for a capture of the team, else what it is worth to be ``nearer`` to the goal by so many m.

    The goal is the opponents' flag home, and the own one for a carrier. Nothing while tagged.
    """
    if tagged:
        return 0.0
    if captured:
        return 10.0
    return 0.1 + min(0.9, 0.9 * nearer / 5.0) if carries else min(0.1, 0.1 * nearer / 5.0)


@part
def sparse(
    captures: int, grabs: int, tagged: bool, carried: bool, tags: bool, target_carried: bool, oob: bool
) -> float:
    """Returns +-50 for flags, +-100 for captures and walls; being tagged costs in every step that it lasts.

    Args:
        captures: own minus opponents', of the teams; as ``grabs``.
        grabs: own minus opponents'.
        tagged: it is tagged.
        carried: it carried the flag the step before.
        tags: it tagged an opponent.
        target_carried: that opponent carried the flag the step before; it is worth less then, as in the original.
        oob: it hit a wall in the last sub-step.
    """
    reward = 100.0 * captures + 50.0 * grabs
    if tagged:
        reward -= 100.0 if carried else 50.0
    if tags:
        reward += 50.0 if target_carried else 100.0
    return reward - 100.0 if oob else reward
