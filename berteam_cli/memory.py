"""How much memory a run needs, told and checked before it begins."""

from __future__ import annotations

import os
import resource
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import torch

from berteam_cli.errors import InputError
from berteam_cli.population import Island

BASE = 3 * 2**28  # bytes of the interpreter with torch, and of BERTeam's network
COPIES = 2  # a checkpoint holds what it writes a second time, and so does a run that goes on until it has read it
GROUP_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


class Room(NamedTuple):
    """Memory that a setting asks for, in proportion to its value.

    Attributes:
        taken: bytes.
        key: of the setting.
        value: of it.
    """

    taken: int
    key: str
    value: int


def available() -> int:
    """Returns the bytes of memory this process may have at most: the machine's, or what it is limited to."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    if soft != resource.RLIM_INFINITY:
        limits.append(soft)
    for path in GROUP_LIMITS:
        with suppress(OSError, ValueError):  # the file is not there, or says "max"
            limits.append(int(Path(path).read_text(encoding="ascii")))
    return min(limits)


def spoken(size: float) -> str:
    """Returns a size in bytes as it is read: 310 MiB, 2.5 GiB."""
    return f"{size / 2**20:,.0f} MiB" if size < 2**30 else f"{size / 2**30:,.1f} GiB"


def state_bytes(island: Island) -> int:
    """Returns the bytes that the members of ``island`` take."""
    return island.learner.state_bytes(island.size)


def check_memory(islands: tuple[Island, ...], rooms: list[Room]) -> None:
    """Checks that what a run keeps in memory fits there, and what is on a GPU fits on it.

    That is counted on the processor's side, too: it is made there, and a checkpoint is written from there.

    Args:
        islands: of the population.
        rooms: what is kept beside its members, on the processor's side.

    Raises:
        InputError: it does not; with the setting that takes most and the largest value that would fit.
    """
    whole = available()
    fits_there(list(islands), rooms, (whole - BASE) // COPIES, whole)
    there = [island for island in islands if getattr(island.learner, "device", "cpu") == "cuda"]
    if there:
        free, whole = torch.cuda.mem_get_info()
        fits_there(there, [], free, whole)


def fits_there(islands: list[Island], rooms: list[Room], limit: int, whole: int) -> None:
    """Checks that members and ``rooms`` take at most ``limit`` bytes.

    Args:
        islands: the members.
        rooms: what is kept beside them.
        limit: bytes.
        whole: bytes that there are, for the message.

    Raises:
        InputError: they take more.
    """
    members = sum(state_bytes(island) for island in islands)
    total = members + sum(room.taken for room in rooms)
    if total <= limit:
        return
    said = f"what is kept would take {spoken(total)} of memory, and may take {spoken(limit)} of {spoken(whole)}"
    largest, room = max(islands, key=state_bytes, default=None), max(rooms, default=Room(0, "", 0))
    if largest is None or room.taken > state_bytes(largest):
        most = max((limit - (total - room.taken)) * room.value // room.taken, 0)
        raise InputError(f"{room.key} must be <= {most}, but is {room.value}: {said}.")
    takes = state_bytes(largest)
    learner: Any = largest.learner  # of whatever kind, a frozen dataclass
    key, most = learner.buffer, 0
    if key:
        one, two = (replace(learner, **{key: size}).state_bytes(largest.size) for size in (1, 2))
        most = 1 + (limit - (total - takes) - one) // (two - one)
    name = f"population.islands.{largest.name}"
    if most < 1:
        smaller = "" if key else " or too large buffers, which learner.options.n_steps or buffer_size says"
        raise InputError(
            f"{name}.size={largest.size} is too many members of {spoken(takes)} together{smaller}: {said}."
        )
    raise InputError(f"{name}.learner.{key} must be <= {most}, but is {getattr(learner, key)}: {said}.")
