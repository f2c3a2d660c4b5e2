"""The real command with members that are models of Stable-Baselines3."""

import sys

import pandas as pd
import pytest

from tests.command.conftest import TINY
from tests.command.test_train import UNTIMED, check_tables

WORDS = [*TINY, "selector=uniform", "population=ppo6", "learner=sb3", "optimizer.protect_new=0", "evaluation.games=448"]
ALGORITHMS = {
    "A2C": ["learner.options.n_steps=16"],
    "DQN": ["learner.options.learning_starts=30", "learner.options.buffer_size=300", "learner.schedule_steps=1000"],
}

BOTH = """
defaults:
  - /schema/population/islands@_here_
  - /learner@islands.theirs.learner: sb3
  - /learner@islands.ours.learner: ppo
  - _self_
islands:
  theirs: {size: 3, learner: {algorithm: PPO, options: {n_steps: 32, batch_size: 16}}}
  ours: {size: 3, learner: {n_steps: 32, minibatch_size: 16}}
"""


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_the_same_bytes_for_any_number_of_workers_and_when_resumed(algorithm, berteam, tmp_path):
    words = [*WORDS, f"learner.algorithm={algorithm}", *ALGORITHMS[algorithm]]
    berteam("train", *words, "workers=1", "out=w1")
    berteam("train", *words, "workers=2", "out=w2")
    berteam("train", *words, "epochs=2", "out=parts")
    berteam("resume", "parts", "epochs=4", "workers=2")
    check_tables(tmp_path / "w1", 6)
    files = [f"{name}.csv" for name in UNTIMED] + ["checkpoint/epoch_00000004/tensors.safetensors"]
    for name in files:
        whole = (tmp_path / "w1" / name).read_bytes()
        assert whole == (tmp_path / "w2" / name).read_bytes(), name
        assert whole == (tmp_path / "parts" / name).read_bytes(), name
    learning = pd.read_csv(tmp_path / "w1" / "learning.csv")
    assert set(learning.algorithm) == {algorithm}
    assert learning.updates.sum() > 20
    assert learning.loss.notna().any()
    assert learning.entropy.notna().any() == (algorithm == "A2C")
    assert learning.epsilon.notna().all() == (algorithm == "DQN")
    assert len(pd.read_csv(tmp_path / "w1" / "generations.csv")) > 0


def test_islands_of_both_kinds_share_a_population(berteam, tmp_path):
    (tmp_path / "own" / "population").mkdir(parents=True)
    (tmp_path / "own" / "population" / "both.yaml").write_text(BOTH)
    words = ["train", "--config-dir", "own", *TINY, "selector=uniform", "population=both", "evaluation.games=448"]
    berteam(*words, "population.islands.theirs.learner.options.gamma=0.9", "out=run")
    tables = check_tables(tmp_path / "run", 6)
    learnt = tables["learning"].groupby("algorithm").updates.sum()
    assert set(learnt.index) == {"PPO", "ppo"}
    assert (learnt > 0).all()
    assert set(tables["agents"].name) == {f"{island}.{row}" for island in ("theirs", "ours") for row in range(3)}


def test_without_sb3_contrib(berteam, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)
    said = berteam("train", *WORDS, "learner.algorithm=QRDQN", code=2).stderr
    assert said.endswith("learner.algorithm=QRDQN needs sb3-contrib: pip install sb3-contrib.\n")
    assert list(tmp_path.iterdir()) == []
