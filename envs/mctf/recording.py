"""Reads recorded games of the original, npz files of arrays, and says what is wrong with other files."""

import json
import re
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.rules import ACTIONS, Rules, make_rules

V, T = -1, -2
"""Stand for the numbers of vehicles and of observed values in the shapes below."""
SHAPES: dict[str, tuple[tuple[int, ...], str]] = {
    "pos": ((V, 2), "f"),
    "prev_pos": ((V, 2), "f"),
    "speed": ((V,), "f"),
    "speed_is_f32": ((V,), "b"),
    "heading": ((V,), "f"),
    "thrust": ((V,), "f"),
    "heading_error_prev": ((V,), "f"),
    "has_flag": ((V,), "b"),
    "on_own_side": ((V,), "b"),
    "cooldown": ((V,), "f"),
    "is_tagged": ((V,), "b"),
    "oob": ((V,), "i"),
    "tagged_opponent": ((V,), "i"),
    "flag_pos": ((2, 2), "f"),
    "flag_taken": ((2,), "b"),
    "pickup": ((2,), "b"),
    "capture": ((2,), "b"),
    "score": ((2, 3), "i"),
    "time": ((), "f"),
    "action": ((V,), "i"),
    "reward": ((V,), "f"),
    "obs": ((V, T), "f"),
    "terminated": ((), "b"),
    "truncated": ((), "b"),
    "policy": ((V,), "i"),
    "episode": ((), "i"),
    "episode_step": ((), "i"),
}
"""Shape behind the rows and kind of every array."""
KINDS = {"f": "floating-point numbers", "i": "signed whole numbers", "b": "True and False"}
OF_TEAMS = ("flag_pos", "flag_taken", "pickup", "capture", "score")
"""Arrays with one entry for each team instead of each vehicle."""
STATE = tuple(SHAPES)[:19]
"""Arrays that are fields of ``State`` of the same name."""
NUMBERS = (
    "team_size",
    "sim_speedup_factor",
    "flag_keepout",
    "tau",
    "catch_radius",
    "agent_radius",
    "tagging_cooldown",
    "max_speed",
)
"""Settings that are one number for the whole file."""
TEXTS = ("max_time", "max_score")
"""Settings that are a number, or a text with the numbers that occur in the file."""
DAMAGES = (
    ValueError,
    EOFError,
    KeyError,
    NotImplementedError,
    RuntimeError,
    OverflowError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    tokenize.TokenError,
)
"""What numpy and zipfile raise for bytes that are not those of arrays."""
EXPECTED = "it must be a whole npz file of recorded games, or a csv table of outcomes with a name that ends in .csv."


class TraceError(ValueError):
    """A file does not hold recorded games."""


class Recording(NamedTuple):
    """Recorded games: arrays of all rows, where episodes start and end, names of policies, rules of the episodes."""

    arrays: dict[str, NDArray[Any]]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    policies: list[str]
    rules: list[Rules]

    def first_row(self, episode: int) -> int:
        """Returns the row with the start of an episode."""
        return int(self.starts[episode])

    def of(self, episode: int) -> dict[str, NDArray[Any]]:
        """Returns the rows of an episode, of every array."""
        rows = slice(int(self.starts[episode]), int(self.ends[episode]))
        return {name: array[rows] for name, array in self.arrays.items()}

    def memory(self, episode: int) -> NDArray[np.float64]:
        """Returns (V,) deg, the heading errors that an episode starts with.

        The original forgot them with its environment only: they are those of the row before, if the recording has
        them again, else zero.
        """
        errors, start = self.arrays["heading_error_prev"], self.first_row(episode)
        goes_on = start > 0 and np.array_equal(errors[start], errors[start - 1])
        return errors[start - 1] if goes_on else np.zeros_like(errors[start])


def read(path: Path) -> Recording:
    """Returns the recorded games of a file.

    Raises:
        TraceError: it is not a whole file of recorded games; the message says why in one sentence.
    """
    arrays = _loaded(path)
    missing = [name for name in (*SHAPES, "meta") if name not in arrays]
    if missing:
        raise TraceError(f"lacks the arrays {', '.join(missing)}; {EXPECTED}")
    meta = _meta(arrays.pop("meta"))
    _check_arrays(arrays, 2 * int(meta["team_size"]), len(meta["policies"]))
    starts, ends = _episodes(arrays)
    _check_clock(meta, arrays)
    rules = [_rules(meta, arrays, slice(start, end)) for start, end in zip(starts, ends, strict=True)]
    return Recording(arrays, starts, ends, meta["policies"], rules)


def _loaded(path: Path) -> dict[str, NDArray[Any]]:
    try:
        if path.is_file() and path.stat().st_size == 0:
            raise TraceError(f"is empty; {EXPECTED}")
        archive = np.load(path, allow_pickle=False)
        if isinstance(archive, np.ndarray):
            raise TraceError(f"is one array; {EXPECTED}")
        with archive:
            return {name: archive[name] for name in archive.files}
    except TraceError:
        raise
    except OSError as error:
        raise TraceError(f"cannot be read ({error.strerror or error}); {EXPECTED}") from error
    except DAMAGES as error:
        raise TraceError(f"is no npz archive of arrays, or is cut off or damaged; {EXPECTED}") from error


def _meta(text: NDArray[Any]) -> dict[str, Any]:
    try:
        meta = json.loads(str(text))
        settings: dict[str, Any] = {name: _number(name, meta[name]) for name in NUMBERS}
        settings |= {name: meta[name] if isinstance(meta[name], str) else _number(name, meta[name]) for name in TEXTS}
        settings |= {"world_size": [_number("world_size", extent) for extent in meta["world_size"]]}
        settings |= {"policies": [str(name) for name in meta["policies"]], "reward": meta["reward"]}
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        reason = f"lacks {error}" if isinstance(error, KeyError) else str(error)
        raise TraceError(
            f"has settings (meta) that cannot be read ({reason}); they must be one JSON text with numbers {NUMBERS}, "
            f"{TEXTS}, world_size of two numbers, and policies and reward."
        ) from error
    if settings["reward"] != "custom_rew2" or not (settings["team_size"] >= 1 and settings["team_size"].is_integer()):
        found = f"{settings['reward']!r} and {meta['team_size']!r}"
        raise TraceError(f"has reward and team_size {found}; they must be 'custom_rew2' and a whole number >= 1.")
    return settings


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f"{name} is {value!r}, not a number")
    return float(value)


def _check_arrays(arrays: dict[str, NDArray[Any]], vehicles: int, policies: int) -> None:
    sizes = {V: vehicles, T: 13 + 8 * vehicles}
    rows = arrays["episode"].size
    if rows == 0:
        raise TraceError(f"has no rows; {EXPECTED}")
    for name, (shape, kind) in SHAPES.items():
        wanted = (rows, *(sizes.get(size, size) for size in shape))
        if arrays[name].shape != wanted or arrays[name].dtype.kind != kind:
            found = f"{arrays[name].dtype} of shape {arrays[name].shape}"
            raise TraceError(
                f"has an array {name} of {found}; for the team_size {vehicles // 2} of its settings and {rows} rows "
                f"it must be {KINDS[kind]} of shape {wanted}."
            )
    for name, low, high in (
        ("action", -1, ACTIONS - 1),
        ("policy", 0, policies - 1),
        ("tagged_opponent", -1, vehicles - 1),
        ("heading", -180, 180),  # turning back a larger one would take for ever
    ):
        least, most = arrays[name].min(), arrays[name].max()
        if not (least >= low and most <= high):
            raise TraceError(f"has entries of {name} in {least}..{most}; they must be in {low}..{high}.")


def _episodes(arrays: dict[str, NDArray[Any]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Returns where the episodes start and end; one has a start and at least one step."""
    steps = arrays["episode_step"]
    starts = np.flatnonzero(steps == 0)
    ends = np.append(starts[1:], len(steps))
    if len(starts) == 0 or starts[0] != 0:
        raise TraceError(
            "has no row that starts an episode at its top; episode_step must be 0, 1, ... in each episode."
        )
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        for name, wanted in (
            ("episode_step", np.arange(end - start)),
            ("episode", number),
            ("policy", arrays["policy"][start]),
        ):
            if end - start < 2 or not (arrays[name][start:end] == wanted).all():
                raise TraceError(
                    f"has rows {start} to {end - 1} as episode {number} with {name} out of order; episodes must be "
                    "numbered 0, 1, ... and have rows 0, 1, ..., two at least, with the same policies."
                )
    return starts, ends


def _check_clock(meta: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> None:
    """Refuses settings that make the steps longer or shorter than they were, before that many sub-steps are played."""
    of_step = np.diff(arrays["time"])[arrays["episode_step"][1:] > 0]
    recorded, told = float(np.median(of_step)), meta["sim_speedup_factor"] * meta["tau"]
    if not abs(recorded - told) <= 1e-6 * max(abs(told), 1.0):
        raise TraceError(
            f"has steps of {recorded:g} s in time; its settings must say the same, but sim_speedup_factor times tau "
            f"is {told:g} s."
        )


def _rules(meta: dict[str, Any], arrays: dict[str, NDArray[Any]], rows: slice) -> Rules:
    last = rows.stop - 1
    score = int(arrays["score"][last, :, 0].max()) if arrays["terminated"][last] else None
    try:
        return make_rules(
            team_size=meta["team_size"],
            world_size_m=meta["world_size"],
            flag_keepout_m=meta["flag_keepout"],
            catch_radius_m=meta["catch_radius"],
            agent_radius_m=meta["agent_radius"],
            max_speed=meta["max_speed"],
            tau_s=meta["tau"],
            substeps=meta["sim_speedup_factor"],
            max_time_s=_of_text(
                meta["max_time"], lambda limit: arrays["time"][last - 1] < limit <= arrays["time"][last]
            ),
            max_score=_of_text(meta["max_score"], lambda limit: limit == score),
            tagging_cooldown_s=meta["tagging_cooldown"],
        )
    except ValueError as error:
        raise TraceError(f"has settings (meta) that are not allowed: {error}") from error


def _of_text(setting: float | str, ended: Callable[[float], bool]) -> float:
    """Returns a limit of an episode: of several in a text the one with which it ``ended``, else the largest."""
    if not isinstance(setting, str):
        return setting
    limits = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", setting)]
    if not limits:
        raise ValueError(f"{setting!r} must be a number or a text with numbers.")
    return next(filter(ended, limits), max(limits))
