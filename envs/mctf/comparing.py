"""Compares recorded games with what the kernel makes of them, number by number and episode by episode."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.observe import OTHER, OWN
from mctf.recording import Recording, read
from mctf.replaying import replayed, stepped
from mctf.state import CAPTURES

TOLERANCE = {
    "pos": 1e-6,  # m
    "prev_pos": 1e-6,
    "flag_pos": 1e-6,
    "speed": 1e-6,  # m/s
    "heading": 1e-5,  # deg, modulo 360
    "heading_error_prev": 1e-5,  # deg
    "thrust": 1e-5,
    "cooldown": 1e-9,  # s
    "time": 1e-9,
    "reward": 1e-9,
    "obs": 2e-5,  # bearings modulo 2
}
"""How far apart the numbers of a field may be after one step; all other fields must be equal."""
FROM_START = (
    "pos",
    "has_flag",
    "is_tagged",
    "oob",
    "tagged_opponent",
    "flag_taken",
    "pickup",
    "capture",
    "score",
    "terminated",
    "truncated",
)
"""Fields compared when an episode is played from its start: the way and the events."""
SAME_M = 1e-4
"""m; positions of episodes played from their start are the same up to this."""
FLIP_M = 0.05
"""m; largest difference of positions in an episode with keep-out contact."""
FLIP_SHARE = 0.03
"""Share of the agent-steps of a file's episodes with keep-out contact that may differ.

A frontal contact leaves a velocity of rounding noise, and the controllers have thresholds: from there on an episode
that nobody corrects may be another one.
"""
KEPT = 5
"""Mismatches kept of each field of an episode."""


class Mismatch(NamedTuple):
    """A number that is not as recorded; ``where`` are the other indices of the field, vehicle or team first."""

    row: int
    field: str
    where: tuple[int, ...]
    recorded: float
    computed: float


class Steps(NamedTuple):
    """Steps from recorded states: how many there are, and how many actions of fixed policies.

    Of each field the largest difference, the count of mismatches, and the first of these.
    """

    steps: int
    choices: int
    worst: dict[str, float]
    counts: dict[str, int]
    first: list[Mismatch]


class Episode(NamedTuple):
    """An episode played from its start.

    Attributes:
        first_row: of its recording.
        agent_steps: vehicles times steps.
        contacts: agent-steps with keep-out contact.
        differing: agent-steps whose position is more than ``SAME_M`` away or whose events are others.
        worst_m: largest difference of a position.
        captures: recorded (blue, red) and computed (blue, red) at the end.
        first: the first difference, None if there is none.
        early: whether that is before any contact could be the cause.
    """

    first_row: int
    agent_steps: int
    contacts: int
    differing: int
    worst_m: float
    captures: tuple[tuple[int, int], tuple[int, int]]
    first: Mismatch | None
    early: bool

    @property
    def as_recorded(self) -> bool:
        """Whether it came to its recorded end on the recorded way."""
        return self.first is None or (not self.early and self.worst_m <= FLIP_M)


class Report(NamedTuple):
    """What a check of one file found."""

    steps: Steps
    episodes: list[Episode]

    @property
    def differing_share(self) -> float:
        """Share of agent-steps that differ in the episodes with keep-out contact."""
        touched = [episode for episode in self.episodes if episode.contacts]
        return sum(one.differing for one in touched) / max(sum(one.agent_steps for one in touched), 1)

    @property
    def as_recorded(self) -> bool:
        """Whether the file holds the games that the kernel plays."""
        steps, episodes = not self.steps.first, all(episode.as_recorded for episode in self.episodes)
        return steps and episodes and self.differing_share <= FLIP_SHARE


def check(path: Path) -> Report:
    """Replays a file of recorded games.

    Raises:
        TraceError: the file cannot be read as recorded games.
    """
    recording = read(path)
    report = Report(Steps(0, 0, {}, {}, []), [])
    for episode in range(len(recording.starts)):
        report = _with_episode(report, recording, episode)
    return report


def _with_episode(report: Report, recording: Recording, episode: int) -> Report:
    recorded, first_row = recording.of(episode), recording.first_row(episode)
    computed, choices, kept_out = stepped(recording, episode)
    before = report.steps
    worst, counts, first = dict(before.worst), dict(before.counts), list(before.first)
    for name, values in computed.items():
        apart = _apart(name, values, recorded[name])
        wrong = ~(apart <= TOLERANCE.get(name, 0.0))
        worst[name] = max(worst.get(name, 0.0), float(apart.max(initial=0.0)))
        counts[name] = counts.get(name, 0) + int(wrong.sum())
        first += _mismatches(name, wrong, recorded[name], values, first_row)
    steps = Steps(before.steps + len(kept_out) - 1, before.choices + choices, worst, counts, first)
    free = replayed(recording, episode, FROM_START)
    return Report(steps, [*report.episodes, _compared(recorded, free, kept_out, first_row)])


def _compared(
    recorded: dict[str, NDArray[Any]], computed: dict[str, NDArray[Any]], kept_out: NDArray[np.bool_], first_row: int
) -> Episode:
    """Returns how an episode from its start compares with its recording; ``kept_out`` (L, V) are the contacts."""
    vehicles = kept_out.shape[1]
    differs = np.zeros_like(kept_out)
    found: list[Mismatch] = []
    for name in FROM_START:
        wrong = ~(_apart(name, computed[name], recorded[name]) <= (SAME_M if name == "pos" else 0.0))
        found += _mismatches(name, wrong, recorded[name], computed[name], first_row)
        of_each = wrong.reshape(len(wrong), wrong.shape[1] if wrong.ndim > 1 else 1, -1).any(axis=-1)
        differs |= np.repeat(of_each, vehicles // of_each.shape[1], axis=1)
    first = min(found, key=lambda mismatch: mismatch.row, default=None)
    touched = np.flatnonzero(kept_out.any(axis=1))
    early = first is not None and (len(touched) == 0 or first.row - first_row <= touched[0])
    return Episode(
        first_row=first_row,
        agent_steps=(len(differs) - 1) * vehicles,
        contacts=int(kept_out.sum()),
        differing=int(differs.sum()),
        worst_m=float(_apart("pos", computed["pos"], recorded["pos"]).max()),
        captures=(_captures(recorded), _captures(computed)),
        first=first,
        early=bool(early),
    )


def _captures(fields: dict[str, NDArray[Any]]) -> tuple[int, int]:
    blue, red = fields["score"][-1, :, CAPTURES].tolist()
    return blue, red


def _mismatches(
    name: str, wrong: NDArray[np.bool_], recorded: NDArray[Any], computed: NDArray[Any], first_row: int
) -> list[Mismatch]:
    return [
        Mismatch(first_row + index[0], name, index[1:], float(recorded[index]), float(computed[index]))
        for index in map(tuple, np.argwhere(wrong)[:KEPT].tolist())
    ]


def _apart(name: str, computed: NDArray[Any], recorded: NDArray[Any]) -> NDArray[np.float64]:
    """Returns the differences of a field; NaN counts as infinitely far, and a turn more as none in its range."""
    recorded = np.asarray(recorded, np.float64)
    apart = np.abs(np.asarray(computed, np.float64) - recorded)
    if name == "heading":
        apart = _round(apart, recorded, 360.0)
    if name == "obs":
        bearings = [*range(0, 14, 2), *range(OWN, apart.shape[-1], OTHER), *range(OWN + 2, apart.shape[-1], OTHER)]
        apart[..., bearings] = _round(apart[..., bearings], recorded[..., bearings], 2.0)
    return np.where(np.isnan(apart), np.inf, apart)


def _round(apart: NDArray[np.float64], recorded: NDArray[np.float64], turn: float) -> NDArray[np.float64]:
    """Returns the shorter way between two angles; the recorded one is -half to half a ``turn`` or plainly wrong."""
    return np.where(np.abs(recorded) <= turn / 2.0, np.minimum(apart, np.abs(turn - apart)), apart)
