"""Checkpoints that are not what was written: flipped bits, cut short."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.faults.forking import finished, started
from tests.faults.job import GO_ON, WORDS, Whole, fresh, one_sentence, wrong_at_last


def tampered(place: Path, known: Whole, count: int, seed: int) -> Iterator[tuple[str, str]]:
    """Changes one bit of, or cuts, a file of a broken-off run's newest checkpoint, so many times; then of both."""
    rng = np.random.default_rng(seed)
    fresh(place)
    child = started(place, *WORDS)
    kept = place.parent / "broken_off"
    while len(sorted((place / "run" / "checkpoint").glob("epoch_*"))) < 2:
        assert child.ended_within(0.01) is None, child.said.read_text()
    child.kill()
    child.ended()
    shutil.rmtree(kept, ignore_errors=True)
    shutil.copytree(place / "run", kept)
    for _ in range(count):
        fresh(place)
        shutil.copytree(kept, place / "run")
        newest = sorted((place / "run" / "checkpoint").glob("epoch_*"))[-1]
        file = newest / rng.choice(["state.json", "tensors.safetensors"])
        what = damage(file, rng)
        code, said = finished(place, *GO_ON)
        wrong = "" if code == 0 else f"exit {code}: {said}"
        told = "" if f"{newest.name} is damaged" in said and "the one before is tried" in said else f"not told: {said}"
        yield f"{what} of {file.name}", wrong or told or wrong_at_last(place, known)
    fresh(place)
    shutil.copytree(kept, place / "run")
    for file in (place / "run" / "checkpoint").glob("*/*"):
        damage(file, rng)
    code, said = finished(place, *GO_ON)
    wrong = one_sentence(said) if code == 3 and "is damaged" in said else f"exit {code}: {said}"
    yield "damage in both checkpoints", wrong


def damage(file: Path, rng: np.random.Generator) -> str:
    """Changes one bit of ``file`` or cuts it; returns which."""
    content = bytearray(file.read_bytes())
    if rng.random() < 0.3:
        file.write_bytes(content[: rng.integers(len(content))])
        return "a cut"
    at = int(rng.integers(len(content) - 1))  # the last byte is a line's end
    content[at] ^= 1 << int(rng.integers(8))
    file.write_bytes(content)
    return f"a flipped bit at byte {at}"
