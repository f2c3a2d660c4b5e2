"""Replays recorded games of the original: ``python -m mctf.check FILE.npz ...``.

Each recorded state is put into the kernel, one step is played with the recorded actions, and the result is
compared with the next recorded state. The fixed policies must choose the recorded actions. An episode must
start as ``reset`` starts it. Exit status: 0 all equal, 1 something differs, 2 a file cannot be read.
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.compiled import kernel
from mctf.kernel import TIME_OUT, finished, step
from mctf.observe import OTHER, OWN, normalise, observation_size, observe
from mctf.recording import OF_TEAMS, STATE, Recording, TraceError, read
from mctf.rewards import CUSTOM_REW2, rewards
from mctf.rules import Rules
from mctf.scripted import NAMES, RANDOM, act
from mctf.state import State, empty, reset

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
"""How far apart the numbers of a field may be; all other fields must be equal."""
SHOWN = 5
"""Mismatches printed for each file."""


class Mismatch(NamedTuple):
    """A number that is not as recorded; ``where`` are the other indices of the field, vehicle or team first."""

    row: int
    field: str
    where: tuple[int, ...]
    recorded: float
    computed: float


class Report(NamedTuple):
    """What a check found: rows played, policies' actions chosen, the largest difference of each field."""

    rows: int
    choices: int
    worst: dict[str, float]
    mismatches: list[Mismatch]


def check(path: Path) -> Report:
    """Replays a file of recorded games.

    Raises:
        TraceError: the file cannot be read as recorded games.
    """
    recording = read(path)
    report = Report(0, 0, {}, [])
    for episode in range(len(recording.starts)):
        rows = recording.rows(episode)
        report = _with_episode(report, recording, rows, recording.rules[episode])
    return report


def _with_episode(report: Report, recording: Recording, rows: slice, rules: Rules) -> Report:
    recorded = {name: array[rows] for name, array in recording.arrays.items()}
    length, vehicles = recorded["action"].shape
    state = empty(length + 1, rules.team_size)  # one more: the start
    for name in STATE:
        getattr(state, name)[:-1] = recorded[name]
    state.steps[:-1] = np.arange(length)
    reset(state, length, rules)
    policies = _policies(recorded["policy"], recording.meta["policies"])

    seen = np.zeros((length + 1, vehicles, observation_size(rules.team_size)), np.float32)
    chosen = np.full((length, vehicles), -1)
    earned = np.zeros((length + 1, vehicles))
    ends = np.zeros(length + 1, np.int64)
    raw = np.zeros(seen.shape[-1])
    replay(state, recorded["action"].astype(np.int64), policies, rules, raw, seen, chosen, earned, ends)

    # Row r was stepped to row r + 1; the last row has no successor, and the start stands behind it
    order = np.concatenate([[length], np.arange(length - 1)])
    computed = {name: getattr(state, name)[order] for name in STATE}
    computed |= {"obs": seen[order], "reward": earned[order]}
    over = ends[order]
    computed |= {"terminated": (over != 0) & (over != TIME_OUT), "truncated": over == TIME_OUT}
    computed["action"] = np.where(chosen >= 0, chosen, recorded["action"])
    computed["action"][-1] = -1

    worst, mismatches = dict(report.worst), list(report.mismatches)
    for name, values in computed.items():
        apart, allowed = _apart(name, values, recorded[name]), TOLERANCE.get(name, 0.0)
        worst[name] = max(worst.get(name, 0.0), float(apart.max(initial=0.0)))
        for index in map(tuple, np.argwhere(~(apart <= allowed)).tolist()):
            row, *where = index
            found = Mismatch(rows.start + row, name, tuple(where), float(recorded[name][index]), float(values[index]))
            mismatches.append(found)
    return Report(report.rows + length - 1, report.choices + int((chosen[:-1] >= 0).sum()), worst, mismatches)


def _policies(recorded: NDArray[np.int8], names: list[str]) -> NDArray[np.int64]:
    """Returns (V,) the places in ``scripted.NAMES`` of the vehicles' policies, -1 for what cannot be foretold."""
    known = [NAMES.index(name) if name in NAMES and name != NAMES[RANDOM] else -1 for name in names]
    return np.array([known[i] for i in recorded[0]], np.int64)


def _apart(name: str, computed: NDArray, recorded: NDArray) -> NDArray[np.float64]:
    """Returns the differences of a field; NaN counts as infinitely far."""
    apart = np.abs(np.asarray(computed, np.float64) - np.asarray(recorded, np.float64))
    if name == "heading":
        apart = np.minimum(apart, np.abs(360.0 - apart))
    if name == "obs":
        bearings = [*range(0, 14, 2), *range(OWN, apart.shape[-1], OTHER), *range(OWN + 2, apart.shape[-1], OTHER)]
        apart[..., bearings] = np.minimum(apart[..., bearings], np.abs(2.0 - apart[..., bearings]))
    return np.where(np.isnan(apart), np.inf, apart)


@kernel
def replay(
    state: State,
    actions: np.ndarray,
    policies: np.ndarray,
    rules: Rules,
    raw: np.ndarray,
    seen: np.ndarray,
    chosen: np.ndarray,
    earned: np.ndarray,
    ends: np.ndarray,
) -> None:
    """Plays one step from each of L states that are rows of a recorded episode, but for the last.

    Args:
        state: L + 1 games, changed; the last is the start, of which only the observation is wanted.
        actions: (L, V) recorded.
        policies: (V,) places in ``scripted.NAMES``, -1 for others.
        rules: the games' constants.
        raw: (13 + 16 n,) scratch.
        seen: (L + 1, V, 13 + 16 n) float32, observations after the step.
        chosen: (L, V) actions of the fixed policies before the step.
        earned: (L + 1, V) rewards.
        ends: (L + 1,) as of ``finished``.
    """
    length = len(actions)
    for row in range(length + 1):
        if row < length - 1:
            for v in range(actions.shape[1]):
                if policies[v] >= 0:
                    observe(state, row, v, rules, raw)
                    chosen[row, v] = act(policies[v], raw, rules, 0.0)
            step(state, row, actions[row], rules)
            rewards(CUSTOM_REW2, state, row, rules, earned[row])
        for v in range(actions.shape[1]):
            observe(state, row, v, rules, raw)
            normalise(raw, rules, seen[row, v])
        ends[row] = finished(state, row, rules)


def _described(found: Mismatch) -> str:
    names = ("agent" if found.field not in OF_TEAMS else "team", "number", "number")
    where = "".join(f", {name} {i}" for name, i in zip(names, found.where, strict=False))
    return (
        f"  row {found.row}{where}, field {found.field}: recorded {found.recorded:.12g}, computed {found.computed:.12g}"
    )


def main(paths: list[str]) -> int:
    """Checks files, prints what was found and returns the exit status."""
    if not paths:
        print("Give the files with recorded games: python -m mctf.check FILE.npz ...")
        return 2
    status = 0
    for path in paths:
        try:
            report = check(Path(path))
        except TraceError as error:
            print(f"{path}: {error}")
            status = 2
            continue
        print(f"{path}: {report.rows} rows, {report.choices} actions of fixed policies, {_verdict(report)}")
        print("  largest difference: " + ", ".join(f"{name} {report.worst[name]:.2g}" for name in TOLERANCE))
        for found in report.mismatches[:SHOWN]:
            print(_described(found))
        if report.mismatches:
            status = max(status, 1)
    return status


def _verdict(report: Report) -> str:
    fields = len(report.worst) - len(TOLERANCE)
    if not report.mismatches:
        return f"all as recorded; {fields} discrete fields equal"
    return f"{len(report.mismatches)} numbers differ in {sorted({found.field for found in report.mismatches})}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
