"""berteam export and population.members, for real: out of a run, into Stable-Baselines3, and into a run again."""

import functools
import re
import shutil
from pathlib import Path

import gymnasium
import numpy as np
import pandas as pd
import pytest
import torch
import yaml
from stable_baselines3 import DQN, PPO

from berteam_cli import build, checkpoint
from berteam_cli.acting import act
from berteam_cli.config import checked
from berteam_cli.population import policies
from berteam_cli.stored import stored_config
from mctf import parallel_env
from tests.command.conftest import TINY

RPS = ["env=rps", "selector=uniform", "epochs=4", "games_per_epoch=8", "record_every=2", "evaluation.games=0"]
TAUGHT = [
    *("population=islands4x3", "optimizer.protect_new=0"),
    *(f"population.islands.{island}.learner.n_steps=4" for island in ("ppo64", "ppo96")),
    *(f"population.islands.{island}.learner.minibatch_size=4" for island in ("ppo64", "ppo96")),
    *(f"population.islands.{island}.learner.learning_starts=2" for island in ("dqn64", "dqn96")),
]
UNTIMED = ("agents", "captain_distribution", "games", "generations", "island_distribution", "learning")


def members_of(folder):
    """The policies of a run's members as they are evaluated, from its checkpoint."""
    parts = build.parts(checked(stored_config(folder)), stored=folder)
    return policies(parts.optimizer.islands, checkpoint.load(folder, parts).run.population, explore=False)


def files(*names):
    return f"population.members=[{','.join(f'{{file: {name}}}' for name in names)}]"


@pytest.fixture
def run(berteam):
    """A run of two PPO and two DQN islands in the folder `run`."""
    berteam("train", *RPS, *TAUGHT, "out=run")


def test_members_act_the_same_when_loaded(run, berteam, tmp_path):
    ours = members_of(tmp_path / "run")
    work, seen = np.zeros(2 * ours.sizes.max(), dtype=np.float32), np.array([1, 0, 0, 0], dtype=np.float32)
    for agent in (1, 4):
        said = berteam("export", "run", f"agent={agent}").stdout.splitlines()
        assert said[1] == f"Files in run: agent_{agent}.zip"
        assert said[0] == f"ppo{(64, 96)[agent // 3]}.{agent % 3} of run after epoch 4."
        model = PPO.load(tmp_path / "run" / f"agent_{agent}.zip")
        assert (model.observation_space.shape, model.action_space.n) == ((4,), 3)
        grid = (np.arange(4000) + 0.5) / 4000
        shares = np.bincount([act(ours, agent, seen, work, 0.0, x) for x in grid], minlength=3) / 4000
        with torch.no_grad():
            chances = model.policy.get_distribution(torch.from_numpy(seen[np.newaxis])).distribution.probs[0]
        np.testing.assert_allclose(shares, chances, atol=5e-4)
        assert model.num_timesteps > 0
        assert model.policy.optimizer.state_dict()["state"]
    for agent, out in ((6, "there/"), (11, "there"), (11, "there/agent_6")):
        berteam("export", "run", f"agent={agent}", f"out={out}", "on_exists=overwrite")
    assert sorted(path.name for path in (tmp_path / "there").iterdir()) == ["agent_11.zip", "agent_6.zip"]
    berteam("export", "run", "agent=6", "out=there", "on_exists=overwrite")
    for agent in (6, 11):
        model = DQN.load(tmp_path / "there" / f"agent_{agent}.zip")
        action, _ = model.predict(seen, deterministic=True)
        assert action == act(ours, agent, seen, work, 0.5, 0.5)


def test_the_line_it_prints_loads_the_member(run, berteam, tmp_path):
    for agent in (0, 6):
        line = berteam("export", "run", f"agent={agent}").stdout.splitlines()[-1].removeprefix("Next: in Python: ")
        found = {"observation": np.ones(4, dtype=np.float32)}
        exec(line, found)
        assert type(found["model"]) is (PPO if agent == 0 else DQN)


def test_the_space_is_that_of_the_games_pettingzoo_form(berteam, tmp_path):
    words = [*TINY, "selector=uniform", "population=ppo6", "evaluation.games=0", "epochs=1"]
    for profile in ("pyquaticus-2024-06", "clean"):
        berteam("train", *words, f"env.profile={profile}", f"out={profile}")
        berteam("export", profile, "agent=5", f"out={profile}.zip")
        space = parallel_env(team_size=2, profile=profile).observation_space("blue_0")
        assert PPO.load(tmp_path / f"{profile}.zip").observation_space == space


def test_exported_and_imported_members_are_the_same(run, berteam, tmp_path):
    names = [f"a{agent}.zip" for agent in (0, 3, 7, 10)]
    for name in names:
        berteam("export", "run", f"agent={name[1:-4]}", f"out={name}")
    berteam("train", *RPS, "population=imported", files(*names), "optimizer=fixed", "out=again")
    ours, again = members_of(tmp_path / "run"), members_of(tmp_path / "again")
    for row, agent in enumerate((0, 3, 7, 10)):
        for column, copied in zip(ours, again, strict=True):
            one, other = np.atleast_1d(column[agent]), np.atleast_1d(copied[row])
            np.testing.assert_array_equal(one[: len(other)], other)
            assert not one[len(other) :].any()
    stored = yaml.safe_load((tmp_path / "again" / "config.yaml").read_text())
    assert stored["population"]["members"][1] == {"file": "a3.zip", "name": None, "trust": False}
    agents = pd.read_csv(tmp_path / "again" / "agents.csv").query("epoch == 4")
    assert list(agents.name) == ["a0", "a3", "a7", "a10"]
    assert set(agents.island) == {"members"}
    assert set(agents.algorithm) == {"imported"}


def test_imported_members_alone_play_tournaments_and_films(berteam, tmp_path):
    words = [*TINY, "selector=uniform", "evaluation.games=0", "epochs=1"]
    berteam("train", *words, "population=islands4x3", "out=run")
    for agent in (0, 9):
        berteam("export", "run", f"agent={agent}")
    berteam("train", *words, "population=imported", files("run/agent_0.zip", "run/agent_9.zip"), "out=m")
    shutil.rmtree("run")  # the run holds what it needs
    berteam("tournament", "run=m", "games_per_pair=2", "out=t")
    table = pd.read_csv(tmp_path / "t" / "elo.csv")
    assert set(table.members) == {"agent_0 + agent_0", "agent_0 + agent_9", "agent_9 + agent_9"}
    assert "agent_0 + agent_9" in berteam("replay", "m", "blue=0-1", "red=1-1").stdout
    assert (tmp_path / "m" / "replay" / "0-1_1-1.html").exists()


def test_beside_others_they_are_cloned_and_go_on_after_their_files_are_gone(run, berteam, tmp_path):
    names = [f"a{agent}.zip" for agent in (0, 3, 7)]
    for name in names:
        berteam("export", "run", f"agent={name[1:-4]}", f"out={name}")
    words = [
        *RPS,
        "population=ppo6",
        "learner.n_steps=4",
        "learner.minibatch_size=4",
        "optimizer.protect_new=0",
        "optimizer.elites=1",
        files(*names),
    ]
    berteam("train", *words, "out=whole", "epochs=8")
    berteam("train", *words, "out=parts")
    Path("a0.zip").unlink()
    Path("a3.zip").write_bytes(Path("a7.zip").read_bytes())  # another network than the run began with
    berteam("resume", "parts", "epochs=8")
    for name in UNTIMED:
        assert (tmp_path / "parts" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()
    generations = pd.read_csv(tmp_path / "whole" / "generations.csv").query("island == 'members'")
    assert len(generations) > 0
    agents = pd.read_csv(tmp_path / "whole" / "agents.csv").query("epoch == 8 and island == 'members'")
    assert len(set(agents.name)) < 3
    berteam("train", *words, "out=parts", "on_exists=resume", "epochs=8")
    assert "population.members is" in berteam(*("train", *words[:-1], "out=parts", "on_exists=resume"), code=2).stderr


def test_what_ended_before_its_first_checkpoint_reads_its_files_again(run, berteam, tmp_path):
    berteam("export", "run", "agent=1", "out=a.zip")
    words = [*RPS, "population=imported", "team_size=1", files("a.zip")]
    berteam("train", *words, "out=whole")
    for again in (("resume", "cut"), ("train", *words, "out=cut", "on_exists=resume")):
        shutil.rmtree(tmp_path / "cut", ignore_errors=True)
        shutil.copytree(tmp_path / "whole", tmp_path / "cut")
        shutil.rmtree(tmp_path / "cut" / "checkpoint")
        berteam(*again)
        for name in UNTIMED:
            assert (tmp_path / "whole" / f"{name}.csv").read_bytes() == (tmp_path / "cut" / f"{name}.csv").read_bytes()
    # In a folder that came from elsewhere nobody has said that code in the file may run.
    shutil.rmtree(tmp_path / "cut" / "checkpoint")
    config = tmp_path / "cut" / "config.yaml"
    config.write_text(config.read_text().replace("trust: false", "trust: true"))
    said = berteam("resume", "cut", code=2).stderr
    assert "cut has no checkpoint yet" in said
    assert "give the command that began it again, with on_exists=resume" in said


EXPORTS = {
    ("nowhere", "agent=1"): "nowhere is no folder of a run",
    ("run",): "agent must say which member is exported, such as agent=3",
    ("run", "agent=12"): "agent must be one of 0 to 11, but is '12'",
    ("run", "agent=-1"): "agent must be one of 0 to 11, but is '-1'",
    ("run", "agent=ppo"): "agent must be one of 0 to 11, but is 'ppo'",
    ("run", "agent=1", "on_exist=error"): "on_exist is no key of berteam export.* Did you mean on_exists?",
    ("run", "agent=1", "on_exists=resume"): "on_exists must be one of error, overwrite, but is 'resume'",
    ("run", "3"): "'3' cannot be read as key=value",
    ("run", "agent=1", "out=/proc/none/x.zip"): "/proc/none/x.zip cannot be written",
    ("run", "agent=1", "out=taken.zip"): "taken.zip exists already.*on_exists=overwrite",
    ("run", "agent=1", "out=folder.zip", "on_exists=overwrite"): "folder.zip exists already",
    (): "berteam export: .*required: run",
}


def test_wrong_exports(run, berteam, tmp_path):
    (tmp_path / "taken.zip").write_bytes(b"mine")
    (tmp_path / "folder.zip").mkdir()
    before = sorted(tmp_path.rglob("*"))
    for words, said in EXPORTS.items():
        error = berteam("export", *words, code=2).stderr
        assert re.search(said, error), error
        assert error.count("\n") == 1, error
        assert sorted(tmp_path.rglob("*")) == before
    assert (tmp_path / "taken.zip").read_bytes() == b"mine"
    berteam("export", "run", "agent=1", "out=taken.zip", "on_exists=overwrite")
    assert PPO.load(tmp_path / "taken.zip").action_space.n == 3


def test_what_has_no_network_is_not_exported(berteam, tmp_path):
    berteam("train", *RPS, "population=hands", "optimizer=fixed", "out=run")
    error = berteam("export", "run", "agent=2", code=2).stderr
    assert "agent=2 (scissors) cannot be exported: its learner is fixed" in error
    shutil.rmtree(tmp_path / "run" / "checkpoint")
    assert "run has no checkpoint" in berteam("export", "run", "agent=2", code=2).stderr
    assert not list((tmp_path / "run").glob("*.zip*"))


def model(path, actions=3, **settings):
    """Saves a new model for a game of four numbers to see."""

    class Game(gymnasium.Env):
        observation_space = gymnasium.spaces.Box(-1, 1, (4,), dtype=np.float32)
        action_space = gymnasium.spaces.Discrete(actions)

    PPO("MlpPolicy", Game(), device="cpu", **settings).save(path)


IMPORTS = {
    files("gone.zip"): r"population.members\[0\].file=gone.zip does not exist",
    files("a.zip", "text.zip"): r"population.members\[1\].file=text.zip is no whole zip file",
    files(
        "a.zip", "wide.zip"
    ): r"members\[1\].file=wide.zip sees 4 numbers and has 5 actions, but .* 4 and there are 3",
    files("a.zip", "b/a.zip"): r"members\[1\].name is 'a', as that of member 0",
    files("two words.zip"): r"members\[0\].name must be a word that tables can hold, but is 'two words'",
    "population.members=[{file: a.zip, name: nan}]": r"members\[0\].name must be a word",
    "population.members=[{name: a}]": r"population.members\[0\].file",
    "population.members=[{fil: a.zip}]": "fil",
    "population.members=[{file: a.zip, trust: perhaps}]": r"trust.*perhaps",
    "population.members=a.zip": "population.members: Invalid value assigned: str is not a List",
    "population.members=[]": "population must have members, but has none",
    "learner.gamma=1": "learner.gamma has no effect with this population, which has no islands that learn",
}


def test_wrong_imports(berteam, tmp_path):
    model(tmp_path / "a.zip")
    model(tmp_path / "wide.zip", actions=5)
    (tmp_path / "text.zip").write_text("text")
    before = sorted(tmp_path.rglob("*"))
    for word, said in IMPORTS.items():
        error = berteam("train", *RPS, "population=imported", word, "out=run", code=2).stderr
        assert re.search(said, error), error
        assert error.count("\n") == 1, error
        assert sorted(tmp_path.rglob("*")) == before
    own = tmp_path / "own" / "population"
    own.mkdir(parents=True)
    island = "{members: {size: 2, learner: '${learner}'}}"
    own.joinpath("taken.yaml").write_text(f"defaults: [/schema/population/islands@_here_, _self_]\nislands: {island}\n")
    words = ["--config-dir", "own", *RPS, "population=taken", "out=run"]
    error = berteam("train", *words, files("a.zip"), code=2).stderr
    assert "population.islands.members must have another name" in error
    berteam("train", *words)


def test_what_cannot_be_told_is_asked_of_stable_baselines_only_if_trusted(berteam, tmp_path):
    model(tmp_path / "a.zip", policy_kwargs={"activation_fn": functools.partial(torch.nn.Tanh)})
    words = [*RPS, "population=imported", "optimizer=fixed", "out=run"]
    error = berteam("train", *words, files("a.zip"), code=2).stderr
    assert "a.zip has an activation of its own; if you trust it, say trust: true" in error
    berteam("train", *words, "population.members=[{file: a.zip, trust: true},{file: a.zip, trust: true, name: b}]")
    assert members_of(tmp_path / "run").tanh.tolist() == [True, True]
