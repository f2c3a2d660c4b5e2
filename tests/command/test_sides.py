"""Games of more than two sides, from the command line to their tables."""

import numpy as np
import pandas as pd
import pytest

from berteam_cli.records import COLUMNS, GROWING
from tests.command.conftest import SMALL_BERTEAM

HANDS = ["env=rps", "population=hands", "optimizer=fixed", "games_per_epoch=8", "record_every=2"]
LEARNERS = ["env=rps", "population=ppo6", "learner.n_steps=8", "learner.minibatch_size=4", "optimizer.protect_new=0"]
UNTIMED = ("elo", "sides", *(name for name in GROWING if name != "timing"))


def read(folder, name):
    return pd.read_csv(folder / f"{name}.csv", dtype={"team": str, "opponent": str, "blue": str, "red": str})


def words(selector):
    return [f"selector={selector}", *(SMALL_BERTEAM if selector == "berteam" else [])]


def same(one, two):
    for name in UNTIMED:
        assert (one / f"{name}.csv").read_bytes() == (two / f"{name}.csv").read_bytes(), name


@pytest.mark.parametrize("selector", ["uniform", "mcaa", "berteam"])
def test_every_selector_plays_among_three_sides_and_goes_on(selector, berteam, tmp_path):
    given = ["train", *HANDS, *words(selector), "env.sides=3", "evaluation.games=200"]
    berteam(*given, "epochs=6", "out=whole")
    berteam(*given, "epochs=3", "out=parts")
    berteam("resume", "parts", "epochs=6", "workers=1")
    same(tmp_path / "whole", tmp_path / "parts")
    games, sides = read(tmp_path / "whole", "games"), read(tmp_path / "whole", "sides")
    assert tuple(sides.columns) == COLUMNS["sides"]
    assert list(sides.side) == ["blue", "red", "green"] * 48
    by_game = sides.groupby(["epoch", "game"])
    np.testing.assert_allclose(by_game.score.sum(), 1)
    for color in ("blue", "red"):
        of_side = sides[sides.side == color].reset_index(drop=True)
        pd.testing.assert_series_equal(of_side.team, games[color], check_names=False)
        pd.testing.assert_series_equal(of_side.score, games[f"{color}_score"], check_names=False)
        pd.testing.assert_series_equal(of_side.captain, games[f"{color}_captain"], check_names=False)
    assert (sides.captain == -1).all() if selector == "mcaa" else (by_game.captain.nunique() == 3).all()
    agents = read(tmp_path / "whole", "agents").query("epoch == 0")
    np.testing.assert_allclose(agents.fitness, 1 / 3 if selector == "mcaa" else 1000)  # a mean score, or Elo
    elo = read(tmp_path / "whole", "elo")
    assert len(elo) == 6
    assert (elo.wins + elo.draws + elo.losses == elo.games).all()


@pytest.mark.parametrize("optimizer", ["coevolution", "mapelites"])
def test_members_learn_among_four_sides_whatever_the_workers(optimizer, berteam, tmp_path):
    given = ["train", *LEARNERS, "selector=uniform", "env.sides=4", f"optimizer={optimizer}", "epochs=4"]
    if optimizer == "mapelites":
        given += ["optimizer.opponents=[rock,paper]"]
    for workers in (1, 2):
        berteam(*given, f"workers={workers}", f"out=w{workers}")
    same(tmp_path / "w1", tmp_path / "w2")
    learning = read(tmp_path / "w1", "learning")
    assert learning.steps.sum() == 4 * 16 * 8  # every player of every game learns from its step
    assert learning.updates.sum() > 0


def test_tables_of_two_sides_are_as_they_were(berteam, tmp_path):
    given = ["train", *HANDS, "selector=uniform", "epochs=2", "out=run"]
    berteam(*given, "env.sides=3")
    assert (tmp_path / "run" / "sides.csv").exists()
    berteam(*given, "on_exists=overwrite")
    assert not (tmp_path / "run" / "sides.csv").exists()


def test_a_tournament_among_three_sides(berteam, tmp_path):
    berteam("tournament", "env=rps", "env.sides=3", "team_size=1", "games_per_pair=6", "out=t")
    pairs, elo = read(tmp_path / "t", "pairs"), read(tmp_path / "t", "elo")
    assert set(pairs.side) == {"blue", "red", "green"}
    assert (pairs.games == 1).all()
    assert len(pairs) == 3 * 6
    np.testing.assert_allclose(elo.elo, 1000, atol=1e-6)
    assert (elo.games == 2 * 6).all()
    sides = read(tmp_path / "t", "sides")
    assert len(sides) == 3 * 3 * 6
    berteam("train", *HANDS, "selector=uniform", "env.sides=3", "epochs=2", "evaluation.games=0", "out=run")
    berteam("tournament", "run=run", "top=3", "games_per_pair=2", "out=of_run")
    assert set(read(tmp_path / "of_run", "sides").side) == {"blue", "red", "green"}


@pytest.mark.parametrize("sides", [1, 9])
def test_how_many_sides_there_can_be(sides, berteam):
    error = berteam("train", *HANDS, f"env.sides={sides}", code=2).stderr
    assert f"env.sides must be >= 2 and <= 8, but is {sides}" in error
