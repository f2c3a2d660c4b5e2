"""A whole game as frames and events, played again from its actions; what pictures are drawn from."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mctf import geometry
from mctf.commands import FIELD_POINTS, MISSING
from mctf.kernel import BLUE_WON, RED_WON, RUNNING, TIED, finished, step
from mctf.observe import observation_size, observe
from mctf.rules import ACTIONS, Rules
from mctf.scripted import NAMES, act
from mctf.start import reset
from mctf.state import (
    CAPTURED,
    CAPTURES,
    GRABBED,
    HIT_WALL,
    LOST_BY_TAG,
    LOST_BY_WALL,
    UNTAGGED,
    WAS_TAGGED,
    Bools,
    Floats,
    Ints,
    State,
    empty,
)

TEAM_NAMES = ("blue", "red")
"""By the teams' numbers."""
KINDS = {
    "wall": "{} hits the wall",
    "lost_by_wall": "{} loses the flag at the wall",
    "wall_tag": "{} is tagged for leaving the field",
    "grab": "{} grabs the flag",
    "tag": "{} tags {}",
    "lost_by_tag": "{} loses the flag to {}",
    "capture": "{} captures the flag",
    "untag": "{} is free again",
}
"""Kinds of events in the order in which a step has them, and how they are told."""


class Event(NamedTuple):
    """Something a vehicle did.

    Attributes:
        frame: of the film, the first in which it is done.
        kind: of ``KINDS``.
        vehicle: who.
        other: whom it tagged, or who tagged it; -1 where nobody else has a part.
    """

    frame: int
    kind: str
    vehicle: int
    other: int


class Film(NamedTuple):
    """One game of T steps as F = T + 1 frames, the start first; fields called as in ``State`` are the same there.

    Attributes:
        pos: (F, V, 2) m.
        heading: (F, V) deg clockwise from north.
        has_flag: (F, V).
        on_own_side: (F, V) as the rules tested it.
        is_tagged: (F, V).
        cooldown: (F, V) s.
        flag_pos: (F, 2, 2) m.
        score: (F, 2, 3) captures, tags, grabs of the team.
        time: (F,) s.
        events: in order.
        rules: of the game.
        end: as of ``kernel.finished``; RUNNING if the actions end before the game.
    """

    pos: Floats
    heading: Floats
    has_flag: Bools
    on_own_side: Bools
    is_tagged: Bools
    cooldown: Floats
    flag_pos: Floats
    score: Ints
    time: Floats
    events: tuple[Event, ...]
    rules: Rules
    end: int


ARRAYS = Film._fields[:9]


# Compiled parts cannot be called from Python; these are the functions that they were compiled from
team_of = geometry.team_of.py_func
home = geometry.home.py_func
is_right = geometry.is_right.py_func


def number_of(vehicle: int, rules: Rules) -> int:
    """Returns a vehicle's number in its team."""
    return vehicle if vehicle < rules.blue_size else vehicle - rules.blue_size


def called(vehicle: int, rules: Rules) -> str:
    """Returns a vehicle's team and its number in it, such as "red 1"."""
    return f"{TEAM_NAMES[team_of(vehicle, rules)]} {number_of(vehicle, rules)}"


def said(event: Event, rules: Rules) -> str:
    """Returns an event in words, such as "blue 0 tags red 1"."""
    other = called(event.other, rules) if event.other >= 0 else ""
    return KINDS[event.kind].format(called(event.vehicle, rules), other)


def filmed(actions: ArrayLike, rules: Rules, seed: int = 0) -> Film:
    """Plays a game again and returns it as a film; the same actions give the same game to the bit.

    Args:
        actions: (T, V) whole numbers, as of ``commands.command``.
        rules: the game's constants.
        seed: of the game's stream, in [0, 2**64); where the start is drawn it comes from there.

    Raises:
        ValueError: the actions are not of that form, or go on when the game is over.
    """
    played = _checked(actions, rules)
    state = empty(1, rules)
    state.stream[0] = seed
    reset(state, 0, rules)
    shots, events = [_shot(state)], []
    for number, row in enumerate(played, start=1):
        if finished(state, 0, rules) != RUNNING:
            raise ValueError(f"actions has {len(played)} rows, but the game is over after {number - 1} steps.")
        before = state.events[0].copy()
        step(state, 0, row, rules)
        shots.append(_shot(state))
        events += _events(number, state.events[0] - before, state.tagged_opponent[0])
    arrays = (np.stack(column) for column in zip(*shots, strict=True))
    return Film._make((*arrays, tuple(events), rules, finished(state, 0, rules)))


def film_of_policies(policies: Sequence[int], rules: Rules, seed: int = 0) -> Film:
    """Returns a whole game between fixed policies: the one that ``play.play_scripted`` plays with this seed.

    Args:
        policies: (V,) places in ``scripted.NAMES``, blue first.
        rules: the game's constants.
        seed: of the game's stream.

    Raises:
        ValueError: there are not as many policies as vehicles, or one does not exist.
    """
    vehicles = rules.blue_size + rules.red_size
    if len(policies) != vehicles:
        raise ValueError(f"policies must be {vehicles}, one for each vehicle, but are {len(policies)}.")
    if not all(0 <= policy < len(NAMES) for policy in policies):
        raise ValueError(f"policies must be 0..{len(NAMES) - 1}, but are {list(policies)}.")
    state = empty(1, rules)
    state.stream[0] = seed
    reset(state, 0, rules)
    seen, actions = np.zeros((vehicles, observation_size(rules))), []
    while finished(state, 0, rules) == RUNNING:
        observe(state, 0, rules, seen)
        actions.append([act(policy, state, 0, v, seen[v], rules) for v, policy in enumerate(policies)])
        step(state, 0, np.array(actions[-1]), rules)
    return filmed(actions, rules, seed)


def result(film: Film) -> str:
    """Returns what became of a game that is over, in words; on time more captures win."""
    gap = int(np.subtract(*film.score[-1, :, CAPTURES]))
    on_time = "It is a draw" if gap == 0 else f"{'Blue' if gap > 0 else 'Red'} wins"
    # Both may have all the captures there are to make, and the rules then say whose the game is.
    return {BLUE_WON: "Blue wins", RED_WON: "Red wins", TIED: "It is a draw"}.get(film.end, on_time)


def _checked(actions: ArrayLike, rules: Rules) -> NDArray[np.int64]:
    given = np.asarray(actions)
    vehicles, highest = rules.blue_size + rules.red_size, ACTIONS + len(FIELD_POINTS) - 1
    if given.ndim != 2 or given.shape[1] != vehicles or given.dtype.kind not in "iu":
        raise ValueError(
            f"actions must be whole numbers of shape (steps, {vehicles}), but has {given.shape} of {given.dtype}."
        )
    if given.size and not (given.min() >= MISSING and given.max() <= highest):
        raise ValueError(f"actions must be {MISSING}..{highest}, but is {given.min()}..{given.max()}.")
    return np.ascontiguousarray(given, dtype=np.int64)


def _shot(state: State) -> tuple[NDArray[Any], ...]:
    return tuple(getattr(state, name)[0].copy() for name in ARRAYS)


def _events(frame: int, counted: Ints, tagged: Ints) -> list[Event]:
    """Returns what happened in the step before ``frame``.

    Args:
        frame: of the film.
        counted: (V, events) what the step added to ``State.events``; changed.
        tagged: (V,) whom each vehicle tagged, -1 for nobody.
    """
    tagger = {int(target): v for v, target in enumerate(tagged) if target >= 0}
    tags = [Event(frame, "tag", v, target) for target, v in sorted(tagger.items(), key=lambda pair: pair[1])]

    counted[list(tagger), WAS_TAGGED] -= 1  # what is left was done by the wall

    def counted_as(kind: str, column: int) -> list[Event]:
        return [Event(frame, kind, int(v), -1) for v in np.flatnonzero(counted[:, column])]

    lost = [event._replace(other=tagger[event.vehicle]) for event in counted_as("lost_by_tag", LOST_BY_TAG)]
    return [
        *counted_as("wall", HIT_WALL),
        *counted_as("lost_by_wall", LOST_BY_WALL),
        *counted_as("wall_tag", WAS_TAGGED),
        *counted_as("grab", GRABBED),
        *tags,
        *lost,
        *counted_as("capture", CAPTURED),
        *counted_as("untag", UNTAGGED),
    ]
