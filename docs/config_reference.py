"""Writes every key of the configuration as a page: python docs/config_reference.py docs/config.md.

Types and bounds are those of the schemas, defaults and comments those of conf/.
"""

from __future__ import annotations

import dataclasses
import itertools
import re
import sys
import typing
from pathlib import Path
from types import UnionType
from typing import Any, NamedTuple

import yaml

from berteam_cli.bounds import LIMIT
from berteam_cli.config import MODULES, SCHEMAS

CONF = Path(__file__).parent.parent / "conf"
HEAD = """# Every key of the configuration

Made from the schemas and the yaml files by `make docs`; do not edit it. `berteam train --cfg job` prints the values of
a run before it begins, and `config.yaml` in its folder keeps them.

**Said** as `key=value`, in any order: `berteam train epochs=500 selector=mcaa selector.train_every=5`. A group
(`selector=mcaa`) takes all values of a file of `conf/`; a dotted key changes one of them. `null` is no value, `[a,b]` a
list, `{a: 1}` a mapping; the shell wants quotes around spaces (`'env.flag_homes_m=[[20, 50], [180, 50]]'`), and some
shells around any bracket.

**Allowed**: where there is no upper bound, none is needed, but no number may be above a thousand millions. A value of a
wrong type or out of its range, and a key that is not here, are refused with the nearest right one.

`berteam resume` takes `epochs`, `workers`, `checkpoint_every`, `evaluation.*` and `logger`; `berteam export` takes
`agent`, `out` and `on_exists`; `berteam inspect` takes `--top`; all of them `trust` (the words of a run's folder are
imported only if you say them, too).
"""
WORDS = {"bool": "true, false", "int": "whole number", "float": "number", "str": "text", "Any": "see the comment"}


class Entry(NamedTuple):
    """A key of a yaml file: its value as written, and the comment above it."""

    value: str
    comment: str


def entries(path: Path) -> dict[str, Entry]:
    """Returns the keys of a yaml file, dotted, in order, without Hydra's own and without a population's islands."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()

    def below(node: yaml.MappingNode, prefix: str) -> dict[str, Entry]:
        found: dict[str, Entry] = {}
        for key, value in node.value:
            if key.value in ("defaults", "hydra", "islands"):
                continue
            name = f"{prefix}{key.value}"
            if isinstance(value, yaml.MappingNode) and value.value:
                found |= below(value, f"{name}.")
            else:
                default = value.value if isinstance(value, yaml.ScalarNode) else yaml.safe_load(yaml.serialize(value))
                found[name] = Entry(shown(default), comment(lines[: key.start_mark.line]))
        return found

    return below(yaml.compose(text), "")


def comment(lines: list[str]) -> str:
    """Returns the comment that the last of ``lines`` are."""
    above = list(itertools.takewhile(lambda line: line.strip().startswith("#"), reversed(lines)))
    return " ".join(line.strip()[1:].strip() for line in reversed(above)) or "as above"


def title(path: Path) -> str:
    """Returns the first comment of a yaml file."""
    lines = (line[1:].strip() for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#"))
    said = next(line for line in lines if not line.startswith("@")).removeprefix(f"berteam {path.stem}: ")
    return said[0].upper() + said[1:]


def schema_field(schema: type, dotted: str) -> tuple[Any, dict[str, Any]]:
    """Returns the type and the bounds of a key of ``schema``."""
    name, _, rest = dotted.partition(".")
    hint = typing.get_type_hints(schema, {k: v for x in MODULES for k, v in vars(x).items()})[name]
    if rest:
        return schema_field(next(x for x in (typing.get_args(hint) or (hint,)) if dataclasses.is_dataclass(x)), rest)
    return hint, dict(next(x for x in dataclasses.fields(schema) if x.name == name).metadata)


def kind(hint: Any) -> str:
    """Returns a type in words."""
    if isinstance(hint, UnionType) or typing.get_origin(hint) is typing.Union:
        return ", or ".join(kind(x) for x in typing.get_args(hint) if x is not type(None)) + ", or null"
    if typing.get_origin(hint) is list:
        return f"list of {kind(typing.get_args(hint)[0])}s" if typing.get_args(hint)[0] is not str else "list of words"
    if typing.get_origin(hint) is dict:
        return "mapping"
    return WORDS.get(getattr(hint, "__name__", "Any"), "mapping")


def allowed(hint: Any, bounds: dict[str, Any]) -> str:
    """Returns the type of a key, and what of it is allowed."""
    if "allowed" in bounds:
        null = ", null" if "null" in kind(hint) else ""
        return ", ".join(f"`{x}`" for x in bounds["allowed"]) + null
    if "low" not in bounds:
        return kind(hint)
    low = f"{'> ' if bounds['open_low'] else '>= '}{plain(bounds['low'])}"
    high = f", <= {plain(bounds['high'])}" if bounds["high"] != LIMIT else ""
    what, null, _ = kind(hint).partition(", or null")
    return f"{what} {low}{high}{null}"


def plain(number: float) -> str:
    """Returns a bound as it is read."""
    return "2^63 - 1" if number == 2**63 - 1 else f"{number:g}" if number < 1e5 else f"{int(number)}"


def shown(value: Any) -> str:
    """Returns a value as it is said on the command line."""
    if isinstance(value, list):
        return "[" + ",".join(shown(x) for x in value) + "]"
    return str(value)


def rows(path: Path, schema: type, prefix: str = "") -> list[str]:
    """Returns the table of the keys of a yaml file."""
    lines = ["| key | default | allowed | what it is |", "|---|---|---|---|"]
    for key, entry in entries(path).items():
        if key == "name":
            continue
        default = "must be given" if entry.value == "???" else f"`{entry.value}`"
        said = entry.comment.replace("<", "&lt;")
        cells = [f"`{prefix}{key}`", default, allowed(*schema_field(schema, key)), said]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


def command_section(name: str) -> list[str]:
    """Returns the section of a command's own keys."""
    path = CONF / f"{name}.yaml"
    groups = [x for x in SCHEMAS if x in re.findall(r"^  - (\w+): ", path.read_text(encoding="utf-8"), flags=re.M)]
    also = f"Besides, the keys of {', '.join(f'[{x}](#{x})' for x in groups)}.\n" if groups else ""
    return [f"## berteam {name}", "", title(path), "", *rows(path, SCHEMAS["command"][name]), "", also]


def group_section(group: str) -> list[str]:
    """Returns the section of a group: its choices, and the keys of each."""
    lines = [f"## {group}", ""]
    for path in sorted((CONF / group).glob("*.yaml")):
        table = []
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
        schema = SCHEMAS[group].get(values.get("name", ""), next(iter(SCHEMAS[group].values())))
        if "name" not in values and path.stem not in SCHEMAS[group] and group != "population":
            schema = SCHEMAS[group][path.stem.partition("_")[0]]  # a choice that stands on another
            table = [f"All keys of `{group}={path.stem.partition('_')[0]}`, and of them with values of its own:", ""]
        lines += [f"### {group}={path.stem}", "", title(path), ""]
        if set(entries(path)) - {"name"}:
            lines += [*table, *rows(path, schema, f"{group}."), ""]
    return lines


def population() -> list[str]:
    """Returns the section of the population, whose keys are the user's own names."""
    island, member = (
        "| `population.islands.NAME.size` | members of the island | whole number >= 1, <= 100000 |",
        "| `population.islands.NAME.learner.KEY` | of its learner, as below | |",
    )
    lines = ["## population", "", "Islands by names of their own, whatever the choice:", ""]
    lines += ["| key | what it is | allowed |", "|---|---|---|", island, member]
    lines += ["| `population.members` | members from files: `[{file: a.zip, name: a, trust: false}]` | list |"]
    lines += [
        "| `population.run` | folder of a run whose members join as they are, learning no more | text, or null |",
        "",
    ]
    for path in sorted((CONF / "population").glob("*.yaml")):
        lines += [f"- `population={path.stem}`: {title(path)}"]
    return [*lines, ""]


def experiments() -> list[str]:
    """Returns the section of the experiments: what each of them sets."""
    lines = ["## experiment", "", "Values for several groups at once; what stands on the command line goes before.", ""]
    for path in sorted((CONF / "experiment").glob("*.yaml")):
        body = [x for x in path.read_text(encoding="utf-8").splitlines() if not x.startswith("#")]
        lines += [f"### experiment={path.stem}", "", title(path), "", "```yaml", *body, "```", ""]
    return lines


def page() -> str:
    """Returns the whole page."""
    lines = [HEAD]
    for name in SCHEMAS["command"]:
        lines += command_section(name)
    for group in SCHEMAS:
        if group not in ("command", "population") and (CONF / group).is_dir():
            lines += group_section(group)
    lines += population() + experiments()
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).rstrip() + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), encoding="utf-8")
