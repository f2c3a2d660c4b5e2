"""Errors a user can mend: one sentence each, no traceback."""

from __future__ import annotations

import re
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


LONGEST = 1000  # of a word in an error; no path and no name that somebody typed is longer


def shown(text: str) -> str:
    """Returns ``text`` as one line that a terminal only shows: what it would obey is written as in a Python string."""
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)


def sentence(error: Exception) -> str:
    """Returns what an error says as one line, with words that nobody would read to their end cut in the middle."""
    most = LONGEST // 2
    return re.sub(rf"\S{{{LONGEST},}}", lambda word: f"{word[0][:most]}…{word[0][-most:]}", shown(str(error)))
