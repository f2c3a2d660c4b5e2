"""Spaces of the environment, and its state: all of the field in one vector of 9 V + 13 numbers, for critics and logs.

| place | what | range |
|---|---|---|
| 9 v + 0, 1 | vehicle v, blue's first: x, y | 0 to width, 0 to height |
| + 2, 3 | heading, speed | +-180 deg; 0 to ``max_speed`` |
| + 4, 5, 6 | has flag, is on own side, is out of bounds or at a wall | 0, 1 |
| + 7, 8 | cooldown, is tagged | 0 to ``tagging_cooldown_s``; 0, 1 |
| 9 V + 6 t + 0, 1 | team t, blue's first: home of its flag, x, y | 0 to width, 0 to height |
| + 2, 3 | its flag, x, y | the same |
| + 4, 5 | carries the opponents' flag, captures | 0, 1; 0 to ``max_score`` |
| 9 V + 12 | time | 0 to ``max_time_s`` |
"""

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray

from mctf.rules import Rules
from mctf.state import CAPTURES, State
from mctf.view import View


def seen_from_above(state: State, b: int, view: View, rules: Rules) -> NDArray[np.float32]:
    """Returns (9 V + 13,) float32 numbers of game ``b``, scaled and cut as observations are."""
    vehicles = np.column_stack(
        [
            state.pos[b],
            state.heading[b],
            state.speed[b],
            state.has_flag[b],
            state.on_own_side[b],
            state.oob[b],
            state.cooldown[b],
            state.is_tagged[b],
        ]
    )
    homes = np.array([rules.blue_home_m, rules.red_home_m])
    teams = np.column_stack([homes, state.flag_pos[b], state.pickup[b], state.score[b, :, CAPTURES]])
    numbers = np.concatenate([vehicles.ravel(), teams.ravel(), state.time[b : b + 1]])
    if view.normalised:
        low, high = _ranges(rules)
        numbers = (2.0 * numbers - high - low) / (high - low)
        if rules.obs_clipped:
            numbers = np.clip(numbers, -1.0, 1.0)
    return numbers.astype(np.float32)


def state_space(view: View, rules: Rules) -> Box:
    """Returns the space of ``seen_from_above``."""
    return _box(9 * (rules.blue_size + rules.red_size) + 13, view, rules)


def observation_space(view: View, rules: Rules) -> Box:
    """Returns the space of an observation."""
    return _box(view.scale.shape[1], view, rules)


def action_space(view: View, rules: Rules) -> Box | Discrete:
    """Returns the space of an action."""
    if view.continuous:
        return Box(np.array([0.0, -180.0], np.float32), np.array([rules.max_speed, 180.0], np.float32))
    return Discrete(view.actions)


def _box(size: int, view: View, rules: Rules) -> Box:
    """Returns a space of vectors; it has bounds only where what is outside is cut."""
    bound = 1.0 if view.normalised and rules.obs_clipped else np.inf
    return Box(-bound, bound, (size,), np.float32)


def _ranges(rules: Rules) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    place, yes = [(0.0, rules.width_m), (0.0, rules.height_m)], (0.0, 1.0)
    vehicle = [*place, (-180.0, 180.0), (0.0, rules.max_speed), yes, yes, yes, (0.0, rules.tagging_cooldown_s), yes]
    team = [*place, *place, yes, (0.0, float(rules.max_score))]
    both = [*vehicle * (rules.blue_size + rules.red_size), *team * 2, (0.0, rules.max_time_s)]
    low, high = np.array(both).T
    return low, high
