"""Tries all faults and prints how many were survived: `python -m tests.faults [short] [seed=N]`.

Wrong command lines, which the tests try too, are left out of the short version.

The exit code is 1 if one was not.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from tests.faults.job import Whole, whole
from tests.faults.kills import asked, at_files, at_random, in_the_middle
from tests.faults.starving import clock_set_back, full_disk, little_memory, no_room, read_only, two_at_once
from tests.faults.tampering import tampered

Tries = Iterator[tuple[str, str]]


def everything(place: Path, known: Whole, short: bool, seed: int) -> Iterator[tuple[str, Tries]]:
    """Yields the faults, by what they are."""
    yield "no room for a file", no_room(place, known, 1 if short else 10, seed)
    yield "a full disk", full_disk(place, known, 1 if short else 10, seed)
    yield "SIGKILL at random moments", at_random(place, known, 1 if short else 50, seed)
    yield "SIGKILL before a file is touched", at_files(place, known, 2 if short else 50, seed)
    yield "SIGKILL in the middle of a row, of a checkpoint", in_the_middle(place, known, 1 if short else 5, seed)
    yield "SIGINT, SIGTERM", asked(place, known, 2 if short else 20, seed)
    yield "a damaged checkpoint", tampered(place, known, 1 if short else 30, seed)
    yield "a folder that may only be read", read_only(place, known)
    yield "little memory", little_memory(place, known, 1 if short else 10, seed)
    yield "the clock set back", clock_set_back(place, known)
    yield "two processes on one folder", two_at_once(place, known)


def main(words: list[str]) -> int:
    """Tries all faults; returns how many were not survived."""
    short = "short" in words
    seed = next((int(word.partition("=")[2]) for word in words if word.startswith("seed=")), 0)
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder, "place")
        known = whole(place)
        print(f"A run of {known.seconds:.1f} s is broken in every way; seed {seed}.", flush=True)
        for title, tries in everything(place, known, short, seed):
            began, tried, lost = time.monotonic(), 0, 0
            for what, wrong in tries:
                tried += 1
                if wrong:
                    lost += 1
                    print(f"  not survived: {what}: {wrong}", flush=True)
            took = f"({time.monotonic() - began:.0f} s)"
            print(f"{title}: survived {tried - lost} of {tried} {took}" if tried else f"{title}: not to be had here")
            sys.stdout.flush()
            failures += lost
    if not short:
        failures += subprocess.run([sys.executable, "-m", "tests.faults_config"], check=False).returncode
    return failures


if __name__ == "__main__":
    sys.exit(1 if main(sys.argv[1:]) else 0)
