"""How long the command takes to answer what needs no run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.bench.timing import seconds

BERTEAM = Path(sys.executable).with_name("berteam")
WORDS = ("train", "resume", "tournament", "replay", "export", "evaluate", "compare", "reproduce", "report", "inspect")


def starting():
    def answer(*words: str) -> float:
        return seconds(lambda: subprocess.run([BERTEAM, *words], stdout=subprocess.DEVNULL, check=True))

    yield "berteam --help", f"{answer('--help'):.2f} s", "0.5 s"
    slowest = max(answer(word, "--help") for word in WORDS)
    yield f"berteam WORD --help, the slowest of {len(WORDS)}", f"{slowest:.2f} s", "0.5 s"
    yield "Tab: keys of the selector", f"{answer('--complete', 'train', 'selector.'):.2f} s", "0.15 s"


ROWS = (starting,)
