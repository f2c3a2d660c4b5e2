"""Whether a wrong command line is refused cleanly: one sentence, exit code 2, nothing left behind."""

from __future__ import annotations

import io
import os
import re
import sys
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest import mock

from berteam_cli import cli
from tests.wrong.known import Wrong

LONGEST = 4000  # characters of an error: a list of all keys of a group, and no more


def fault(case: Wrong) -> str | None:
    """Runs a wrong command line in an empty folder; returns what is wrong with how it was refused, None if nothing."""
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        try:
            return judged(case, *ran(case.words), Path(place))
        finally:
            os.chdir(here)


def ran(words: tuple[str, ...]) -> tuple[object, str, str]:
    """Returns the exit code of a command line, what it printed and what it complained of."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with mock.patch.object(sys, "argv", ["berteam", *words]), redirect_stdout(out), redirect_stderr(err):
        try:
            cli.main()
        except SystemExit as stopped:
            code = stopped.code
        except BaseException as error:  # what would be a traceback
            code = f"{type(error).__name__}: {str(error)[:200]}"
    return code, out.getvalue(), err.getvalue()


def judged(case: Wrong, code: object, out: str, err: str, place: Path) -> str | None:
    """Returns what is wrong with how ``case`` was refused in the folder ``place``, None if nothing is."""
    left = sorted(str(x.relative_to(place)) for x in place.rglob("*"))
    sentence = err.removesuffix("\n")
    for wrong, what in (
        (code != 2, f"it ended with {code}"),
        (out != "", f"it printed {out[:200]!r}"),
        ("Traceback" in err, "there is a traceback"),
        (not err.startswith("berteam: "), f"it said {err[:300]!r}"),
        (not sentence.isprintable(), f"it is not one plain line: {err[:300]!r}"),
        (not sentence.endswith((".", "?")), f"it is no whole sentence: {err[-200:]!r}"),
        (len(err) > LONGEST, f"it is {len(err)} characters long: {err[:200]!r}"),
        (re.search(case.said, err) is None, f"it does not say {case.said!r}, but {err[:400]!r}"),
        (left != [], f"it left {left}"),
    ):
        if wrong:
            words = " ".join(word if len(word) < 100 else f"{word[:100]}..." for word in case.words)
            return f"[{case.kind}] berteam {words!r}: {what}"
    return None
