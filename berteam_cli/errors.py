"""Errors a user can mend: one sentence each, no traceback."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


class InputError(Exception):
    """What the user gave is wrong; the message says what was given, what is allowed, and the nearest right thing."""

    code = 2  # what the command exits with

    @classmethod
    def choice(cls, key: str, given: str, allowed: Iterable[str]) -> InputError:
        """Returns the error for ``given`` where ``key`` takes one of ``allowed``."""
        allowed = sorted(allowed)
        return cls(f"{key} must be one of {', '.join(allowed)}, but is {given!r}.{did_you_mean(given, allowed)}")


class RunError(Exception):
    """The run cannot go on through no fault of the input; the message says what to do."""

    code = 3


def did_you_mean(given: str, allowed: Iterable[str]) -> str:
    """Returns " Did you mean x?" with the word of ``allowed`` nearest to ``given``, or nothing if none is near."""
    words = {word.lower(): word for word in allowed}
    near = get_close_matches(str(given).lower(), list(words), n=1, cutoff=0.5)
    return f" Did you mean {words[near[0]]}?" if near else ""
