"""Python and the packages, against what this package asks for."""

from __future__ import annotations

import platform
import shlex
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution, version

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from berteam_cli.health.finding import NOTE, OK, PROBLEM, Finding

US = "berteam-cli"
IMPORTED = ("torch", "numba", "hydra", "pettingzoo", "stable_baselines3", "pandas")
"""Packages with compiled parts, or that are known to break in their import."""


def python() -> Iterator[Finding]:
    """Yields whether this Python is one of those asked for."""
    asked, here = SpecifierSet(distribution(US).metadata["Requires-Python"] or ""), platform.python_version()
    if asked.contains(here, prereleases=True):
        yield Finding(OK, "python", here)
    else:
        yield Finding(PROBLEM, "python", f"{here} is not in {asked}", f"make an environment with a Python {asked}")


def requirements(extra: str = "") -> list[Requirement]:
    """Returns what the package asks for here, or what only its ``extra`` does."""
    asked = [Requirement(line) for line in distribution(US).requires or []]
    always = [item for item in asked if item.marker is None or item.marker.evaluate({"extra": ""})]
    if not extra:
        return always
    return [item for item in asked if item not in always and item.marker and item.marker.evaluate({"extra": extra})]


def wrong(item: Requirement) -> str:
    """Returns what is wrong with a package that is asked for, "" if nothing."""
    try:
        here = version(item.name)
    except PackageNotFoundError:
        return f"{item.name} is missing"
    fits = item.specifier.contains(here, prereleases=True)
    return "" if fits else f"{item.name} is {here}, but must be {item.specifier}"


def packages() -> Iterator[Finding]:
    """Yields the versions of all packages that are asked for, and whether those import that often do not."""
    right = []
    for item in requirements():
        said = wrong(item)
        if said:
            yield Finding(PROBLEM, "packages", said, f"pip install {shlex.quote(f'{item.name}{item.specifier}')}")
        else:
            right.append(f"{item.name} {version(item.name)}")
    yield Finding(OK, "packages", ", ".join(right))
    for name in IMPORTED:
        try:
            import_module(name)
        except Exception as error:  # a broken package may raise anything
            said = (
                f"{name} cannot be imported: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
            )
            yield Finding(PROBLEM, "packages", said, "install it anew with pip install --force-reinstall")


def extras() -> Iterator[Finding]:
    """Yields which extras are there, and how the others are installed; nothing needs them all."""
    there, names = [], distribution(US).metadata.get_all("Provides-Extra") or []
    for extra in sorted(name for name in names if name != "dev"):
        lacking = [said for item in requirements(extra) if (said := wrong(item))]
        if lacking:
            yield Finding(NOTE, "extras", f"{extra}: {', '.join(lacking)}", f"for it: pip install '{US}[{extra}]'")
        else:
            there.append(extra)
    if there:
        yield Finding(OK, "extras", ", ".join(there))
