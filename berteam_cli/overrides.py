"""What the command line says after the sub-command, as Hydra reads it: flags, overrides, and the jobs of a sweep."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException

from berteam_cli.errors import InputError

UNUSED = {
    "config_path": "the yaml files are the package's; --config-dir DIR adds a folder of yours",
    "package": "every key has its place in the config; see --cfg job",
    "experimental_rerun": "it unpickles a file, which may run code in it; name the same overrides again",
}
"""Flags of Hydra that have no place here, and why."""


def arguments(words: list[str]) -> Any:
    """Returns Hydra's reading of the command line after the sub-command.

    Raises:
        InputError: it has a flag that does not exist.
    """
    parser = get_args_parser()
    parser.allow_abbrev = False  # one name for each flag

    def refuse(message: str) -> None:
        raise InputError(f"{message}; see --help.")

    parser.error = refuse  # type: ignore[assignment,method-assign]
    given = parser.parse_args(words)
    for name, why in UNUSED.items():
        if getattr(given, name, None):
            raise InputError(f"--{name.replace('_', '-')} cannot be used here: {why}.")
    said = [f"--{name}" for name in ("run", "multirun", "cfg", "info") if getattr(given, name)]
    if len(said) > 1:
        raise InputError(f"{' and '.join(said)} cannot be used together; use one of them.")
    if given.resolve and not given.cfg:
        raise InputError("--resolve is for --cfg job, which it lets print values in place of what stands for them.")
    return given


def parsed(overrides: list[str]) -> list[Override]:
    """Returns the overrides as Hydra reads them.

    Raises:
        InputError: one is not of the form key=value.
    """
    read: list[Override] = []
    for text in overrides:
        try:
            read += OverridesParser.create().parse_overrides([text])
        except HydraException as error:
            raise InputError(
                f"{text!r} cannot be read as key=value: {str(error).splitlines()[0].rstrip('.')}."
            ) from error
        except (ValueError, RecursionError) as error:  # of python itself, which says nothing of the key
            key = text.partition("=")[0]
            raise InputError(f"{key} cannot be read: its value is too long a number, or too deep a list.") from error
    return read


SHORT = {"selector.observations": "selector.observations.use"}
"""What may be said for a longer key: a part of the config stands for the one of its values that decides all others."""


def spelt_out(words: list[str]) -> list[str]:
    """Returns the words of a command line with SHORT keys replaced by the keys they stand for."""
    spelt = []
    for word in words:
        key, equals, value = word.partition("=")
        spelt.append(f"{SHORT.get(key, key)}={value}" if equals and not value.startswith("{") else word)
    return spelt


def jobs(overrides: list[Override], *, sweep: bool) -> Iterator[list[Override]]:
    """Yields lists of overrides in which every value of every sweep occurs once, the others at their first."""
    plain = [x for x in overrides if not (sweep and x.is_sweep_override())]
    values = [
        parsed([f"{x.get_key_element()}={value}" for value in x.sweep_string_iterator()])
        for x in overrides
        if sweep and (x.is_choice_sweep() or x.is_range_sweep())
    ]
    first = [options[0] for options in values]
    yield plain + first
    for k, options in enumerate(values):
        for other in options[1:]:
            yield [*plain, *first[:k], other, *first[k + 1 :]]
