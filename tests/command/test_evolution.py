"""Settings that travel, children that differ and archives, by the command."""

import math
import re

import numpy as np
import pandas as pd
import pytest
from stable_baselines3 import PPO

from berteam_cli import build
from berteam_cli.config import checked
from berteam_cli.errors import InputError
from berteam_cli.records import ARCHIVE_TABLES, GROWING
from tests.command.conftest import TINY
from tests.test_config import composed

MOVING = ["perturb.learning_rate=1.2", "perturb.gamma=2", "perturb.reward=1.5", "mutation=0.05", "crossover=0.5"]
ARCHIVE = ["behaviours=[aggression,spread]", "archive=grid", "archive_bins.aggression=4", "archive_bins.spread=3"]
WORDS = [
    *(
        *TINY,
        "selector=uniform",
        "env.max_time_s=15",
        "population=islands4x3",
        "optimizer=mapelites",
        "evaluation.games=0",
        "device=cpu",
    ),
    *(f"population.islands.{name}.learner.n_steps=16" for name in ("ppo64", "ppo96")),
    *(f"population.islands.{name}.learner.minibatch_size=8" for name in ("ppo64", "ppo96")),
    *(
        f"optimizer.{x}"
        for x in (*MOVING, *ARCHIVE, "protect_new=0", "replacements=6", "elites=0", "opponents=[random]")
    ),
]


def tables(folder):
    return {name: (folder / f"{name}.csv").read_bytes() for name in (*GROWING, *ARCHIVE_TABLES) if name != "timing"}


def test_evolving_runs_are_the_same_whoever_plays_and_wherever_they_were_cut(berteam, tmp_path):
    berteam("train", *WORDS, "out=whole", "workers=1")
    berteam("train", *WORDS, "out=parts", "epochs=2", "workers=2")
    berteam("resume", "parts", "epochs=4")
    assert tables(tmp_path / "whole") == tables(tmp_path / "parts")
    agents = pd.read_csv(tmp_path / "whole" / "agents.csv")
    generations = pd.read_csv(tmp_path / "whole" / "generations.csv")
    assert len(generations) > 4
    assert {True, False} == set(generations.second_parent >= 0)
    begun, ended = agents[agents.epoch == 0], agents[agents.epoch == 4]
    assert begun.reward_factors.isna().all()
    assert begun.groupby("island").learning_rate.nunique().eq(1).all()
    children = ended[ended.parent >= 0]
    assert children.reward_factors.str.fullmatch(r"(\w+=[\d.]+ ?)+").all()
    powers = np.log(ended.learning_rate.to_numpy() / begun.learning_rate.to_numpy()) / math.log(1.2)
    np.testing.assert_allclose(powers, powers.round(), atol=1e-6)
    assert (powers[ended.parent >= 0].round() != 0).any()
    assert (ended.entropy_coef.isna() == ended.algorithm.eq("dqn")).all()
    child = children[children.algorithm == "ppo"].iloc[-1]
    berteam("export", "whole", f"agent={child.agent}", "out=child.zip")
    model = PPO.load(tmp_path / "child.zip")
    assert (model.learning_rate, model.gamma) == (child.learning_rate, child.gamma)
    check_archive(tmp_path / "whole", ended)
    said = berteam("report", "whole").stdout
    assert "archive.png" in said
    page = (tmp_path / "whole" / "report" / "report.html").read_text()
    assert "Map of 12 cells by aggression and spread" in page


def check_archive(folder, ended):
    """The archive's figures are those of its cells, and the cells those of the members."""
    archive, cells = (pd.read_csv(folder / f"{name}.csv") for name in ARCHIVE_TABLES)
    assert set(archive.epoch) == {0, 2, 4}
    assert (archive[archive.epoch == 0].occupied == 0).all()
    assert archive[archive.epoch == 0].best_fitness.isna().all()
    assert (archive.cells == 12).all()
    assert cells.advance.isna().all()
    for _, row in archive[archive.epoch == 4].iterrows():
        full = cells[(cells.epoch == 4) & (cells.island == row.island)].dropna(subset="member")
        assert row.occupied == len(full) > 0
        assert row.coverage == pytest.approx(len(full) / 12)
        assert row.qd_score == pytest.approx(full.fitness.clip(lower=0).sum())
        assert row.best_fitness == full.fitness.max()
        home = ended[(ended.island == row.island) & ended.spread.notna()]
        x = np.clip(home.aggression // 1, 0, 3) * 3 + np.clip(home.spread // (0.5 / 3), 0, 2)
        best = home.fitness.groupby(x).max()
        np.testing.assert_array_equal(full.cell, best.index)
        np.testing.assert_array_equal(full.fitness, best)


SIX = ("population=ppo6",)
RPS = ("env=rps", "population=ppo6")
ELITES = (*SIX, "optimizer=mapelites")
WRONG = {
    (*SIX, "optimizer.perturb.gamma=0.9"): "optimizer.perturb.gamma must be >= 1 and <= 100, but is 0.9",
    (*SIX, "optimizer.mutation=-1"): "optimizer.mutation must be >= 0",
    (*SIX, "optimizer.crossover=1.1"): "optimizer.crossover must be >= 0 and <= 1",
    (
        *SIX,
        "optimizer.perturb.entropy_coef=2",
    ): "optimizer.perturb.entropy_coef must be 1 while learner.entropy_coef is 0",
    ("population=ppo6", "learner=dqn", "optimizer.perturb.entropy_coef=2"): "unless an island has learner=ppo,",
    ("population=fixed_policies", "optimizer.perturb.gamma=2"): "unless an island has learner=ppo or learner=dqn,",
    ("population=fixed_policies", "optimizer.mutation=0.1"): r"optimizer.mutation must be 0 .*\(fixed\)",
    (*SIX, "learner=sb3", "optimizer.crossover=0.1"): r"optimizer.crossover must be 0 .*\(A2C\)",
    (*RPS, "optimizer.perturb.reward=2"): "optimizer.perturb.reward must be 1 where the reward has no weights",
    (*SIX, "env.reward=custom_rew", "optimizer.perturb.reward=2"): "optimizer.perturb.reward must be 1",
    (*SIX, "optimizer.replacements=0", "optimizer.mutation=0.1"): "optimizer.mutation has no effect with opt",
    (*SIX, "optimizer.replacements=0", "optimizer.perturb.reward=2"): "optimizer.perturb.reward has no effect with opt",
    (
        "population=mixed4x3",
        "opponents=league",
        "opponents.exploiters=[ppo64]",
        "opponents.exploit_share=0.2",
        "optimizer.perturb.entropy_coef=2",
    ): "optimizer.perturb.entropy_coef must be 1",
    (
        *RPS,
        "optimizer=mapelites",
        "optimizer.opponents=[]",
        "optimizer.behaviours=[spread]",
    ): "env=rps, .* no positions",
    (*ELITES, "optimizer.behaviours=[agression]"): "optimizer.behaviours must be one of .*Did you mean aggression",
    (*ELITES, "optimizer.behaviours=[]"): "optimizer.behaviours must name one of",
    (*ELITES, "optimizer.behaviours=[spread,spread]"): "optimizer.behaviours must name one of",
    (*ELITES, "optimizer.behaviours=[spread]", "team_size=1"): "must not have spread with team_size=1",
    (*ELITES, "optimizer.archive=hexagons"): "optimizer.archive must be one of cvt, grid, none",
    (
        *ELITES,
        "optimizer.archive=grid",
        "optimizer.archive_ranges.aggression=[4,0]",
    ): r"archive_ranges.aggression must be",
    (*ELITES, "optimizer.archive=cvt", "optimizer.archive_ranges.aggression=[0]"): r"archive_ranges.aggression must be",
    (*ELITES, "optimizer.archive=grid", "optimizer.lambda_growth=2"): "optimizer.lambda_growth must be 1 with",
    (*ELITES, "optimizer.archive=cvt", "optimizer.archive_cells=0"): "optimizer.archive_cells must be >= 1",
    (*ELITES, "optimizer.archive=grid", "optimizer.archive_bins.aggression=0"): "archive_bins.aggression must be >= 1",
    (
        *(*ELITES, "optimizer.archive=grid", "optimizer.behaviours=[aggression,spread]"),
        *("optimizer.archive_bins.aggression=101", "optimizer.archive_bins.spread=100"),
    ): "optimizer.archive_bins must give at most 10000 cells, but give 10100",
    (*ELITES, "optimizer.behaviour_scales.spread=0"): "optimizer.behaviour_scales.spread must be > 0",
}


@pytest.mark.parametrize(("words", "said"), WRONG.items())
def test_wrong_values_are_refused_in_a_sentence(words, said):
    with pytest.raises(InputError) as refused:
        build.parts(checked(composed(*words)))
    assert re.search(said, str(refused.value))
    assert "\n" not in str(refused.value)
