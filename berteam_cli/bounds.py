"""Bounds of values in the schemas of the configuration, and the check against them."""

from __future__ import annotations

import math
from dataclasses import field, fields, is_dataclass
from typing import Any

from omegaconf import MISSING, OmegaConf

from berteam_cli.errors import InputError, did_you_mean

LIMIT = 10**9  # above any size a run can have


def number(low: float = 0, high: float = LIMIT, *, open_low: bool = False) -> Any:
    """Declares a value in [low, high], or in (low, high] if ``open_low``."""
    return field(default=MISSING, metadata={"low": low, "high": high, "open_low": open_low})


def number_or(word: str, low: int, high: int) -> Any:
    """Declares a whole number in [low, high], or ``word``, of a field of type Any."""
    return field(default=MISSING, metadata={"low": low, "high": high, "open_low": False, "word": word})


def choice(*allowed: str) -> Any:
    """Declares one of the words ``allowed``."""
    return field(default=MISSING, metadata={"allowed": allowed})


def open_dict() -> Any:
    """Returns an empty dictionary whose keys are the user's: `env.options.KEY=VALUE` needs no +."""
    return OmegaConf.create({}, flags={"struct": False})


def check_bounds(value: Any, key: str) -> None:
    """Checks ``value`` and all below it against the bounds of its schema.

    Raises:
        InputError: with the key, what is allowed and what was given.
    """
    if isinstance(value, dict):
        for name, item in value.items():
            check_bounds(item, f"{key}.{name}")
    if not is_dataclass(value):
        return
    for item in fields(value):
        path = f"{key}.{item.name}".lstrip(".")
        given = getattr(value, item.name)
        check_bounds(given, path)
        if word := item.metadata.get("word"):
            check_number_or(word, given, path, item.metadata["low"], item.metadata["high"])
            continue
        if given is None:
            continue
        if "allowed" in item.metadata and given not in item.metadata["allowed"]:
            raise InputError.choice(path, given, item.metadata["allowed"])
        if "low" in item.metadata:
            low, high, open_low = (item.metadata[x] for x in ("low", "high", "open_low"))
            if not (low < given if open_low else low <= given) or not given <= high or not math.isfinite(given):
                above = f"> {low:g}" if open_low else f">= {low:g}"
                below = f" and <= {high:g}" if high != LIMIT or given > high else ""
                raise InputError(f"{path} must be {above}{below}, but is {given}.")


def check_number_or(word: str, given: Any, path: str, low: int, high: int) -> None:
    """Checks that ``given`` is ``word`` or a whole number in [low, high].

    Raises:
        InputError: it is neither.
    """
    if given != word and not (type(given) is int and low <= given <= high):  # True is an int, too
        near = did_you_mean(given, [word]) if isinstance(given, str) else ""
        raise InputError(f"{path} must be a whole number from {low} to {high}, or {word}, but is {given!r}.{near}")
