"""Rewards of one step, for every vehicle of a game: what happened, counted in terms, times the weights of a reward.

What is new is so against the state before the step; by the rules' starts nothing can be new in the first one. There
nobody comes nearer either, as in the original.
"""

import math
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numba import cfunc, njit, types
from numpy.typing import NDArray

from mctf.compiled import kernel, part
from mctf.geometry import apart, home, team_of
from mctf.kernel import RUNNING, TIME_OUT, finished, lead
from mctf.rules import BLUE, Rules
from mctf.shaping import Shaping, gained, make_shaping, share
from mctf.state import State
from mctf.words import did_you_mean

TERMS = (
    "team_captured",  # the team captured in this step
    "opponents_captured",
    "team_grabbed",  # the team holds the flag since this step
    "opponents_grabbed",
    "grabbed",  # this vehicle holds it since this step
    "dropped",  # it has lost the flag that it carried, other than by a capture
    "carries",
    "newly_tagged",  # it has been tagged
    "tagged",  # it is tagged, in every step that it lasts
    "tagged_carrier",  # the same if it carried the flag the step before
    "tags",  # it tagged an opponent
    "tags_carrier",  # who carried the flag the step before
    "wall_hit",  # it hit a wall in the last sub-step, or is out of bounds
    "nearer_m",  # how much nearer it came to the opponents' flag's home, a carrier to its own
    "won",  # the game is over since this step, and the team has won; on time, too: more captures win
    "lost",
    "drawn",
    "step",  # one step, whatever happened: below 0, time costs something
)
"""What a reward is made of: counts of this step, and ``nearer_m`` in m."""
(
    TEAM_CAPTURED,
    OPPONENTS_CAPTURED,
    TEAM_GRABBED,
    OPPONENTS_GRABBED,
    GRABBED,
    DROPPED,
    CARRIES,
    NEWLY_TAGGED,
    TAGGED,
    TAGGED_CARRIER,
    TAGS,
    TAGS_CARRIER,
    WALL_HIT,
    NEARER,
    WON,
    LOST,
    DRAWN,
    STEP,
) = range(len(TERMS))

WEIGHTS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "custom_rew2": MappingProxyType(
            {
                "team_captured": 1.0,
                "opponents_captured": -1.0,
                "opponents_grabbed": -1.0,
                "grabbed": 1.0,
                "dropped": -1.0,
                "newly_tagged": -0.05,
                "tags": 0.05,
                "tags_carrier": 1.0,
                "wall_hit": -1.0,
            }
        ),
        "custom_rew": MappingProxyType({}),
        "sparse": MappingProxyType(
            {
                "team_captured": 100.0,
                "opponents_captured": -100.0,
                "team_grabbed": 50.0,
                "opponents_grabbed": -50.0,
                "tagged": -50.0,
                "tagged_carrier": -50.0,
                "tags": 100.0,
                "tags_carrier": -50.0,  # less for a carrier, as in the original
                "wall_hit": -100.0,
            }
        ),
        "outcome": MappingProxyType({"won": 1.0, "lost": -1.0}),
    }
)
"""The rewards by name; ``custom_rew2`` trained the paper's agents, and ``custom_rew`` is ``progress``."""

OWN_SIGNATURE = types.float64(*(types.Array(types.float64, 1, "C"),) * 3)


class Reward(NamedTuple):
    """How a step is paid: ``weights`` times terms, plus ``own(terms, before, after)`` if ``has_own``, then shaped.

    Attributes:
        weights: (len(TERMS),).
        has_own: whether ``own`` is called.
        own: compiled; takes (len(TERMS),), and (O,) twice: the unnormalised observation before and after the step.
        shaping: what is added, and how the team shares.
        factors: (V, len(TERMS)) by what the weights are multiplied for each vehicle; none, (0, 0), for all alike.
        ends_on_time: whether a weight pays the result. Then it is all over for learners when time is up: nothing tells
            them the time, so with the value of what would follow they would be paid the result again and again.
    """

    weights: NDArray[np.float64]
    has_own: bool
    own: Any
    shaping: Shaping
    factors: NDArray[np.float64] = np.zeros((0, 0))
    ends_on_time: bool = False


def progress(terms: NDArray[np.float64], before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Returns 10 for a capture of the team, else what it is worth to come nearer to the goal; nothing while tagged.

    The goal is the opponents' flag home, and the own one for a carrier. This is ``custom_rew``.
    """
    if terms[TAGGED] > 0.0:
        return 0.0
    if terms[TEAM_CAPTURED] > 0.0:
        return 10.0
    if terms[CARRIES] > 0.0:
        return 0.1 + min(0.9, 0.9 * terms[NEARER] / 5.0)
    return min(0.1, 0.1 * terms[NEARER] / 5.0)


def nothing(terms: NDArray[np.float64], before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Returns 0."""
    return 0.0


def make_reward(
    reward: str | Callable[..., float] = "custom_rew2",
    weights: Mapping[str, float | None] | None = None,
    shaping: Mapping[str, float] | None = None,
) -> Reward:
    """Returns a reward.

    Args:
        reward: a name of ``WEIGHTS``, or a function of one's own, or where to import it: ``module:function``. It is
            called as ``own(terms, before, after)`` for every vehicle and step and is compiled, so it must be of
            numbers and numpy only. A call that fails is worth NaN, which whoever plays the game must not accept.
        weights: of terms, by their names in ``TERMS``, in place of the reward's; 0 switches a term off, None leaves it.
        shaping: attributes of ``shaping.Shaping``; what is not given is its default, which changes nothing.

    Raises:
        ValueError: there is no such reward, term or attribute, or the function cannot be compiled.
    """
    given = {term: weight for term, weight in (weights or {}).items() if weight is not None}
    for term, weight in given.items():
        if term not in TERMS:
            raise ValueError(f"reward_weights must be of {TERMS}, but has {term!r}.{did_you_mean(term, TERMS)}")
        if isinstance(weight, bool) or not isinstance(weight, int | float | np.number) or not math.isfinite(weight):
            raise ValueError(f"reward_weights[{term!r}] must be a finite number, but is {weight!r}.")
    named = WEIGHTS.get(reward, {}) if isinstance(reward, str) else {}
    numbers, shaped = np.array([given.get(term, named.get(term, 0.0)) for term in TERMS]), make_shaping(shaping)
    ends = bool(numbers[[WON, LOST, DRAWN]].any())
    if isinstance(reward, str) and reward in WEIGHTS:
        own = progress if reward == "custom_rew" else nothing
        compiled = cfunc(OWN_SIGNATURE, nogil=True, cache=True)(own)
        return Reward(numbers, own is progress, compiled, shaped, ends_on_time=ends)
    own = _imported(reward) if isinstance(reward, str) else reward
    if not callable(own):
        raise ValueError(f"reward must be one of {tuple(WEIGHTS)}, a function or module:function, but is {reward!r}.")
    return Reward(numbers, True, _compiled(own), shaped, ends_on_time=ends)


@cache
def _compiled(own: Callable[..., float]) -> Any:
    """Returns a function as machine code that gives NaN where it fails."""
    try:
        checked = njit(nogil=True, boundscheck=True)(own)

        def guarded(terms, before, after):  # type: ignore[no-untyped-def]
            try:
                return np.float64(checked(terms, before, after))
            except Exception:
                return np.nan

        return cfunc(OWN_SIGNATURE, nogil=True)(guarded)
    except Exception as error:  # Numba raises many kinds, for anything that a user may write
        said = [line for line in str(error).splitlines() if line.strip() and not line.startswith(("Failed", "During"))]
        name = getattr(own, "__qualname__", repr(own))
        raise ValueError(
            f"reward must be a function(terms, before, after) of numbers that Numba compiles, but {name} is not: "
            f"{said[0].strip() if said else error}"
        ) from error


def _imported(path: str) -> Callable[..., float]:
    module, colon, name = path.partition(":")
    if not colon:
        raise ValueError(
            f"reward must be one of {tuple(WEIGHTS)} or module:function, but is {path!r}.{did_you_mean(path, WEIGHTS)}"
        )
    try:
        found = getattr(import_module(module), name)
    except Exception as error:  # whatever the user's module does
        raise ValueError(
            f"reward must be importable, but {path!r} is not: {type(error).__name__}: {error}. "
            "The command looks for modules in the current folder, too."
        ) from error
    if not callable(found):
        raise ValueError(f"reward must be a function, but {path!r} is {found!r}.")
    return found


@kernel
def rewards(
    reward: Reward,
    state: State,
    b: int,
    rules: Rules,
    before: np.ndarray,
    after: np.ndarray,
    terms: np.ndarray,
    out: np.ndarray,
) -> None:
    """Writes the reward of every vehicle for the last step of game ``b``.

    Args:
        reward: as of ``make_reward``.
        state: after the step; not changed.
        b: game.
        rules: the game's constants.
        before: (V, O) unnormalised observations before the step.
        after: (V, O) after it.
        terms: (len(TERMS),) scratch.
        out: (V,) float64, overwritten.
    """
    end = finished(state, b, rules)
    for v in range(rules.blue_size + rules.red_size):
        happened(state, b, v, end, rules, terms)
        total = 0.0
        for term in range(len(TERMS)):
            total += weight_of(reward, v, term) * terms[term]
        if reward.has_own:
            total += reward.own(terms, before[v], after[v])
        if reward.shaping.potential != 0.0:
            total += reward.shaping.potential * gained(state, b, v, is_over(end, reward), reward.shaping, rules)
        out[v] = total
    if reward.shaping.team_share != 0.0:
        share(out, reward.shaping.team_share, rules)


@part
def is_over(end: int, reward: Reward) -> bool:
    """Returns whether nothing follows for learners in a game that stands as ``end`` says, as of ``finished``."""
    return end != RUNNING and (end != TIME_OUT or reward.ends_on_time)


@part
def weight_of(reward: Reward, v: int, term: int) -> float:
    """Returns the weight of a term for vehicle ``v``."""
    weight = reward.weights[term]
    return weight * reward.factors[v, term] if reward.factors.shape[1] > 0 else weight


@part
def happened(state: State, b: int, v: int, end: int, rules: Rules, out: np.ndarray) -> None:
    """Writes the terms of vehicle ``v`` to ``out``; ``end`` is as of ``finished``."""
    us = team_of(v, rules)
    them = 1 - us
    carries = state.has_flag[b, v]
    carried = state.was_carrying[b, v]
    tagged = state.is_tagged[b, v]
    target = state.tagged_opponent[b, v]
    out[TEAM_CAPTURED] = state.capture[b, us] and not state.was_capture[b, us]
    out[OPPONENTS_CAPTURED] = state.capture[b, them] and not state.was_capture[b, them]
    out[TEAM_GRABBED] = state.pickup[b, us] and not state.was_pickup[b, us]
    out[OPPONENTS_GRABBED] = state.pickup[b, them] and not state.was_pickup[b, them]
    out[GRABBED] = carries and not carried
    out[DROPPED] = carried and not carries and not state.capture[b, us]
    out[CARRIES] = carries
    out[NEWLY_TAGGED] = tagged and not state.was_tagged[b, v]
    out[TAGGED] = tagged
    out[TAGGED_CARRIER] = tagged and carried
    out[TAGS] = target >= 0
    out[TAGS_CARRIER] = 0.0
    if target >= 0:
        out[TAGS_CARRIER] = state.was_carrying[b, target]
    out[WALL_HIT] = state.oob[b, v]
    out[NEARER] = 0.0
    if state.steps[b] > 1:
        goal_x, goal_y = home(us if carries else them, rules)
        out[NEARER] = apart(state.was_pos[b, v, 0], state.was_pos[b, v, 1], goal_x, goal_y)
        out[NEARER] -= apart(state.pos[b, v, 0], state.pos[b, v, 1], goal_x, goal_y)
    ahead = lead(state, b, end) * (1 if us == BLUE else -1)
    out[WON] = end != RUNNING and ahead > 0
    out[LOST] = end != RUNNING and ahead < 0
    out[DRAWN] = end != RUNNING and ahead == 0
    out[STEP] = 1.0
