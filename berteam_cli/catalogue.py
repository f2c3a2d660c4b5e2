"""What can be chosen, read from the yaml files alone: without Hydra, which takes a second to import.

So `--help`, `berteam list` and completion answer at once. What a config then really is, Hydra composes (compose.py).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

CONF = Path(str(files("berteam_cli.conf").joinpath("train.yaml"))).parent


def groups() -> list[str]:
    """Returns the config groups a user chooses from."""
    return sorted(path.name for path in CONF.iterdir() if path.is_dir() and any(path.glob("*.yaml")))


def choices(group: str) -> list[str]:
    """Returns the choices of a config group, none if there is no such group."""
    return sorted(path.stem for path in CONF.joinpath(group).glob("*.yaml"))


def about(group: str, option: str) -> str:
    """Returns the first comment of the choice's yaml file."""
    text = CONF.joinpath(group, f"{option}.yaml").read_text(encoding="utf-8")
    comments = [line[1:].strip() for line in text.splitlines() if line.startswith("#")]
    return next((line for line in comments if not line.startswith("@package")), "")


def help_text(command: str) -> str:
    """Returns what ``--help`` prints: the template in the command's yaml, with the choices of each group."""
    lines = [f"  {group}: {', '.join(choices(group))}" for group in groups()]
    template = read(CONF / f"{command}.yaml")["hydra"]["help"]["template"]
    return str(template).replace("$APP_CONFIG_GROUPS", "\n".join(lines))


def keys(command: str, chosen: Mapping[str, str]) -> dict[str, bool]:
    """Returns the dotted keys of a command's config, and of each whether others lie below it.

    Args:
        command: whose config it is.
        chosen: choices by group, where they are not the command's own; what is no choice is left aside.
    """
    path = CONF / f"{command}.yaml"
    if not path.exists():
        return {}
    content, there = read(path), set(groups()) - {"experiment"}
    taken = dict(entry for entry in defaults(content) if entry[0] in there)
    experiment = chosen.get("experiment", "")
    if experiment in choices("experiment"):
        taken |= chosen_by(experiment)
    taken |= {group: option for group, option in chosen.items() if group in taken}
    content.pop("hydra", None)
    for group, option in taken.items():
        content[group] = whole(group, option)
    return dict(dotted(content))


def chosen_by(experiment: str) -> dict[str, str]:
    """Returns the choices by group that an experiment makes, with those of the one that it begins with."""
    made = dict[str, str]()
    for group, option in defaults(read(CONF / "experiment" / f"{experiment}.yaml")):
        made |= {group.removeprefix("override /"): option} if group else chosen_by(option)
    return made


def whole(group: str, option: str) -> dict[str, Any]:
    """Returns the values of a choice, with those of the choices that it includes."""
    if option not in choices(group):
        return {}
    own, values = read(CONF / group / f"{option}.yaml"), dict[str, Any]()
    for name, included in defaults(own):
        other, _, place = name.partition("@")
        if not other:  # a choice of the same group that this one begins with
            values |= whole(group, included)
        elif other.startswith("/") and place:  # another group's, at a place of its own
            below = whole(other[1:], included)
            for key in reversed(place.split(".")):
                below = {key: below}
            merge(values, below)
    merge(values, own)
    return values


def defaults(content: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Takes the defaults list out of a yaml file's ``content``; yields group, "" for the file's own, and option."""
    for entry in content.pop("defaults", []):
        if isinstance(entry, dict):
            yield from ((str(group), str(option)) for group, option in entry.items())
        elif entry != "_self_" and not entry.startswith("/"):
            yield "", entry


def merge(values: dict[str, Any], others: Mapping[str, Any]) -> None:
    """Puts ``others`` over ``values``, key by key."""
    for key, value in others.items():
        if isinstance(value, Mapping) and isinstance(values.get(key), dict):
            merge(values[key], value)
        else:
            values[key] = value


def dotted(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, bool]]:
    """Yields the dotted keys of ``values``, and whether others lie below each."""
    for key, value in values.items():
        inner = isinstance(value, Mapping) and bool(value)
        yield f"{prefix}{key}", inner
        if inner:
            yield from dotted(value, f"{prefix}{key}.")


def read(path: Path) -> dict[str, Any]:
    """Returns what a yaml file of the package says."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # ten times as fast, where it was built
    return yaml.load(path.read_text(encoding="utf-8"), Loader=loader) or {}
