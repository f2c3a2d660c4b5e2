"""What is said of a word that is not allowed."""

import difflib
from collections.abc import Iterable
from typing import Any


def did_you_mean(given: Any, allowed: Iterable[str]) -> str:
    """Returns " Did you mean ...?" with the allowed word that is nearest to ``given``, or nothing."""
    near = difflib.get_close_matches(str(given).lower(), list(allowed), 1, 0.5)
    return f" Did you mean {near[0]}?" if near else ""


def check_word(name: str, given: Any, allowed: Iterable[str]) -> None:
    """Raises a ValueError that names the nearest word, unless ``given`` is one of ``allowed``."""
    words = tuple(allowed)
    if not isinstance(given, str) or given not in words:
        raise ValueError(f"{name} must be one of {words}, but is {given!r}.{did_you_mean(given, words)}")
