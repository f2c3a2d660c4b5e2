"""What the benchmarks measure with."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from hydra import compose, initialize_config_module

from berteam_cli import build
from berteam_cli.compose import CONF, prepare
from berteam_cli.config import checked

Row = tuple[str, str, str]


def parts(*overrides: str) -> Any:
    prepare()
    with initialize_config_module(CONF, version_base="1.3"):
        return build.parts(checked(compose("train", overrides=list(overrides))))


def seconds(task: Callable[[], object], times: int = 3) -> float:
    """Returns the median time of ``task``, after one run that does not count."""
    task()
    taken = []
    for _ in range(times):
        start = time.perf_counter()
        task()
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))
