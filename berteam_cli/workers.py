"""The threads that share the work of a run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import torch

X = TypeVar("X")
Y = TypeVar("Y")


def available_cores() -> int:
    """Returns how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Workers:
    """Threads for work that leaves the interpreter: compiled games and torch.

    Every thread tells torch to use one thread itself, so that the two never multiply, and a sum inside torch is
    always added up in the same order however many workers there are.
    """

    def __init__(self, count: int) -> None:
        """Starts no thread yet. ``count`` >= 1."""
        self.count = count
        torch.set_num_threads(1)
        self.pool = ThreadPoolExecutor(count, initializer=torch.set_num_threads, initargs=(1,))

    def map(self, function: Callable[[X], Y], items: Iterable[X]) -> list[Y]:
        """Returns ``function`` of each item, in the order of the items.

        The first error is raised once the work under way has ended.
        """
        if self.count == 1:
            return [function(item) for item in items]
        return list(self.pool.map(function, items))
