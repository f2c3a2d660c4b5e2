"""What helps to learn the game mctf, in the real commands."""

import pandas as pd
import pytest
from stable_baselines3 import PPO

from tests.command.conftest import TINY
from tests.command.test_train import UNTIMED

GAME = ["env.world_size_m=[80,50]", "selector=uniform", "population=ppo6", "learner.n_steps=16", *TINY]
GAME += ["learner.minibatch_size=8", "evaluation.games=0"]
LEVERS = ["env.last_steps=3", "env.potential=1.5", "env.team_share=0.25", "env.reward_weights.drawn=-0.5"]
LEVERS += ["curriculum=starts", "curriculum.until=3"]


@pytest.fixture
def run(berteam):
    """A run with all levers in the folder `run`; returns what it said."""
    return berteam("train", *GAME, *LEVERS, "workers=1", "out=run").stderr


def same(one, other):
    for name in [x for x in UNTIMED if x != "elo"]:
        assert (one / f"{name}.csv").read_bytes() == (other / f"{name}.csv").read_bytes(), name


def test_the_same_bytes_for_any_workers_and_when_resumed(run, berteam, tmp_path):
    berteam("train", *GAME, *LEVERS, "workers=3", "epochs=2", "out=parts")
    berteam("train", *GAME, *LEVERS, "workers=2", "epochs=4", "out=parts", "on_exists=resume")
    same(tmp_path / "run", tmp_path / "parts")
    config = (tmp_path / "run" / "config.yaml").read_text()
    assert all(word in config for word in ("carrying: 0.2", "until: 3", "last_steps: 3", "team_share: 0.25"))
    assert "env.potential_discount" not in (tmp_path / "run" / "log.txt").read_text()


def test_a_run_that_sees_three_steps_goes_everywhere(run, berteam, tmp_path):
    """It is filmed, evaluated and exported, and meets a run that sees one."""
    berteam("train", *GAME, "out=one")
    berteam("replay", "run", "blue=0-1", "red=2-3")
    few = ["games_per_pair=1", "replay_games=1", "aggression_games=1", "payoff_games=1", "reference_teams=2", "most=0"]
    berteam("evaluate", "run", *few)
    berteam("tournament", "run=[one,run]", "top=3", "games_per_pair=2", "out=t")
    assert len(pd.read_csv(tmp_path / "t" / "elo.csv")) == 6
    berteam("compare", "run", "one", "games=8", "reference_games=8", "reference_teams=2", "out=c")
    said = berteam("export", "run", "agent=2").stdout
    assert "It sees the observations of the last 3 steps in one, the newest first" in said
    model = PPO.load(tmp_path / "run" / "agent_2.zip")
    assert (model.observation_space.shape, model.last_steps) == ((135,), 3)
    files = "{file: run/agent_2.zip},{file: run/agent_2.zip, name: twin}"
    taken = ["selector=uniform", "population=imported", f"population.members=[{files}]", *TINY, "evaluation.games=0"]
    berteam("train", *taken, "optimizer=fixed", "env.last_steps=3", "epochs=1", "out=taken")
    refused = berteam("train", *taken, "out=refused", code=2).stderr
    assert "sees 135 numbers and has 17 actions, but in this game observations have 45" in refused.replace("\n", " ")


def test_another_discount_is_told_of(berteam, tmp_path):
    berteam("train", *GAME, "env.potential=1", "optimizer.perturb.gamma=2", "epochs=0", "out=moved")
    told = " ".join((tmp_path / "moved" / "log.txt").read_text().split())
    assert "as optimizer.perturb.gamma lets them discount otherwise than env.potential_discount=0.99." in told
    said = "The potential in the reward changes which policy is best on island main, as its learner discounts by "
    for words, gamma in (([], "0.98"), (["learner=sb3", "learner.algorithm=A2C"], "0.97")):
        told = ["learner.options.gamma=0.97"] if words else ["learner.gamma=0.98", *GAME[3:4], GAME[-2]]
        taught = [x for x in GAME if not x.startswith("learner.")]
        berteam("train", *taught, *words, *told, "env.potential=1", "epochs=0", f"out=run{gamma}")
        assert f"{said}gamma={gamma} and env.potential_discount is 0.99." in " ".join(
            (tmp_path / f"run{gamma}" / "log.txt").read_text().split()
        )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["env.reward=outcomes"], "Did you mean outcome?"),
        (["curriculum=start"], "Did you mean starts?"),
        (["curriculum=starts", "curriculum.random=0.7"], "random, near_flag and carrying must be at most 1 together"),
        (["curriculum=starts", "env=rps", "population=ppo6"], "curriculum must be none with env=rps, as only games of"),
    ],
)
def test_what_does_not_go_together(words, said, berteam, tmp_path):
    assert said in " ".join(berteam("train", *words, "out=run", code=2).stderr.split())
    assert not (tmp_path / "run").exists()
