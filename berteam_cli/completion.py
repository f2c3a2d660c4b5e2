"""Completes command lines: what the shells ask at every press of Tab, so nothing slow is imported here.

A shell's script calls ``berteam --complete WORD ...`` with the words after the command, the last of them not yet
complete, and gets one answer a line, with a tab and an explanation behind it where there is one. An answer that ends in
``=``, ``.`` or ``/`` is not the whole word.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from berteam_cli import catalogue

RUNS = ("resume", "inspect", "export", "evaluate", "compare", "report", "replay")
"""Commands whose first words are folders."""
SEVERAL = ("compare", "report")
FOLDERS = ("run", "runs", "resume", "out", "compare", "hydra.sweep.dir")
"""Keys whose values are folders."""
KEYS = {
    "resume": ("epochs=", "workers=", "checkpoint_every=", "evaluation.", "logger="),
    "export": ("agent=", "out=", "on_exists="),
}
"""Keys of the commands without a yaml file of their own."""
FLAGS = {
    "": ("--help", "--version", "--quiet"),
    "inspect": ("--help", "--quiet", "--top"),
    "doctor": ("--help", "--quiet", "--json"),
    "composed": ("--help", "--quiet", "--cfg", "--info", "--config-dir"),
    "train": ("--multirun",),
}
AFTER = {"--cfg": ("job", "hydra", "all"), "-c": ("job", "hydra", "all")}
VALUES = {"on_exists": ("error", "overwrite", "resume"), "device": ("cpu", "cuda", "auto")}
SHELLS = ("bash", "zsh", "fish")

Answers = Iterator[tuple[str, str]]


def answer(words: list[str], commands: Mapping[str, str]) -> None:
    """Prints the answers to ``words``, of which the last may be empty."""
    *before, begun = words or [""]
    for word, explained in answers(before, begun, commands):
        if word.startswith(begun):
            print(word, explained, sep="\t" if explained else "")


def answers(before: list[str], begun: str, commands: Mapping[str, str]) -> Answers:
    """Yields whole words and what they mean; not all of them begin as ``begun`` does.

    Args:
        before: the words in front of it.
        begun: the word to complete.
        commands: the sub-commands, and what they do.
    """
    given = [word for word in before if not word.startswith("-")]
    if not given:
        yield from flags("") if begun.startswith("-") else commands.items()
        return
    command = given[0]
    if command not in commands:
        return
    if before[-1] in AFTER:
        yield from ((value, "") for value in AFTER[before[-1]])
    elif before[-1] == "--config-dir":
        yield from folders(begun)
    elif begun.startswith("-"):
        yield from flags(command)
    elif "=" in begun:
        yield from values(*begun.split("=", maxsplit=1))
    else:
        yield from first_words(command, given[1:], begun)
        yield from keys(command, given[1:], begun)


def flags(command: str) -> Answers:
    """Yields the flags of a command."""
    composed = catalogue.CONF.joinpath(f"{command}.yaml").exists()
    own = FLAGS.get(command, () if composed else FLAGS[""][::2])
    yield from ((flag, "") for flag in ((*FLAGS["composed"], *own) if composed else own))


def first_words(command: str, given: list[str], begun: str) -> Answers:
    """Yields what stands before the overrides: folders of runs, a group, a shell, an experiment."""
    named = [word for word in given if "=" not in word]
    if command in RUNS and len(named) == len(given) and (command in SEVERAL or not named):
        yield from folders(begun)
    elif given:
        return
    elif command == "list":
        yield from ((group, ", ".join(catalogue.choices(group))) for group in catalogue.groups())
    elif command == "completion":
        yield from ((shell, "") for shell in SHELLS)
    elif command == "reproduce":
        papers = [name for name in catalogue.choices("experiment") if name.startswith("paper_")]
        yield from ((name, catalogue.about("experiment", name)) for name in papers)
    elif not catalogue.CONF.joinpath(f"{command}.yaml").exists():
        yield from folders(begun)


def keys(command: str, given: list[str], begun: str) -> Answers:
    """Yields keys: those of the level of dots that ``begun`` is at, and the groups."""
    yield from ((key, "") for key in KEYS.get(command, ()))
    chosen = dict(word.split("=", maxsplit=1) for word in given if "=" in word)
    known = catalogue.keys(command, chosen)
    level, groups = begun.count("."), catalogue.groups()
    for key, inner in known.items():
        if key.count(".") == level:
            if key in groups:
                yield f"{key}=", ", ".join(catalogue.choices(key))
            yield (f"{key}.", "keys below") if inner else (f"{key}=", "")
    if command == "train" and not level:
        yield "experiment=", ", ".join(catalogue.choices("experiment"))


def values(key: str, begun: str) -> Answers:
    """Yields ``key=value`` for the values there are to choose from; behind a comma the next of a sweep."""
    first = f"{key}={begun[: begun.rfind(',') + 1]}"
    if key in FOLDERS:
        yield from ((f"{key}={folder}", what) for folder, what in folders(begun))
    elif key in catalogue.groups():
        yield from ((f"{first}{option}", catalogue.about(key, option)) for option in catalogue.choices(key))
    else:
        yield from ((f"{key}={value}", "") for value in VALUES.get(key, ()))


def folders(begun: str) -> Answers:
    """Yields the folders that begin so: a run is a whole word, another folder may have runs below it."""
    place = Path(begun[: begun.rfind("/") + 1] or ".").expanduser()
    prefix = begun[: begun.rfind("/") + 1]
    try:
        found = sorted(path for path in place.iterdir() if path.is_dir() and not path.name.startswith("."))
    except OSError:
        return
    for path in found:
        run = (path / "manifest.json").exists() or (path / "sweep.csv").exists()
        yield f"{prefix}{path.name}{'' if run else '/'}", "run" if run else ""


BASH = r"""# berteam: completion for bash. Use: eval "$(berteam completion bash)"
_berteam() {
    local line="${COMP_LINE:0:COMP_POINT}" words word reply
    read -ra words <<< "$line"
    [[ $line == *[[:space:]] ]] && words+=("")
    word="${words[${#words[@]} - 1]}"
    # Bash replaces $2 alone: the part of the word behind its last = or :
    local kept="${word%"$2"}"
    COMPREPLY=()
    while IFS=$'\t' read -r reply _; do
        [[ $reply == *[=./] ]] && compopt -o nospace 2> /dev/null
        printf -v reply '%q' "${reply#"$kept"}"
        COMPREPLY+=("$reply")
    done < <("${1/#\~/$HOME}" --complete "${words[@]:1}" 2> /dev/null)
}
complete -F _berteam berteam"""

ZSH = r"""#compdef berteam
# berteam: completion for zsh, after compinit. Use: eval "$(berteam completion zsh)"
_berteam() {
    local line word explained
    local -a whole parts
    for line in "${(@f)$("${(Q)words[1]/#\~/$HOME}" --complete "${(@Q)words[2,CURRENT]}" 2> /dev/null)}"; do
        [[ -n $line ]] || continue
        word=${line%%$'\t'*}
        explained=${${line#"$word"}#$'\t'}
        if [[ $word == *[=./] ]]; then
            parts+=("${word//:/\\:}:$explained")
        else
            whole+=("${word//:/\\:}:$explained")
        fi
    done
    _describe -V 'berteam' whole -- parts -S ''
}
(( $+functions[compdef] )) && compdef _berteam berteam"""

FISH = r"""# berteam: completion for fish. Use: berteam completion fish | source
function __berteam_complete
    set -l words (commandline -opc)
    set -l program (string replace -r '^~' $HOME -- $words[1])
    $program --complete $words[2..-1] (commandline -ct) 2> /dev/null
end
complete -c berteam -f -a '(__berteam_complete)'"""

SCRIPTS = {"bash": BASH, "zsh": ZSH, "fish": FISH}
