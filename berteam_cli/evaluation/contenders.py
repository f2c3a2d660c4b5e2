"""Runs that are compared: what they are called, and whether they can be compared at all."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from omegaconf import OmegaConf

from berteam_cli.errors import InputError
from berteam_cli.folder import read_manifest
from berteam_cli.outcomes import Ints
from berteam_cli.reading import last_state
from berteam_cli.stored import flat, plain_config
from berteam_cli.training import Parts, Run

ASIDE = (
    *("seed", "out", "on_exists", "workers", "device", "logger", "checkpoint_every", "record_every", "payoff_steps"),
    *("evaluate_every", "evaluate_teams"),
)
"""Keys that do not make another algorithm, beside all of ``evaluation``."""
FIRST = ("selector", "optimizer", "population", "learner", "env")  # groups, in the order in which they are told


@dataclass(frozen=True)
class Contender:
    """A run in a comparison.

    Attributes:
        folder: of the run.
        seed: of its training.
        parts: what does not change in it.
        run: as its last checkpoint left it.
        config: its values by dotted key, those that do not matter left out.
        broken: how it ended early, or nothing.
    """

    folder: Path
    seed: int
    parts: Parts
    run: Run
    config: dict[str, Any]
    broken: str


def contender(folder: Path, trust: Collection[str]) -> Contender:
    """Returns the run in ``folder``, whose game may import what ``trust`` names.

    Raises:
        InputError: there is none, or it has no checkpoint.
    """
    status = read_manifest(folder)["status"]
    parts, run = last_state(folder, trust=trust)
    values = flat(OmegaConf.to_container(plain_config(folder)))
    kept = {key: x for key, x in values.items() if key.split(".")[0] not in (*ASIDE, "evaluation")}
    broken = "" if status == "done" else f"{folder} is {status}; it is compared as it was after epoch {run.epoch}"
    return Contender(folder, parts.seed, parts, run, kept, broken)


def contenders(folders: list[Path], trust: Collection[str] = ()) -> list[Contender]:
    """Returns the runs in ``folders``, in an order that their own order does not change.

    Args:
        folders: of the runs.
        trust: what their games may import.

    Raises:
        InputError: one is no run or there twice, two are one training, or their games differ.
    """
    if len(folders) < 2:
        raise InputError("compare needs two runs at least; name their folders one after the other.")
    seen: dict[Path, Path] = {}
    for folder in folders:
        if folder.resolve() in seen:
            raise InputError(f"{folder} is named twice; every run counts once.")
        seen[folder.resolve()] = folder
    found = [contender(folder, trust) for folder in folders]
    check_game(found)
    check_seeds(found)
    return sorted(found, key=lambda x: (sorted(map(str, x.config.items())), x.seed, str(x.folder)))


def check_seeds(found: list[Contender]) -> None:
    """Checks that no two runs are the same training: it would count as two seeds, and intervals would be too narrow.

    Raises:
        InputError: two are; with their folders.
    """
    for a, b in combinations(found, 2):
        if a.seed == b.seed and a.config == b.config:
            raise InputError(
                f"{a.folder} and {b.folder} are the same training, of one config and seed={a.seed}; it would count as "
                "two. Name one of them, or train another seed."
            )


def check_game(found: list[Contender]) -> None:
    """Checks that all runs play one game of two sides.

    Raises:
        InputError: they do not; with the first setting that differs.
    """
    first = found[0]
    rules = flat(first.parts.games.env.fingerprint())
    for other in found[1:]:
        others = flat(other.parts.games.env.fingerprint())
        for key in sorted(rules.keys() | others.keys()):
            if rules.get(key) != others.get(key):
                raise InputError(
                    f"Only runs of one game and the same rules can be compared, but {key} is {rules.get(key)!r} in "
                    f"{first.folder} and {others.get(key)!r} in {other.folder}."
                )
    if first.parts.games.env.sides != 2:
        raise InputError(f"Only runs of games of two sides can be compared, but {first.folder} has more.")


def algorithms(found: list[Contender]) -> tuple[list[str], Ints]:
    """Returns the names of the algorithms, and (R,) which of them each run is."""
    configs: list[dict[str, Any]] = []
    of = []
    for one in found:
        if one.config not in configs:
            configs.append(one.config)
        of.append(configs.index(one.config))
    return called(configs), np.array(of, dtype=np.int64)


def called(configs: list[dict[str, Any]]) -> list[str]:
    """Returns a name for each of several different configs: the fewest first keys that tell all of them apart."""
    if len(configs) == 1:
        return ["all"]
    differing = {key for x in configs for key in x if len({str(y.get(key)) for y in configs}) > 1}
    told: list[str] = []

    def apart(keys: list[str]) -> int:
        return len({tuple(str(x.get(key)) for key in keys) for x in configs})

    for key in sorted(differing, key=prominence):
        if apart([*told, key]) > apart(told):
            told.append(key)
    words = {key: key.removesuffix(".name") for key in told}
    nothing = " ".join(f"{word}=none" for word in words.values())  # of whoever lacks all that the others are told by
    return [" ".join(f"{word}={x[key]}" for key, word in words.items() if key in x) or nothing for x in configs]


def prominence(key: str) -> tuple[bool, int, str]:
    """Returns how early ``key`` is to be told: the choice of a group before its values, the selector first."""
    group = key.split(".", maxsplit=1)[0]
    return (not key.endswith(".name"), FIRST.index(group) if group in FIRST else len(FIRST), key)


def sampled(contender: Contender, count: int, side: int, rng: np.random.Generator) -> Ints:
    """Returns (count, T) teams as the run's selector makes them for games on ``side``."""
    selector = contender.parts.selector
    where = {"side": side} if selector.by_side else {}
    return selector.sample(contender.run.selection, count, rng, **where)
