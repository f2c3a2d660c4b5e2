"""The machine: cores, device, compiled kernels, memory, disk, text."""

from __future__ import annotations

import math
import os
import platform
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from berteam_cli.health.finding import NOTE, OK, PROBLEM, Finding

QUOTA = Path("/sys/fs/cgroup/cpu.max")  # "200000 100000": two cores; "max 100000": all
OLD_QUOTA = (Path("/sys/fs/cgroup/cpu/cpu.cfs_quota_us"), Path("/sys/fs/cgroup/cpu/cpu.cfs_period_us"))
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
FULL, TIGHT = 2**28, 2**31  # bytes on the disk: of a few checkpoints, and of a long run's tables
SCARCE = 3 * 2**29  # bytes of memory: twice what a run of the default size takes
SLOW_S = 1.0  # of a game that takes milliseconds where it is compiled


def quota() -> float:
    """Returns how many cores the control group may use, infinite where it has no limit."""
    try:
        share, period = QUOTA.read_text().split() if QUOTA.exists() else (path.read_text() for path in OLD_QUOTA)
        return float(share) / float(period) if float(share) > 0 else math.inf
    except (OSError, ValueError):  # there are no such files, or it says "max"
        return math.inf


def cores() -> Iterator[Finding]:
    """Yields how many cores there are, and whether workers=0 would start more threads than may run."""
    from berteam_cli.workers import available_cores  # noqa: PLC0415 (torch)

    may, there, limit = available_cores(), os.cpu_count() or 1, quota()
    said = f"{may} of {there} may be used; workers=0 takes {may}"
    if limit < may:
        fitting = max(1, math.floor(limit))
        yield Finding(NOTE, "cores", f"{said}, but the container may use {limit:g}", f"say workers={fitting}")
    else:
        yield Finding(OK, "cores", said)


def threads() -> Iterator[Finding]:
    """Yields what the environment says of threads."""
    said = [f"{name}={os.environ[name]}" for name in THREADS if name in os.environ]
    odd = [x for x in said if not x.partition("=")[2].isdecimal() or int(x.partition("=")[2]) < 1]
    if odd:
        yield Finding(NOTE, "threads", f"{', '.join(odd)} is no number of threads", "unset it")
    elif said:
        yield Finding(OK, "threads", f"{', '.join(said)}: training and games take `workers` whatever this says")
    else:
        yield Finding(OK, "threads", "the environment limits none")


def device() -> Iterator[Finding]:
    """Yields what torch can compute on."""
    import torch  # noqa: PLC0415 (slow)

    if torch.cuda.is_available():
        torch.ones(1, device="cuda")
        free, whole = torch.cuda.mem_get_info()
        said = f"{torch.cuda.get_device_name()}, {free / 2**30:.1f} of {whole / 2**30:.1f} GiB free"
        yield Finding(OK, "device", f"cpu, cuda ({said}): device=cuda uses it")
    elif shutil.which("nvidia-smi"):
        said = f"cpu; nvidia-smi is here, but torch {torch.__version__} sees no CUDA device"
        yield Finding(NOTE, "device", said, "for device=cuda install a CUDA build of torch")
    elif torch.backends.mps.is_available():
        yield Finding(OK, "device", "cpu; berteam does not use mps, which is here")
    else:
        yield Finding(OK, "device", "cpu")


def kernels() -> Iterator[Finding]:
    """Yields whether the games are compiled, and how long one takes."""
    import numba  # noqa: PLC0415 (slow)
    import numpy as np  # noqa: PLC0415

    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]  # numba sets it as it is imported
        yield Finding(PROBLEM, "kernels", "NUMBA_DISABLE_JIT makes games hundreds of times slower", "unset it")
        return
    from berteam_cli.acting import fixed_policies  # noqa: PLC0415 (slow)
    from berteam_cli.env.mctf import Mctf  # noqa: PLC0415
    from berteam_cli.games import Games, pairings  # noqa: PLC0415
    from berteam_cli.workers import Workers  # noqa: PLC0415
    from mctf.kernel import step  # noqa: PLC0415

    game = Mctf(2, "custom_rew2")
    games, players = Games(game, Workers(1)), fixed_policies(range(len(game.fixed_policies)))
    lineups = pairings(np.array([[2, 5]]), np.array([[0, 3]]))
    begun = time.perf_counter()
    games.play(players, lineups, 0)
    first = time.perf_counter() - begun
    begun = time.perf_counter()
    outcomes, _ = games.play(players, lineups, 0)
    again = time.perf_counter() - begun
    cache = Path(step._cache.cache_path)  # type: ignore[attr-defined]  # of the compiled function
    said = f"a game of {int(outcomes.steps[0])} steps in {1000 * again:.1f} ms"
    if again > SLOW_S:
        yield Finding(NOTE, "kernels", f"{said}, which takes milliseconds elsewhere", "see whether the machine is busy")
    elif not os.access(cache, os.W_OK):
        do = "set NUMBA_CACHE_DIR to a folder that can be written"
        yield Finding(NOTE, "kernels", f"{said}, but every start compiles anew: {cache} cannot be written", do)
    else:
        yield Finding(OK, "kernels", f"{said}, the first after {first:.1f} s; compiled ones are kept in {cache}")


def memory() -> Iterator[Finding]:
    """Yields how much memory there is."""
    from berteam_cli.memory import available, spoken  # noqa: PLC0415 (torch)

    whole, free = available(), free_memory()
    said = f"{spoken(min(whole, free))} free of {spoken(whole)}"
    if min(whole, free) < SCARCE:
        yield Finding(NOTE, "memory", said, "end other programs, or take a smaller population and smaller buffers")
    else:
        yield Finding(OK, "memory", said)


def free_memory() -> float:
    """Returns the bytes that are free, infinite where that is not known."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return math.inf
    return next((1024.0 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")), math.inf)


def home() -> Path:
    """Returns where run folders go, or the nearest folder above that exists."""
    return Path("outputs") if Path("outputs").is_dir() else Path()


def disk() -> Iterator[Finding]:
    """Yields how much room there is for run folders."""
    free, place = shutil.disk_usage(home()).free, home().absolute()
    said = f"{free / 2**30:,.1f} GiB free in {place}"
    if free < FULL:
        yield Finding(PROBLEM, "disk", said, "make room, or say out=DIR on another disk")
    elif free < TIGHT:
        yield Finding(NOTE, "disk", said, "long runs of many members may need more")
    else:
        yield Finding(OK, "disk", said)


def outputs() -> Iterator[Finding]:
    """Yields whether run folders can be made; leaves nothing behind."""
    place = home().absolute()
    try:
        with tempfile.TemporaryDirectory(dir=place) as folder:
            Path(folder, "manifest.json").write_text("{}", encoding="utf-8")
    except OSError as error:
        said = f"{place} cannot be written: {error.strerror or error}"
        yield Finding(PROBLEM, "outputs", said, "go to another folder, or say out=DIR")
    else:
        yield Finding(OK, "outputs", f"{place} can be written")


def text() -> Iterator[Finding]:
    """Yields how text is written, and whether a terminal is there to draw on."""
    name = (sys.stdout.encoding or "unknown").lower()
    shown = "a live view" if sys.stdout.isatty() and os.environ.get("TERM") != "dumb" else "plain lines"
    said = f"{name}, file names {sys.getfilesystemencoding()}, {shown} here ({platform.system()})"
    if name.replace("-", "") != "utf8":
        yield Finding(NOTE, "text", f"{said}: lines and letters are replaced", "set PYTHONUTF8=1, or LC_ALL=C.UTF-8")
    else:
        yield Finding(OK, "text", said)
