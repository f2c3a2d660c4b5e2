"""Runs that have no room on the disk, in memory or in time, and folders that others hold."""

from __future__ import annotations

import ctypes
import os
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.faults.forking import finished, started
from tests.faults.job import GO_ON, WORDS, Whole, fresh, one_sentence, tables, wrong_at_last, wrong_now

CAPABILITIES = ctypes.c_uint32 * 6  # effective, permitted, inheritable; twice


def refused(code: int, said: str, allowed: tuple[int, ...] = (2, 3)) -> str:
    """Returns what is wrong with how a command ended that could not do its work: nothing, if it said so."""
    return one_sentence(said) if code in allowed else f"exit {code}: {said}"


def no_room(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Runs whose files may not grow beyond so many sizes: writing fails as on a full disk."""
    largest = max(path.stat().st_size for path in (place / "run").rglob("*") if path.is_file())
    for size in np.random.default_rng(seed).integers(1, largest, count):
        fresh(place)
        child = started(place, *WORDS, prepare=lambda size=size: limit(resource.RLIMIT_FSIZE, int(size)))
        code, said = child.ended(), ""
        with (place / "said.txt").open("rb") as file:
            said = file.read().decode(errors="replace")
        # What it prints goes into a file, too, and may be cut: only the exit code is certain to arrive.
        wrong = "" if code in {2, 3} and "Traceback" not in said else f"exit {code}: {said}"
        yield f"files of {size:,} bytes at most", wrong or wrong_now(place) or wrong_at_last(place, known)


def limit(what: int, value: int) -> None:
    """Limits this process; it may not lift the limit again."""
    resource.setrlimit(what, (value, value))


def full_disk(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Runs on file systems too small for them, which then get room; nothing where none may be mounted."""
    size = sum(path.stat().st_size for path in (place / "run").rglob("*") if path.is_file())
    for share in np.random.default_rng(seed).uniform(0.05, 0.9, count):
        fresh(place)
        if not mounted(place, f"size={int(size * share)}"):
            return
        try:
            code, said = finished(place, *WORDS)
            wrong = refused(code, said)
            subprocess.run(["mount", "-o", f"remount,size={4 * size}", str(place)], check=True)
            yield f"a disk of {share:.0%} of the room", wrong or wrong_now(place) or wrong_at_last(place, known)
        finally:
            subprocess.run(["umount", "-l", str(place)], check=True)


def mounted(place: Path, options: str) -> bool:
    """Mounts a file system in memory at ``place``; returns whether that is allowed."""
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
    return shutil.which("mount") is not None and subprocess.run(mount, capture_output=True, check=False).returncode == 0


def no_privilege() -> None:
    """Lets this process, if it is the administrator's, write no files that it may not write by their modes (Linux)."""
    if os.geteuid() == 0:
        libc, header, sets = ctypes.CDLL(None, use_errno=True), (ctypes.c_uint32 * 2)(0x20080522, 0), CAPABILITIES()
        assert libc.capget(header, sets) == 0
        sets[0] &= ~(1 << 1 | 1 << 2)  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH of the effective ones
        assert libc.capset(header, sets) == 0


def read_only(place: Path, known: Whole) -> Iterator[tuple[str, str]]:
    """Runs in folders that may only be read: one that is not there yet, and one of a run that was broken off."""
    for what, words in (("a new run", WORDS), ("a run that goes on", GO_ON)):
        fresh(place)
        if words is GO_ON:
            broken_off(place, known.seconds / 2)
        before = {path: path.stat().st_mtime_ns for path in place.rglob("*") if path.name != "said.txt"}
        locked(place, writable=False)
        code, said = finished(place, *words, prepare=no_privilege)
        locked(place, writable=True)
        after = {path: path.stat().st_mtime_ns for path in place.rglob("*") if path.name != "said.txt"}
        wrong = refused(code, said) or ("" if after == before else "something was written")
        yield f"{what} in a folder that may only be read", wrong or wrong_at_last(place, known)


def broken_off(place: Path, seconds: float) -> None:
    """Leaves a run that was killed after so many ``seconds``, if it was not at its end before."""
    child = started(place, *WORDS)
    if child.ended_within(seconds) is None:
        child.kill()
        child.ended()


def locked(place: Path, *, writable: bool) -> None:
    """Lets nobody write below ``place``, or its owner."""
    for path in (place, *place.rglob("*")):
        if path.name == "said.txt":
            path.chmod(0o666)
        else:
            path.chmod((0o755 if writable else 0o555) if path.is_dir() else (0o644 if writable else 0o444))


def little_memory(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Runs that may take so much memory and no more: told before the start, or wherever it is not enough."""
    fresh(place)
    words = (*WORDS, "population.islands.dqn64.learner.buffer_size=1000000")
    code, said = finished(place, *words, prepare=lambda: limit(resource.RLIMIT_AS, virtual_bytes(os.getpid()) + 2**28))
    told = "" if code == 2 and "learner.buffer_size must be <= " in said else f"exit {code}: {said}"
    left = "a folder was made" if (place / "run").exists() else ""
    yield "more members than memory, told before the start", told or one_sentence(said) or left
    for moment in np.random.default_rng(seed).uniform(0, known.seconds, count):
        fresh(place)
        child = started(place, *WORDS)
        if child.ended_within(moment) is None:
            now = virtual_bytes(child.pid)
            resource.prlimit(child.pid, resource.RLIMIT_AS, (now, now))
            child.ended()  # however it does
        yield f"no more memory after {moment:.2f} s", wrong_now(place) or wrong_at_last(place, known)


def virtual_bytes(pid: int) -> int:
    """Returns the bytes of address space that a process has."""
    return int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")


def clock_set_back(place: Path, known: Whole) -> Iterator[tuple[str, str]]:
    """A run that goes on at what the clock says is ten years before it began, and whose clock then falls on."""
    fresh(place)
    broken_off(place, known.seconds / 2)
    late = time.time() + 10 * 365 * 86400
    for path in (place / "run").rglob("*"):
        os.utime(path, (late, late))
    manifest = place / "run" / "manifest.json"
    if manifest.exists():
        manifest.write_text(manifest.read_text().replace('"started": "20', '"started": "21'))
    code, said = finished(place, *GO_ON, prepare=falling_clock)
    wrong = "" if code == 0 else f"exit {code}: {said}"
    same = "" if tables(place / "run") == known.tables else "other bytes"
    yield "the clock set back", wrong or same or wrong_at_last(place, known)


def falling_clock() -> None:
    """Lets the clock of this process run backwards, a minute each time it is looked at."""
    at = [time.time()]

    def falling() -> float:
        at[0] -= 60.0
        return at[0]

    time.time = falling


def two_at_once(place: Path, known: Whole) -> Iterator[tuple[str, str]]:
    """Three more processes on the folder of a run under way: each is refused, and the run does not notice."""
    fresh(place)
    child = started(place, *WORDS)
    while not (place / "run" / "manifest.json").exists():
        assert child.ended_within(0.01) is None, child.said.read_text()
    child.kill(signal.SIGSTOP)  # so that it does not end before the others come
    (place / "said.txt").rename(place / "said_first.txt")
    wrong = ""
    for words in (GO_ON, (*WORDS, "on_exists=overwrite"), ("resume", "run")):
        code, said = finished(place, *words)
        wrong = wrong or refused(code, said, (2,)) or ("" if "is in use" in said else said)
    child.kill(signal.SIGCONT)
    code = child.ended()
    same = "" if code == 0 and tables(place / "run") == known.tables else f"exit {code}, or other bytes"
    yield "two processes on one folder", wrong or same
