"""What can be said rightly: the groups, choices, keys and bounds of the configuration, and slips in it."""

from __future__ import annotations

import random
import re
import string
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

from hydra import compose, initialize_config_module
from omegaconf import OmegaConf

from berteam_cli.compose import CONF, choices, groups, keys, prepare
from berteam_cli.config import checked


class Wrong(NamedTuple):
    """A wrong command line.

    Attributes:
        kind: of mistake.
        words: after ``berteam``.
        said: a pattern that the error must have: the key, and what is right.
    """

    kind: str
    words: tuple[str, ...]
    said: str


class Known(NamedTuple):
    """What can be said to a command.

    Attributes:
        command: its word.
        first: words that it must have.
        groups: choices of each of its groups.
        keys: dotted keys of its values.
        bounds: low, high and whether low itself is out, by key of a number.
        words: allowed words by key.
        whole: keys of whole numbers.
    """

    command: str
    first: tuple[str, ...]
    groups: dict[str, list[str]]
    keys: list[str]
    bounds: dict[str, tuple[float, float, bool]]
    words: dict[str, tuple[str, ...]]
    whole: set[str]


FIRST = {
    "train": ("population=ppo6",),
    "tournament": (),
    "replay": (),
    "evaluate": ("nowhere",),
    "compare": ("nowhere", "nobody"),
    "report": ("nowhere",),
    "reproduce": ("paper_fixed",),
}
"""Commands with a config, and their first words. They find out that there is no such run after they read the rest."""


def known(command: str) -> Known:
    """Returns what can be said to ``command``, read from its schemas and yaml files."""
    prepare()
    lead = {
        "train": ["population=ppo6"],
        "evaluate": ["run=x"],
        "compare": ["runs=[x,y]"],
        "report": ["runs=[x]"],
        "reproduce": ["what=paper_fixed"],
    }
    with initialize_config_module(CONF, version_base="1.3"):
        config = compose(command, overrides=lead.get(command, []))
        every = [key for key in keys(config) if not OmegaConf.is_dict(OmegaConf.select(config, key))]
        every = [key for key in every if ".learner." not in key]  # which is the key learner again
        of = {
            group: choices(group)
            for group in groups()
            if group in config or (command, group) == ("train", "experiment")
        }
    found = Known(command, FIRST[command], of, every, {}, {}, set())
    collect(checked(config), "", found)
    return found


def collect(value: Any, key: str, found: Known) -> None:
    """Adds the bounds and words of the schema of ``value`` and all below it to ``found``."""
    if isinstance(value, dict):
        for name, item in value.items():
            collect(item, f"{key}.{name}", found)
    if not is_dataclass(value):
        return
    for item in fields(value):
        if item.name == "learner" and key:
            continue
        if found.command == "reproduce" and item.name == "what":
            continue  # which is its first word
        path, given = f"{key}.{item.name}".lstrip("."), getattr(value, item.name)
        collect(given, path, found)
        if "allowed" in item.metadata:
            found.words[path] = item.metadata["allowed"]
        if "low" in item.metadata:
            found.bounds[path] = tuple(item.metadata[x] for x in ("low", "high", "open_low"))
            if isinstance(given, int):
                found.whole.add(path)


def misspelt(word: str, rng: random.Random, others: Iterable[str] = ()) -> str:
    """Returns ``word`` with one slip of the fingers, which makes none of ``others`` of it."""
    while True:
        at, letter = rng.randrange(len(word)), rng.choice(string.ascii_lowercase)
        slips = (
            word[:at] + word[at + 1 :],
            word[:at] + letter + word[at:],
            word[:at] + letter + word[at + 1 :],
            word[:at] + word[at + 1 : at + 2] + word[at] + word[at + 2 :],
        )
        slip = rng.choice(slips)
        if slip not in {word, "", *others} and slip[0].isalpha():
            return slip


def at(key: str) -> str:
    """Returns a pattern that finds ``key``."""
    return re.escape(key)


def some(rng: random.Random, items: Iterable[Any], most: int) -> list[Any]:
    """Returns ``most`` of the items, or all."""
    items = sorted(items)
    return rng.sample(items, min(most, len(items)))
