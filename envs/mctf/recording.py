"""Reads recorded games of the original, npz files of arrays, and says what is wrong with other files."""

import json
import re
import zipfile
import zlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mctf.rules import Rules, make_rules

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
OF_TEAMS = ("flag_pos", "flag_taken", "pickup", "capture", "score")
"""Arrays with one entry for each team instead of each vehicle."""
STATE = tuple(SHAPES)[:19]
"""Arrays that are fields of ``State`` of the same name."""
NUMBERS = (
    "sim_speedup_factor",
    "flag_keepout",
    "tau",
    "catch_radius",
    "agent_radius",
    "tagging_cooldown",
    "max_speed",
)
"""Settings that are one number for the whole file."""


class TraceError(ValueError):
    """A file does not hold recorded games."""


class Recording(NamedTuple):
    """Recorded games: arrays of all rows, where episodes start and end, settings as read and as rules."""

    arrays: dict[str, NDArray]
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    meta: dict[str, Any]
    rules: list[Rules]

    def rows(self, episode: int) -> slice:
        """Returns the rows of an episode."""
        return slice(int(self.starts[episode]), int(self.ends[episode]))


def read(path: Path) -> Recording:
    """Returns the recorded games of a file.

    Raises:
        TraceError: it is not a whole file of recorded games; the message says why in one sentence.
    """
    try:
        archive = np.load(path, allow_pickle=False)
        if isinstance(archive, np.ndarray):
            raise TraceError("is one array, not an npz archive of recorded games.")
        with archive:
            arrays = {name: archive[name] for name in archive.files}
    except TraceError:
        raise
    except OSError as error:
        raise TraceError(f"cannot be read: {error.strerror or error}.") from error
    except (ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError) as error:
        raise TraceError("is no npz archive of recorded games, or is cut off or damaged.") from error

    missing = [name for name in (*SHAPES, "meta") if name not in arrays]
    if missing:
        raise TraceError(f"has no recorded games, as it lacks the arrays {missing}.")
    meta = _meta(arrays.pop("meta"))
    _check_arrays(arrays, 2 * meta["team_size"], len(meta["policies"]))
    steps = arrays["episode_step"]
    starts = np.flatnonzero(steps == 0)
    ends = np.append(starts[1:], len(steps))
    whole = len(starts) > 0 and starts[0] == 0
    for number, (start, end) in enumerate(zip(starts, ends, strict=whole)):
        whole = whole and np.array_equal(steps[start:end], np.arange(end - start))
        whole = whole and bool((arrays["episode"][start:end] == number).all())
        whole = whole and bool((arrays["policy"][start:end] == arrays["policy"][start]).all())
    if not whole:
        raise TraceError("has episodes whose numbers, steps or policies are not in order.")
    rules = [_rules(meta, arrays, slice(start, end)) for start, end in zip(starts, ends, strict=True)]
    return Recording(arrays, starts, ends, meta, rules)


def _meta(text: NDArray) -> dict[str, Any]:
    try:
        meta = json.loads(str(text))
        settings = {name: float(meta[name]) for name in NUMBERS}
        settings |= {name: meta[name] for name in ("max_time", "max_score")}
        settings |= {"team_size": int(meta["team_size"]), "world_size": [float(x) for x in meta["world_size"]]}
        policies, reward = [str(name) for name in meta["policies"]], meta["reward"]
    except (ValueError, TypeError, KeyError) as error:
        raise TraceError(f"has settings (meta) that cannot be read: {error!r}.") from error
    if reward != "custom_rew2" or settings["team_size"] < 1:
        raise TraceError(
            f"must be of reward custom_rew2 and team_size >= 1, but is of {reward!r}, {meta['team_size']}."
        )
    return settings | {"policies": policies}


def _check_arrays(arrays: dict[str, NDArray], vehicles: int, policies: int) -> None:
    sizes = {V: vehicles, T: 13 + 8 * vehicles}
    rows = len(arrays["episode"]) if arrays["episode"].ndim else 0
    for name, (shape, kind) in SHAPES.items():
        wanted = (rows, *(sizes.get(size, size) for size in shape))
        if arrays[name].shape != wanted or arrays[name].dtype.kind != kind:
            found = f"{arrays[name].shape} of {arrays[name].dtype}"
            raise TraceError(f"has an array {name} of shape {found}, but it must be {wanted} of kind {kind!r}.")
    for name, top in (("action", 17), ("policy", policies), ("tagged_opponent", vehicles)):
        if not (arrays[name].min(initial=0) >= -1 and arrays[name].max(initial=0) < top):
            raise TraceError(f"has an entry of {name} outside of -1..{top - 1}.")


def _rules(meta: dict[str, Any], arrays: dict[str, NDArray], rows: slice) -> Rules:
    """Returns the rules of one episode; a time or score that differs between episodes is told by how it ended."""
    last = rows.stop - 1
    max_time, max_score = meta["max_time"], meta["max_score"]
    if isinstance(max_time, str):
        named = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", max_time)]
        max_time = float(arrays["time"][last]) if arrays["truncated"][last] else max(named, default=0.0)
    if isinstance(max_score, str):
        named = [int(number) for number in re.findall(r"\d+", max_score)]
        scored = int(arrays["score"][last, :, 0].max())
        max_score = max(scored, 1) if arrays["terminated"][last] else max(named, default=0)
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
            max_time_s=max_time,
            max_score=max_score,
            tagging_cooldown_s=meta["tagging_cooldown"],
        )
    except ValueError as error:
        raise TraceError(f"has settings (meta) that are not allowed: {error}") from error
