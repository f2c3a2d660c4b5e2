"""Text that nobody types, and text that is no override."""

from __future__ import annotations

import random
from collections.abc import Iterator

from tests.wrong.known import Known, Wrong, at, some

ODD = (
    *("\x1b[31mred", "a\tb", "a\nb", "\r", "\u202eabc", "\x07", "\x7f", "\ufeff", "a\u200bb", "\udce9", "\ud83e"),
    *(
        "größer",
        "十",
        "٣",
        "½",
        "🤖",
        "e\u0301",
        "ＭＣＡＡ",
        "' '",
        "''",
        '""',
        " ",
        "\\",
        "%s",
        "{}",
        "$HOME",
        "`id`",
        "$(id)",
    ),
    *("None", "null", "~", "!!python/object/apply:os.system", "=HYPERLINK(1)", "<b>", "[bold]", "../../x", "x" * 300),
)
HUGE = (
    "9" * 5000,
    "1" + "0" * 400,
    "x" * 30_000,
    "[" * 400 + "]" * 400,
    "{a: " * 200 + "1" + "}" * 200,
    "0." + "1" * 3000,
)


def odd_text(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields text that nobody types: signs of other scripts, those a terminal obeys, nothing, and very much."""
    train, others = every[0], every[1:]
    for text in ODD:
        key = rng.choice(sorted(train.bounds))
        if text != "null" or key in train.whole:
            yield Wrong("text", ("train", *train.first, f"{key}={text}"), rf"{at(key)}|cannot be read as key=value")
    for text in some(rng, ODD, 12):
        group = rng.choice(sorted(train.groups))
        yield Wrong("text", ("train", f"{group}={text}"), rf"{group}|cannot be read as key=value")
    for text in some(rng, ODD, 12):
        yield Wrong("text", ("train", f"{text}=1"), ".")
    for text in some(rng, ODD, 8):
        yield Wrong("text", ("train", text), ".")
    for text in HUGE:
        x = rng.choice(others)
        yield Wrong("huge", ("train", f"{rng.choice(sorted(train.whole))}={text}"), ".")
        yield Wrong("huge", (x.command, *x.first, f"{rng.choice(sorted(x.bounds))}={text}"), ".")
        yield Wrong("huge", ("train", f"selector={text}"), ".")
        yield Wrong("huge", ("train", f"{text}=1"), ".")
    for key in some(rng, train.whole, 5):
        yield Wrong("empty", ("train", f"{key}="), at(key))
    for command in ("resume", "inspect", "export", "evaluate", "report"):
        rest = ("agent=0",) if command == "export" else ()
        for text in some(rng, ODD, 3):
            yield Wrong("text", (command, text, *rest), ".")
        yield Wrong("huge", (command, "x" * 6000, *rest), ".")
    for word in ("", "selector\n", "\x1b]0;x\x07"):
        yield Wrong("text", ("list", word), "group must be one of")


GRAMMAR = (
    *(
        "{k}=[1,2",
        "{k}={{a:1",
        "{k}='1",
        '{k}="1',
        "{k}==1",
        "=1",
        "+{k}=1",
        "++",
        "~",
        "~~{k}",
        "+=1",
        "{k}=1]",
        "{k}=)",
    ),
    *("{k}=(1", "{k}=[1,,2]", "{k}=,", "{k}=1,", "{k}:1", "{k} = ", "{k}", "-{k}=1", ".{k}=1", "{k}.=1", "{k}..x=1"),
    *("{k}@pkg=1", "{g}@pkg=", "{g}@pkg=nothing", "{g}@a:b=x", "~{k}=nothing", "~nothing", "~{g}=nothing", "+{g}=mcca"),
    *("{k}=${{nothing}}", "{k}=${{oc.env:NO_SUCH_THING}}", "{k}=${{oc.env:", "{k}=${{no_resolver:1}}", "{k}=${{{k}}}"),
    *(
        "{k}=choice(",
        "{k}=choice()",
        "{k}=range()",
        "{k}=range(1,a)",
        "{k}=glob(*",
        "{k}=nothing(1)",
        "{k}=interval(1,2)",
    ),
    *("{k}=sort(3,1)", "{k}=int(x)", "{k}=\\", "{k}[0]=1", "{k}.deeper=1", "+{k}.deeper=1", "++{k}.deeper=1"),
)


def broken_grammar(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields what is no override."""
    for x in (every[0], rng.choice(every[1:])):
        for form in GRAMMAR:
            if "{g}" in form and x.command != "train":
                continue
            key, group = rng.choice(sorted(x.whole)), rng.choice(sorted(every[0].groups.keys() - {"experiment"}))
            yield Wrong("grammar", (x.command, *x.first, form.format(k=key, g=group)), ".")
