"""What a reward may have beside its terms: a potential that shows the way, and a share of what the team earns.

A potential phi of the state pays ``weight * (discount * phi(after) - phi(before))``. Summed over a game with the
learner's own discount all but the first and the last phi cancel, so the order of policies stays what it is (Ng, Harada
and Russell, Policy invariance under reward transformations, ICML 1999). Where the rules end a game nothing follows, and
phi is 0; where its time is up, learners go on with the value of what would follow, and phi stays, unless the reward
pays the result and so ends there.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mctf.compiled import part
from mctf.geometry import apart, home, team_of, vehicles_of
from mctf.rules import BLUE, RED, Rules
from mctf.state import State
from mctf.words import did_you_mean


class Shaping(NamedTuple):
    """What is added to a reward; by default nothing.

    Attributes:
        potential: weight of the potential, >= 0.
        potential_discount: per step, in [0, 1]; that of the learner.
        potential_tagged: phi while tagged, in [-1, 1].
        team_share: in [0, 1], of a vehicle's reward that is the mean of its team's.
    """

    potential: float = 0.0
    potential_discount: float = 0.99
    potential_tagged: float = 0.0
    team_share: float = 0.0


BOUNDS = {
    "potential": (0.0, math.inf),
    "potential_discount": (0.0, 1.0),
    "potential_tagged": (-1.0, 1.0),
    "team_share": (0.0, 1.0),
}


def make_shaping(given: Mapping[str, Any] | None = None) -> Shaping:
    """Returns what is added to a reward.

    Args:
        given: attributes of ``Shaping`` by name.

    Raises:
        ValueError: there is no such attribute, or it is out of its bounds.
    """
    for name, value in (given or {}).items():
        if name not in BOUNDS:
            raise ValueError(f"shaping must be of {tuple(BOUNDS)}, but has {name!r}.{did_you_mean(name, BOUNDS)}")
        low, high = BOUNDS[name]
        number = not isinstance(value, bool) and isinstance(value, int | float | np.number) and math.isfinite(value)
        if not number or not low <= value <= high:
            allowed = f"in [{low:g}, {high:g}]" if high < math.inf else f">= {low:g}"
            raise ValueError(f"{name} must be a finite number {allowed}, but is {value!r}.")
    return Shaping(**{name: float(value) for name, value in (given or {}).items()})


@part
def gained(state: State, b: int, v: int, over: bool, shaping: Shaping, rules: Rules) -> float:
    """Returns what vehicle ``v`` gained in potential by the last step; ``over`` says whether nothing follows it."""
    us = team_of(v, rules)
    was_tagged, was_carrying = state.was_tagged[b, v], state.was_carrying[b, v]
    before = phi(state.was_pos[b, v, 0], state.was_pos[b, v, 1], was_tagged, was_carrying, us, shaping, rules)
    after = 0.0
    if not over:
        tagged, carries = state.is_tagged[b, v], state.has_flag[b, v]
        after = phi(state.pos[b, v, 0], state.pos[b, v, 1], tagged, carries, us, shaping, rules)
    return shaping.potential_discount * after - before


@part
def phi(x: float, y: float, tagged: bool, carries: bool, us: int, shaping: Shaping, rules: Rules) -> float:
    """Returns the potential of a vehicle of team ``us`` at (x, y) m, in [-1, 1].

    Minus the distance to the opponents' flag home over the field's diagonal; for a carrier 1 minus that to its own.
    """
    if tagged:
        return shaping.potential_tagged
    goal_x, goal_y = home(us if carries else 1 - us, rules)
    far = apart(x, y, goal_x, goal_y) / math.sqrt(rules.width_m * rules.width_m + rules.height_m * rules.height_m)
    return 1.0 - far if carries else -far


@part
def share(paid: np.ndarray, part_of_team: float, rules: Rules) -> None:
    """Replaces so large a part, in [0, 1], of what each vehicle is ``paid`` (V,) by the mean of its team."""
    for team in (BLUE, RED):
        first, last = vehicles_of(team, rules)
        total = 0.0
        for v in range(first, last):
            total += paid[v]
        for v in range(first, last):
            paid[v] = (1.0 - part_of_team) * paid[v] + part_of_team * (total / (last - first))
