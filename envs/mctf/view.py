"""How learners act and what they see: the kinds of actions and observations of the environment and the batch."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.commands import FIELD_POINTS
from mctf.observe import ranges
from mctf.rules import ACTIONS, Rules
from mctf.words import check_word

ACTION_KINDS = ("discrete", "continuous", "field_points")
OBSERVATION_KINDS = ("normalised", "raw")


class View(NamedTuple):
    """How learners act and what they see.

    Attributes:
        continuous: actions are pairs of a speed in m/s and a turn in deg; else whole numbers.
        actions: how many whole numbers there are; 0 if ``continuous``.
        first_action: what action 0 is to ``commands.command``.
        normalised: observations are scaled to their ranges; else they are in units.
        scale: (2, O) float32 as of ``observe.ranges``.
    """

    continuous: bool
    actions: int
    first_action: int
    normalised: bool
    scale: NDArray[np.float32]


def make_view(actions: str, observations: str, rules: Rules) -> View:
    """Returns how learners act and see.

    Args:
        actions: of ``ACTION_KINDS``.
        observations: of ``OBSERVATION_KINDS``.
        rules: the games' constants.

    Raises:
        ValueError: there is no such kind.
    """
    check_word("actions", actions, ACTION_KINDS)
    check_word("observations", observations, OBSERVATION_KINDS)
    continuous, to_points = actions == "continuous", actions == "field_points"
    return View(
        continuous=continuous,
        actions=0 if continuous else len(FIELD_POINTS) if to_points else ACTIONS,
        first_action=ACTIONS if to_points else 0,
        normalised=observations == "normalised",
        scale=ranges(rules),
    )


def limits(rules: Rules) -> tuple[float, float]:
    """Returns the highest speed in m/s and the largest turn in deg of a continuous action.

    The speed is the larger of ``max_speed`` and of what single precision makes of it, in which spaces are.
    """
    return max(rules.max_speed, float(np.float32(rules.max_speed))), 180.0


def allowed_action(view: View, rules: Rules) -> str:
    """Returns what an action must be, in words."""
    if view.continuous:
        return f"a speed in [0, {rules.max_speed:g}] m/s and a turn in [-180, 180] deg"
    return f"a whole number 0..{view.actions - 1}"


def is_allowed(action: Any, view: View, rules: Rules) -> bool:
    """Returns whether one vehicle's action is what ``allowed_action`` says, whatever it may be."""
    try:
        given = np.asarray(action)
    except ValueError:  # a list of lists of different lengths
        return False
    if not view.continuous:
        return given.shape == () and given.dtype.kind in "iu" and bool(0 <= given < view.actions)
    fastest, sharpest = limits(rules)
    if given.shape != (2,) or given.dtype.kind not in "fiu":
        return False
    return bool(0.0 <= given[0] <= fastest and abs(given[1]) <= sharpest)
