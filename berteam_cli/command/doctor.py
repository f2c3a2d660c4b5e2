"""berteam doctor: whether all is well here, and what to do where it is not.

It is asked when something is broken, so it prints plainly and imports only what it examines.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict

from berteam_cli.errors import RunError
from berteam_cli.health import machine, software
from berteam_cli.health.finding import PROBLEM, Finding

CHECKS: tuple[tuple[str, Callable[[], Iterator[Finding]]], ...] = (
    ("python", software.python),
    ("packages", software.packages),
    ("extras", software.extras),
    ("cores", machine.cores),
    ("threads", machine.threads),
    ("device", machine.device),
    ("kernels", machine.kernels),
    ("memory", machine.memory),
    ("disk", machine.disk),
    ("outputs", machine.outputs),
    ("text", machine.text),
)


def doctor(*, as_json: bool) -> None:
    """Prints what is found, a line each.

    Args:
        as_json: prints a list of objects instead, when all is done.

    Raises:
        RunError: there is a problem.
    """
    found: list[Finding] = []
    for subject, check in CHECKS:
        for finding in examined(subject, check):
            found.append(finding)
            if not as_json:
                print(finding, flush=True)
    if as_json:
        print(json.dumps([asdict(finding) for finding in found], indent=1))
    problems = [finding.subject for finding in found if finding.status == PROBLEM]
    if problems:
        raise RunError(f"Not all is well: {', '.join(dict.fromkeys(problems))}.")


def examined(subject: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Yields what a check finds; that it fails is a finding too."""
    try:
        yield from check()
    except Exception as error:  # whatever is broken must be told
        said = f"{type(error).__name__}: {error}"
        yield Finding(PROBLEM, subject, f"could not be examined: {said}", "mend what the lines above complain of first")
