"""How much memory a run needs, told and checked before it begins."""

from __future__ import annotations

import os
import resource
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from berteam_cli.env.base import Env, trajectory_bytes
from berteam_cli.errors import InputError
from berteam_cli.population import Island

GROUP_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


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


def needed(islands: tuple[Island, ...], env: Env, games: int) -> tuple[int, int]:
    """Returns the bytes that the members take, weights and buffers, and those of trajectories of ``games`` games."""
    return sum(island.learner.state_bytes(island.size) for island in islands), trajectory_bytes(env, games)


def check_memory(islands: tuple[Island, ...], env: Env, games: int) -> None:
    """Checks that what a run keeps in memory fits there.

    Args:
        islands: of the population.
        env: the game.
        games: that are learnt from in one epoch.

    Raises:
        InputError: it does not; with the setting that takes most and the largest value that would fit.
    """
    members, played = needed(islands, env, games)
    limit, total = available(), members + played
    if total <= limit:
        return
    said = f"the run would need {spoken(total)} of memory, and there are {spoken(limit)}"
    largest = max(islands, key=lambda island: island.learner.state_bytes(island.size))
    takes = largest.learner.state_bytes(largest.size)
    if played > takes:
        fits = (limit - members) * games // played
        raise InputError(f"games_per_epoch must be <= {max(fits, 0)}, but is {games}: {said}.")
    key, learner, fits = largest.learner.buffer, largest.learner, 0
    if key:
        one, two = (replace(learner, **{key: size}).state_bytes(largest.size) for size in (1, 2))
        fits = 1 + (limit - (total - takes) - one) // (two - one)
    name = f"population.islands.{largest.name}"
    if fits < 1:
        raise InputError(f"{name}.size is {largest.size}, too many members of {spoken(takes)} together: {said}.")
    raise InputError(f"{name}.learner.{key} must be <= {fits}, but is {getattr(learner, key)}: {said}.")
