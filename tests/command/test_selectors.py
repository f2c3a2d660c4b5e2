"""Every selector by the command: within the rules, and cut and resumed as if it had never stopped."""

from itertools import permutations

import numpy as np
import pandas as pd
import pytest

from berteam_cli.build import SELECTORS
from berteam_cli.records import GROWING
from tests.command.conftest import SMALL_BERTEAM, TINY

UNTIMED = [name for name in ("elo", *GROWING) if name != "timing"]

WORDS = {name: [f"selector={name}"] for name in SELECTORS} | {
    "berteam": ["selector=berteam", *SMALL_BERTEAM],
    "mcaa_top": ["selector=mcaa", "selector.top_fraction=0.3", "selector.train_every=4"],
    "best_team": ["selector=best_team", "selector.games_per_rung=5", "selector.candidates=4"],
    "assessor": ["selector=assessor", "selector.train_every=3", "selector.width=8", "selector.capacity=40"],
    "assessor_searching": ["selector=assessor", "selector.train_every=3", "selector.width=8", "selector.exact_limit=2"],
    "psro": ["selector=psro", "selector.start=1", "selector.expand_every=3", "selector.candidates=2"],
    "psro_replicator": ["selector=psro", "selector.solver=replicator", "selector.half_life=5"],
}


def cut_and_whole(berteam, tmp_path, words, cut, epochs):
    """Runs to the end at once and in two parts, and asserts that both leave the same tables."""
    berteam("train", *words, "out=whole", f"epochs={epochs}")
    berteam("train", *words, "out=parts", f"epochs={cut}")
    berteam("resume", "parts", f"epochs={epochs}", "workers=1")
    for name in UNTIMED:
        parts, whole = ((tmp_path / run / f"{name}.csv").read_bytes() for run in ("parts", "whole"))
        assert parts == whole, name


def may_stand(team, places):
    return any(all(m in place for m, place in zip(order, places, strict=True)) for order in permutations(team))


@pytest.mark.parametrize("selector", WORDS)
def test_within_the_rules_and_resumed(selector, berteam, tmp_path):
    places = [[0, 1], [1, 2]]
    words = ["env=rps", "population=hands", "optimizer=fixed", "games_per_epoch=6", "record_every=5"]
    words += [*WORDS[selector], f"selector.valid_members={places}", "checkpoint_every=7"]
    cut_and_whole(berteam, tmp_path, words, 10, 20)
    played = pd.read_csv(tmp_path / "whole" / "games.csv", dtype=str)
    told = pd.read_csv(tmp_path / "whole" / "team_distribution.csv", dtype={"team": str})
    listed = told.team[(told.probability > 0) & (told.team != "other")]
    for team in {*played.blue, *played.red, *listed}:
        assert may_stand([int(m) for m in team.split("-")], places), team
    np.testing.assert_allclose(told.groupby("epoch").probability.sum(), 1)
    last = pd.read_csv(tmp_path / "whole" / "agents.csv").query("epoch == 20")
    assert last.fitness.nunique() == 3
    assert (played.blue_captain == "-1").all() if selector.startswith("mcaa") else (last.captain_games > 0).all()


@pytest.mark.parametrize("selector", ["best_members", "best_team", "assessor", "psro"])
def test_members_that_learn_and_are_replaced(selector, berteam, tmp_path):
    words = [*TINY, *WORDS[selector], "population=ppo6", "optimizer.protect_new=1", "learner.n_steps=64"]
    cut_and_whole(berteam, tmp_path, words, 3, 6)
    assert len(pd.read_csv(tmp_path / "whole" / "generations.csv")) > 0
    assert (pd.read_csv(tmp_path / "whole" / "learning.csv").updates > 0).any()
