"""Choices, keys and values that there are not."""

from __future__ import annotations

import random
from collections.abc import Iterator

from berteam_cli.bounds import LIMIT
from berteam_cli.cli import WORDS
from tests.wrong.known import Known, Wrong, at, misspelt, some


def wrong_commands(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields sub-commands that there are not."""
    for word in WORDS:
        yield Wrong("command", (misspelt(word, rng, WORDS),), rf"is no command; there are train, .*\b{word}\b")
    for word in (
        "",
        " ",
        "train ",
        "TRAIN",
        "tra in",
        "训练",
        "=",
        "selector=mcaa",
        "--",
        "-x",
        "x" * 9000,
        "\x1b[2J",
    ):
        yield Wrong("command", (word,), "is no command; there are train")


def wrong_choices(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields choices and groups that there are not."""
    for x in every:
        for group, of in x.groups.items():
            for choice in some(rng, of, 2):
                word = misspelt(choice, rng, of)
                yield Wrong(
                    "choice",
                    (x.command, *x.first, f"{group}={word}"),
                    rf"{group} must be one of .*{choice}.*Did you mean",
                )
            word = misspelt(group, rng, [*x.groups, *x.keys])
            said = rf"{word} is no key.*Did you mean {group}"
            yield Wrong("group", (x.command, *x.first, f"{word}={rng.choice(of)}"), said)
            yield Wrong("group", (x.command, *x.first, f"{group}="), group)
            yield Wrong("group", (x.command, *x.first, f"{group}=null"), group)
    for group in some(rng, every[0].groups, 6):
        yield Wrong(
            "group", ("list", misspelt(group, rng, every[0].groups)), f"group must be one of .*Did you mean {group}"
        )


def wrong_keys(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields keys that there are not."""
    for x in every:
        for key in some(rng, x.keys, 20 if x.command == "train" else 4):
            head, dot, last = key.rpartition(".")
            word = f"{head}{dot}{misspelt(last, rng, [*(k.rpartition('.')[2] for k in x.keys), *x.groups])}"
            yield Wrong("key", (x.command, *x.first, f"{word}=1"), rf"{at(word)} is no key .*Did you mean")


def wrong_types(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields values of another type than the key's."""
    for x in every:
        numbers = some(rng, x.bounds, 12 if x.command == "train" else 4)
        for key in numbers:
            value = rng.choice(("many", "[1,2]", "{a: 1}", "'1,5'", "0x1g", "--5", "1.2.3", "true", "[]"))
            yield Wrong("type", (x.command, *x.first, f"{key}={value}"), at(key))
        for key in some(rng, x.whole, 6 if x.command == "train" else 2):
            yield Wrong(
                "type", (x.command, *x.first, f"{key}={rng.choice(('1.5', '1e3.5', '3.0001', 'null'))}"), at(key)
            )


def out_of_bounds(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields numbers that are too small, too large or none."""
    for x in every:
        for key in some(rng, x.bounds, 30 if x.command == "train" else 6):
            low, high, open_low = x.bounds[key]
            wrong = [str(int(low) - 1), str(-(10**30)), str(10**30), str(int(high) + 1)]
            if key not in x.whole:
                wrong += ["nan", "inf", "-inf", "1e400", "-1e400", str(low) if open_low else str(low - 0.5)]
            value = rng.choice(wrong)
            limit = "" if high == LIMIT or value == "nan" else "(and <=|from .* to )"
            yield Wrong("bounds", (x.command, *x.first, f"{key}={value}"), rf"{at(key)}.*(must be .*{limit}|nan|large)")


def wrong_words(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields values that are none of the words a key takes."""
    for x in every:
        for key in some(rng, x.words, 8):
            allowed = x.words[key]
            word = misspelt(rng.choice(allowed), rng, allowed)
            yield Wrong("word", (x.command, *x.first, f"{key}={word}"), rf"{at(key)} must be one of .*but is '{word}'")
