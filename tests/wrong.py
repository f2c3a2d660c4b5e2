"""Wrong command lines, made by a generator from a seed, and the check that each is refused cleanly.

``cases`` makes them from what can be said rightly: the words, groups, choices, keys and bounds of the configuration.
``fault`` runs one in an empty folder and tells what was wrong with how it was refused.
"""

from __future__ import annotations

import io
import os
import random
import re
import string
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

from hydra import compose, initialize_config_module
from omegaconf import OmegaConf

from berteam_cli import cli
from berteam_cli.bounds import LIMIT
from berteam_cli.cli import WORDS
from berteam_cli.compose import CONF, choices, groups, keys, prepare
from berteam_cli.config import checked

SEED = 20250
LONGEST = 4000  # characters of an error: a list of all keys of a group, and no more


class Wrong(NamedTuple):
    """A wrong command line.

    Attributes:
        kind: of mistake.
        words: after ``berteam``.
        said: a pattern that the error must have: the key, and what is right.
    """

    kind: str
    words: tuple[str, ...]
    said: str


class Known(NamedTuple):
    """What can be said to a command.

    Attributes:
        command: its word.
        first: words that it must have.
        groups: choices of each of its groups.
        keys: dotted keys of its values.
        bounds: low, high and whether low itself is out, by key of a number.
        words: allowed words by key.
        whole: keys of whole numbers.
    """

    command: str
    first: tuple[str, ...]
    groups: dict[str, list[str]]
    keys: list[str]
    bounds: dict[str, tuple[float, float, bool]]
    words: dict[str, tuple[str, ...]]
    whole: set[str]


FIRST = {
    "train": ("population=ppo6",),
    "tournament": (),
    "replay": (),
    "evaluate": ("nowhere",),
    "compare": ("nowhere", "nobody"),
    "report": ("nowhere",),
    "reproduce": ("paper_fixed",),
}
"""Commands with a config, and their first words. They find out that there is no such run after they read the rest."""


def known(command: str) -> Known:
    """Returns what can be said to ``command``, read from its schemas and yaml files."""
    prepare()
    lead = {"train": ["population=ppo6"], "evaluate": ["run=x"], "compare": ["runs=[x,y]"], "report": ["runs=[x]"], "reproduce": ["what=paper_fixed"]}
    with initialize_config_module(CONF, version_base="1.3"):
        config = compose(command, overrides=lead.get(command, []))
        every = [key for key in keys(config) if not OmegaConf.is_dict(OmegaConf.select(config, key))]
        every = [key for key in every if ".learner." not in key]  # which is the key learner again
        of = {group: choices(group) for group in groups() if group in config or (command, group) == ("train", "experiment")}
    found = Known(command, FIRST[command], of, every, {}, {}, set())
    collect(checked(config), "", found)
    return found


def collect(value: Any, key: str, found: Known) -> None:
    """Adds the bounds and words of the schema of ``value`` and all below it to ``found``."""
    if isinstance(value, dict):
        for name, item in value.items():
            collect(item, f"{key}.{name}", found)
    if not is_dataclass(value):
        return
    for item in fields(value):
        if item.name == "learner" and key:
            continue
        if found.command == "reproduce" and item.name == "what":
            continue  # which is its first word
        path, given = f"{key}.{item.name}".lstrip("."), getattr(value, item.name)
        collect(given, path, found)
        if "allowed" in item.metadata:
            found.words[path] = item.metadata["allowed"]
        if "low" in item.metadata:
            found.bounds[path] = tuple(item.metadata[x] for x in ("low", "high", "open_low"))
            if isinstance(given, int):
                found.whole.add(path)


def misspelt(word: str, rng: random.Random, others: Any = ()) -> str:
    """Returns ``word`` with one slip of the fingers, which makes none of ``others`` of it."""
    while True:
        at, letter = rng.randrange(len(word)), rng.choice(string.ascii_lowercase)
        slips = (
            word[:at] + word[at + 1 :],
            word[:at] + letter + word[at:],
            word[:at] + letter + word[at + 1 :],
            word[:at] + word[at + 1 : at + 2] + word[at] + word[at + 2 :],
        )
        slip = rng.choice(slips)
        if slip not in {word, "", *others} and slip[0].isalpha():
            return slip


def cases(seed: int = SEED) -> list[Wrong]:
    """Returns the wrong command lines of ``seed``, no two of them the same."""
    rng = random.Random(seed)
    every = [known(command) for command in FIRST]
    makers: tuple[Callable[[list[Known], random.Random], Iterator[Wrong]], ...] = (
        *(wrong_commands, wrong_choices, wrong_keys, wrong_types, out_of_bounds, wrong_words, contradictions),
        *(odd_text, broken_grammar, paths, flags, overrides),
    )
    made = {(case.words): case for maker in makers for case in maker(every, rng)}
    return list(made.values())


def at(key: str) -> str:
    """Returns a pattern that finds ``key``."""
    return re.escape(key)


def some(rng: random.Random, items: Any, most: int) -> list[Any]:
    """Returns ``most`` of the items, or all."""
    items = sorted(items)
    return rng.sample(items, min(most, len(items)))


def wrong_commands(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields sub-commands that there are not."""
    for word in WORDS:
        yield Wrong("command", (misspelt(word, rng, WORDS),), rf"is no command; there are train, .*\b{word}\b")
    for word in ("", " ", "train ", "TRAIN", "tra in", "训练", "=", "selector=mcaa", "--", "-q", "-x", "x" * 9000, "\x1b[2J"):
        yield Wrong("command", (word,), "is no command; there are train")


def wrong_choices(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields choices and groups that there are not."""
    for x in every:
        for group, of in x.groups.items():
            for choice in some(rng, of, 2):
                word = misspelt(choice, rng, of)
                yield Wrong("choice", (x.command, *x.first, f"{group}={word}"), rf"{group} must be one of .*{choice}.*Did you mean")
            word = misspelt(group, rng, [*x.groups, *x.keys])
            said = rf"{word} is no key.*Did you mean {group}"
            yield Wrong("group", (x.command, *x.first, f"{word}={rng.choice(of)}"), said)
            yield Wrong("group", (x.command, *x.first, f"{group}="), group)
            yield Wrong("group", (x.command, *x.first, f"{group}=null"), group)
    for group in some(rng, every[0].groups, 6):
        yield Wrong("group", ("list", misspelt(group, rng, every[0].groups)), f"group must be one of .*Did you mean {group}")


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
            yield Wrong("type", (x.command, *x.first, f"{key}={rng.choice(('1.5', '1e3.5', '3.0001', 'null'))}"), at(key))


def out_of_bounds(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields numbers that are too small, too large or none."""
    for x in every:
        for key in some(rng, x.bounds, 30 if x.command == "train" else 6):
            low, high, open_low = x.bounds[key]
            wrong = [str(int(low) - 1), str(-(10**30)), str(10**30), str(int(high) + 1)]
            if key not in x.whole:
                wrong += ["nan", "inf", "-inf", "1e400", "-1e400", str(low) if open_low else str(low - 0.5)]
            value = rng.choice(wrong)
            limit = "" if high == LIMIT or value == "nan" else "and <="
            yield Wrong("bounds", (x.command, *x.first, f"{key}={value}"), rf"{at(key)}.*(must be >.*{limit}|nan|large)")


def wrong_words(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields values that are none of the words a key takes."""
    for x in every:
        for key in some(rng, x.words, 8):
            allowed = x.words[key]
            word = misspelt(rng.choice(allowed), rng, allowed)
            yield Wrong("word", (x.command, *x.first, f"{key}={word}"), rf"{at(key)} must be one of .*but is '{word}'")


RPS = ("train", "env=rps", "population=ppo6")
CONTRADICTIONS: dict[tuple[str, ...], str] = {
    ("train", "optimizer=fixed", "optimizer.replacements=1"): "optimizer.replacements is no key",
    ("train", "selector=uniform", "selector.learning_rate=1"): "selector.learning_rate is no key",
    ("train", "learner=dqn", "population=ppo6", "learner.clip_range=1"): "learner.clip_range is no key",
    ("train", "env=rps", "env.max_time_s=60"): "env.max_time_s is no key",
    ("train", "env=mctf", "env.sides=3"): "env.sides is no key",
    ("train", "env=pettingzoo"): "env.target must be the MODULE:FUNCTION",
    ("train", "env=rps", "env.sides=9"): "env.sides must be >= 2 and <= 8",
    ("train", "logger=csv", "logger.project=x"): "logger.project is no key",
    ("train", "population=hands"): "population|policies",
    ("train", "team_size=61", "population=ppo6"): "team_size must be at most 6",
    (*RPS, "selector.observations=previous_game", "games_per_epoch=3"): "games_per_epoch must be even",
    (*RPS, "selector.batch_size=100", "selector.minibatch_size=33"): "selector.minibatch_size",
    (*RPS, "selector.width=30", "selector.heads=4"): "selector.*heads",
    (*RPS, "optimizer=mapelites", "optimizer.opponents=[random]"): "optimizer.opponents.*rock",
    (*RPS, "selector.valid_members=[[0],[9]]"): r"selector.valid_members\[1\]",
    (*RPS, "selector.valid_members=3"): "selector.valid_members",
    ("tournament", "teams=[0-1]"): r"teams=\['0-1'\] gives 1 team",
    ("tournament", "fixed=true", "policies=[]", "teams=[0-1,0-1]"): "teams must name each team once",
    ("tournament", "env=rps", "policies=[rock,papr]"): "policies .*Did you mean paper",
    ("tournament", "run=[a,a]"): "run must name each run once",
    ("tournament", "run={a: 1}"): "run must be a folder or a list of folders",
    ("tournament", "team_size=7", "games_per_pair=1000"): "team_size=7 gives",
    ("replay", "blue=0-1"): "red must name a team",
    ("replay", "blue=0-1", "red=0-1-2"): "red must be 2 members",
    ("replay", "blue=0-1", "red=atack_hard-random"): "A member of red must be one of .*Did you mean attack_hard",
    ("replay", "blue=0-99", "red=0-1"): "A member of blue must be one of",
    ("replay", "env=rps", "blue=0-1", "red=0-1"): "Only games of env=mctf",
    ("replay", "blue=0-1", "red=2-3", "out=x.gif"): "out=x.gif does not go with format=html",
    ("replay", "nowhere", "env=rps"): "env has no effect with run=nowhere",
    ("replay", "nowhere", "run=nobody"): "The run is named twice",
    ("compare", "nowhere"): "compare needs two runs at least",
    ("compare", "nowhere", "./nowhere"): "nowhere",
    ("compare", "nowhere", "nobody", "runs=[a]"): "named twice",
    ("report", "nowhere", "nowhere"): "The run nowhere is named twice",
    ("reproduce", "paper_fixed", "what=paper_fixed"): "named twice",
    ("reproduce", "paper_fixed", "seeds=[]"): "seeds",
    ("reproduce", "paper_fixed", "seeds=[1,1]"): "seeds",
    ("reproduce", "paper_fixed", "seeds=[-1]"): "seeds",
    ("reproduce", "paper_fixed", "seeds=[one]"): "seeds",
    ("reproduce", "paper_fixed", "seeds=1"): "seeds",
    ("export", "nowhere", "agent=-1"): "nowhere|agent",
    ("export", "nowhere", "agnet=1"): "agnet is no key of berteam export.*Did you mean agent",
    ("export", "nowhere"): "agent must say which member",
    ("export", "nowhere", "agent=1", "on_exists=ask"): "on_exists must be one of error, overwrite",
    ("train", "-m", "seed=1,2", "out=x"): "out is one folder",
    ("train", "-m", "seed=1,-2"): "seed must be >= 0, but is -2",
    ("train", "-m", "selector=mcaa,unifrom"): "Did you mean uniform",
    ("train", "-m", "epochs=range(-3,3)"): "epochs must be >= 0",
    ("train", "device=cuda:0"): "device must be one of auto, cpu, cuda",
    ("train", "on_exists=resume", "out=nowhere", "epochs=0.5"): "epochs",
}


def contradictions(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields settings that do not go together."""
    for words, said in CONTRADICTIONS.items():
        yield Wrong("contradiction", words, said)


ODD = (
    *("\x1b[31mred", "a\tb", "a\nb", "\r", "\u202eabc", "\x07", "\x7f", "\ufeff", "a\u200bb", "\udce9", "\ud83e"),
    *("größer", "十", "٣", "½", "🤖", "e\u0301", "ＭＣＡＡ", "' '", "''", '""', " ", "\\", "%s", "{}", "$HOME", "`id`", "$(id)"),
    *("None", "null", "~", "!!python/object/apply:os.system", "=HYPERLINK(1)", "<b>", "[bold]", "../../x", "x" * 300),
)
HUGE = ("9" * 5000, "1" + "0" * 400, "x" * 30_000, "[" * 400 + "]" * 400, "{a: " * 200 + "1" + "}" * 200, "0." + "1" * 3000)


def odd_text(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields text that nobody types: signs of other scripts, those a terminal obeys, nothing, and very much."""
    train, others = every[0], every[1:]
    for text in ODD:
        key = rng.choice(sorted(train.bounds))
        if text != "null" and text != "None" or key in train.whole:
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
    *("{k}=[1,2", "{k}={{a:1", "{k}='1", '{k}="1', "{k}==1", "=1", "+{k}=1", "++", "~", "~~{k}", "+=1", "{k}=1]", "{k}=)"),
    *("{k}=(1", "{k}=[1,,2]", "{k}=,", "{k}=1,", "{k}:1", "{k} = ", "{k}", "-{k}=1", ".{k}=1", "{k}.=1", "{k}..x=1"),
    *("{k}@pkg=1", "{g}@pkg=", "{g}@pkg=nothing", "{g}@a:b=x", "~{k}=nothing", "~nothing", "~{g}=nothing", "+{g}=mcca"),
    *("{k}=${{nothing}}", "{k}=${{oc.env:NO_SUCH_THING}}", "{k}=${{oc.env:", "{k}=${{no_resolver:1}}", "{k}=${{{k}}}"),
    *("{k}=choice(", "{k}=choice()", "{k}=range()", "{k}=range(1,a)", "{k}=glob(*", "{k}=nothing(1)", "{k}=interval(1,2)"),
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


def paths(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields folders and files that are not there."""
    gone = ("nowhere", "no/where", "/no/where", "../nowhere", ".", "/proc/self/mem", "/dev/null", "~/nowhere", "a" * 300, "no where")
    for place in gone:
        for command in some(rng, ("resume", "inspect", "evaluate", "report", "export", "replay"), 2):
            rest = ("agent=0",) if command == "export" else ()
            yield Wrong("path", (command, place, *rest), "is no folder of a run|cannot be read")
        quoted = place.replace("'", "\\'")
        yield Wrong("path", ("tournament", f"run='{quoted}'"), "is no folder of a run|cannot be read")
    for command in ("resume", "inspect", "export", "evaluate", "report", "compare", "reproduce"):
        yield Wrong("path", (command,), "required: run|must be given first|needs")
    for place in ("/proc/none", "/dev/null/x", "/nowhere/x/y", "a" * 300, "/"):
        yield Wrong("path", ("train", *RPS[1:], "epochs=0", f"out={place}/z"), "out=.*cannot be written")
    yield Wrong("path", ("report", "nowhere", "compare=nobody"), "compare=nobody is no folder that berteam compare wrote")
    for place in ("gone.zip", ".", "/dev/null", "a" * 300 + ".zip", "/dev/full"):
        yield Wrong("path", (*RPS, f"population.members=[{{file: {place}, name: x}}]"), rf"population.members\[0\].file={place[:50]}")


def flags(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields flags that there are not, or that lack something."""
    for x in every:
        yield Wrong("flag", (x.command, *x.first, f"--{misspelt('multirun', rng)}"), "unrecognized|ambiguous|--")
    for words in (
        *(("train", "--config-dir"), ("train", "--config-dir", "nowhere"), ("train", "--config-dir", "/dev/null")),
        *(("train", "--config-name", "nothing"), ("train", "--config-name"), ("train", "--cfg"), ("train", "--cfg", "jbo")),
        *(("train", "--info", "nothing"), ("train", "--package", "x"), ("train", "-cp", "nowhere"), ("train", "-z")),
        *(("inspect", ".", "--top"), ("inspect", ".", "--top", "ten"), ("inspect", ".", "--top", "-3"), ("inspect", "a", "b")),
        *(("inspect", ".", "--tpo", "3"), ("list", "env", "more"), ("list", "--all"), ("resume", "a", "--force")),
        *(("export", "a", "agent=1", "--out", "x"), ("evaluate", "a", "-m"), ("reproduce", "paper_fixed", "-m")),
    ):
        yield Wrong("flag", words, ".")


def overrides(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields what resume and export are told wrongly."""
    for key in ("seed", "env", "team_size", "selector", "epoch", "worker", "Epochs", "", "hydra.run.dir", "out"):
        yield Wrong("override", ("resume", "nowhere", f"{key}=1"), ".")
    for word in ("agent", "agent==1", "=1", "agent=", "out=x", "agent=1,2", "agent=1e3", "+agent=1", "on_exists=resume"):
        yield Wrong("override", ("export", "nowhere", word), ".")


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
            return f"[{case.kind}] berteam {' '.join(x if len(x) < 100 else x[:100] + '...' for x in case.words)!r}: {what}"
    return None
