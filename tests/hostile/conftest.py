"""Hostile run folders, files and names, against the real commands: nothing runs that was only loaded.

Everything hostile here would make a file of the name MARK if it ran.
"""

import shutil
import sys
from pathlib import Path

import pytest

from berteam_cli import cli
from tests.command.conftest import berteam as berteam  # noqa: PLC0414 (a fixture)

MARK = "it_ran"
WORDS = ["epochs=1", "games_per_epoch=4", "evaluation.games=0", "record_every=1", "team_size=1"]
RUNS = {
    "learners": ["env=rps", "population=ppo6", "learner.n_steps=16", "learner.minibatch_size=8", *WORDS],
    "sailors": ["population=fixed_policies", "optimizer=fixed", "selector=uniform", "env.max_time_s=10", *WORDS],
    "hands": ["env=rps", "population=hands", "optimizer=fixed", "selector=uniform", *WORDS],
}
RUNS["learners"] += ["selector.width=8", "selector.heads=2", "selector.layers=1"]
FEW = ["games_per_pair=1", "replay_games=1", "aggression_games=1", "payoff_games=1"]
READERS = {
    "resume": lambda run: ["resume", run, "epochs=2"],
    "evaluate": lambda run: ["evaluate", run, *FEW],
    "compare": lambda run: ["compare", run, "other", "games=20", "reference_games=10", "out=c"],
    "tournament": lambda run: ["tournament", f"run={run}", "top=3", "games_per_pair=2", "out=t"],
    "replay": lambda run: ["replay", run, "blue=0", "red=1", "out=game.html"],
    "export": lambda run: ["export", run, "agent=0", "out=a.zip"],
    "inspect": lambda run: ["inspect", run],
}


@pytest.fixture(scope="session")
def kept(tmp_path_factory):
    """Small runs, to be copied before they are changed."""
    place = tmp_path_factory.mktemp("kept")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["berteam"])
        for name, words in RUNS.items():
            cli.run("train", [*words, f"out={place / name}"])
    return place


@pytest.fixture
def run(kept, tmp_path):
    """Copies a run to where the command works, and returns its folder."""

    def copied(kind, name="run"):
        return Path(shutil.copytree(kept / kind, tmp_path / name)).relative_to(tmp_path)

    return copied


def changed(folder, old, new):
    """Changes the config in a run's folder."""
    text = (folder / "config.yaml").read_text()
    assert old in text
    (folder / "config.yaml").write_text(text.replace(old, new))


class Bomb:
    """What makes MARK when it is unpickled."""

    def __reduce__(self):
        return (exec, (f"open({MARK!r}, 'w')",))


def refused(done, code=2):
    """Checks that a command ended in one sentence, and that nothing ran."""
    assert done.stderr.startswith("berteam: ")
    assert done.stderr.count("\n") == 1
    assert done.stderr.rstrip("\n").isprintable()
    assert not Path(MARK).exists()
    return done.stderr
