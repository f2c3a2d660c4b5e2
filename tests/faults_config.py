"""All wrong command lines of the generator, against the real command: which are not refused cleanly."""

from __future__ import annotations

import sys

import torch

from tests.wrong import cases
from tests.wrong.refusal import fault


def main() -> int:
    """Prints how each of them failed that was not refused cleanly, and the figure; returns how many failed."""
    torch.set_num_threads(1)
    tried = cases()
    faults = [found for found in map(fault, tried) if found is not None]
    for found in faults:
        print(found, flush=True)
    print(f"bad command lines refused cleanly: {len(tried) - len(faults)} of {len(tried)} tried", flush=True)
    return len(faults)


if __name__ == "__main__":
    sys.exit(min(main(), 1))
