"""Settings that do not go together, paths that lead nowhere, flags that there are not."""

from __future__ import annotations

import random
from collections.abc import Iterator

from tests.wrong.known import Known, Wrong, misspelt, some

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
    ("train", "team_size=7", "population=ppo6"): "team_size must be at most 6",
    ("train", "team_size=50", "population=ppo50"): "env.team_size must be at most 49, so that nobody starts",
    (*RPS, "learner=fixed"): "learner.policies must name 6 of rock, paper, scissors, one for each member, but is empty",
    (*RPS, "learner=fixed", "learner.policies=[rock]"): "main.size must be 1, as learner.policies names so many",
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
    ("reproduce", "paper_fixed", "seeds=[-1]"): "seeds? must be",
    ("reproduce", "paper_fixed", "seeds=[one]"): "seeds",
    ("reproduce", "paper_fixed", "seeds=1"): "seeds",
    ("export", "nowhere", "agent=-1"): "nowhere|agent",
    ("export", "nowhere", "agnet=1"): "agnet is no key of berteam export.*Did you mean agent",
    ("export", "nowhere"): "agent must say which member",
    ("export", "nowhere", "agent=1", "on_exists=ask"): "on_exists must be one of error, overwrite",
    ("train", "-m", "seed=1,2", "out=x"): "out is one folder",
    ("train", "-m", "seed=1,-2"): "seed must be >= 0 .*but is -2",
    ("train", "-m", "selector=mcaa,unifrom"): "Did you mean uniform",
    ("train", "-m", "epochs=range(-3,3)"): "epochs must be >= 0",
    ("train", "device=cuda:0"): "device must be one of auto, cpu, cuda",
    ("train", "on_exists=resume", "out=nowhere", "epochs=0.5"): "epochs",
}


def contradictions(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields settings that do not go together."""
    for words, said in CONTRADICTIONS.items():
        yield Wrong("contradiction", words, said)


def paths(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields folders and files that are not there."""
    gone = (
        "nowhere",
        "no/where",
        "/no/where",
        "../nowhere",
        ".",
        "/proc/self/mem",
        "/dev/null",
        "~/nowhere",
        "a" * 300,
        "no where",
    )
    for place in gone:
        for command in some(rng, ("resume", "inspect", "evaluate", "report", "export", "replay"), 2):
            rest = ("agent=0",) if command == "export" else ()
            yield Wrong("path", (command, place, *rest), "is no folder of a run|cannot be read")
        quoted = place.replace("'", "\\'")
        yield Wrong("path", ("tournament", f"run='{quoted}'"), "is no folder of a run|cannot be read")
    for command in ("resume", "inspect", "export", "evaluate", "report", "compare", "reproduce"):
        yield Wrong("path", (command,), "required: run|must be given first|needs")
    for place in ("/proc/none", "/dev/null/x", "/proc/self/x/y", "a" * 300, "/proc/1"):
        yield Wrong("path", ("train", *RPS[1:], "epochs=0", f"out={place}/z"), "out=.*cannot be written")
    yield Wrong(
        "path", ("report", "nowhere", "compare=nobody"), "compare=nobody is no folder that berteam compare wrote"
    )
    for place in ("gone.zip", ".", "/dev/null", "a" * 300 + ".zip", "/dev/full"):
        yield Wrong(
            "path",
            (*RPS, f"population.members=[{{file: {place}, name: x}}]"),
            rf"population.members\[0\].file={place[:50]}",
        )


def flags(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields flags that there are not, or that lack something."""
    for x in every:
        yield Wrong("flag", (x.command, *x.first, f"--{misspelt('multirun', rng)}"), "unrecognized|ambiguous|--")
    for words in (
        *(("train", "--config-dir"), ("train", "--config-dir", "nowhere"), ("train", "--config-dir", "/dev/null")),
        *(
            ("train", "--config-name", "nothing"),
            ("train", "--config-name"),
            ("train", "--cfg"),
            ("train", "--cfg", "jbo"),
        ),
        *(
            ("train", "--info", "nothing"),
            ("train", "--package", "x"),
            ("train", "-cp", "nowhere"),
            ("train", "--experimental-rerun", "x.pickle"),
            ("train", "--resolve"),
            ("train", "--cfg", "job", "-m"),
            ("train", "-z"),
        ),
        *(
            ("inspect", ".", "--top"),
            ("inspect", ".", "--top", "ten"),
            ("inspect", ".", "--top", "-3"),
            ("inspect", "a", "b"),
        ),
        *(("inspect", ".", "--tpo", "3"), ("list", "env", "more"), ("list", "--all"), ("resume", "a", "--force")),
        *(("export", "a", "agent=1", "--out", "x"), ("evaluate", "a", "-m"), ("reproduce", "paper_fixed", "-m")),
    ):
        yield Wrong("flag", words, ".")


def overrides(every: list[Known], rng: random.Random) -> Iterator[Wrong]:
    """Yields what resume and export are told wrongly."""
    for key in ("seed", "env", "team_size", "selector", "epoch", "worker", "Epochs", "", "hydra.run.dir", "out"):
        yield Wrong("override", ("resume", "nowhere", f"{key}=1"), ".")
    for word in (
        "agent",
        "agent==1",
        "=1",
        "agent=",
        "out=x",
        "agent=1,2",
        "agent=1e3",
        "+agent=1",
        "on_exists=resume",
    ):
        yield Wrong("override", ("export", "nowhere", word), ".")
