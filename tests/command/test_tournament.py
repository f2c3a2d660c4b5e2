import numpy as np
import pandas as pd

from tests.command.conftest import SMALL_BERTEAM, TINY


def read(folder, name):
    return pd.read_csv(folder / f"{name}.csv", dtype={"team": str, "opponent": str, "blue": str, "red": str})


# What a maximum-likelihood fit gave for games of the original simulator, two for each pair, mean 1000.
RECORDED = {
    "2-5": 1356, "2-2": 1356, "1-2": 1197, "2-3": 1216, "2-4": 1170, "0-2": 1136, "2-6": 1104, "1-5": 1058, "0-5": 1044,
    "1-4": 972, "1-6": 965, "1-1": 979, "1-3": 936, "0-1": 885, "0-6": 870, "0-4": 854, "0-0": 877, "0-3": 838,
    "3-5": 993, "5-5": 993, "4-5": 993, "5-6": 965, "3-3": 921, "3-4": 907, "4-4": 907, "3-6": 838, "4-6": 838,
    "6-6": 830,
}  # fmt: skip


def test_fixed_policies(berteam, tmp_path):
    """The strength of the seven fixed policies is that of the original's."""
    berteam("tournament", "out=t")
    elo = read(tmp_path / "t", "elo")
    assert len(elo) == 28
    assert {team for team in elo.team[:7]} == {team for team in RECORDED if "2" in team}
    difference = elo.set_index("team").elo - pd.Series(RECORDED)
    assert difference.abs().max() < 60, difference
    assert abs(elo.elo.mean() - 1000) < 1e-6
    assert (elo.games == 27 * 8).all()
    games = read(tmp_path / "t", "games")
    assert len(games) == 378 * 8
    # Every pair meets four times from either side.
    pairs = read(tmp_path / "t", "pairs")
    assert (pairs.games == 4).all()
    assert len(pairs) == 2 * 2 * 378
    assert (pairs.wins + pairs.draws + pairs.losses == pairs.games).all()
    assert pairs.wins.sum() == pairs.losses.sum() == (games.blue_score != 0.5).sum()
    mirrored = pairs.merge(pairs, left_on=["team", "opponent"], right_on=["opponent", "team"])
    opposite = mirrored[mirrored.side_x != mirrored.side_y]
    assert (opposite.wins_x == opposite.losses_y).all()


def test_a_trained_run_and_inspect(berteam, tmp_path):
    berteam("train", "population=ppo6", *TINY, *SMALL_BERTEAM, "out=run", "evaluation.games=0")
    assert pd.read_csv(tmp_path / "run" / "summary.csv").expected_elo.isna().all()
    berteam("tournament", "run=run", "top=5", "games_per_pair=3", "out=t")
    elo = read(tmp_path / "t", "elo")
    assert len(elo) == 5
    assert (elo.games == 4 * 3).all()
    last = read(tmp_path / "run", "team_distribution").query("epoch == 4").nlargest(5, "probability")
    assert set(elo.team) == set(last.team)
    shown = berteam("inspect", "run", "top=3").stdout
    assert "Most probable teams after epoch 4" in " ".join(shown.split())
    assert "done" in shown
    assert "Strongest of 5" in berteam("inspect", "t").stdout


def test_list(berteam):
    every = berteam("list").stdout
    for choice in ("selector=mcaa", "optimizer=mapelites", "env=rps", "experiment=paper_fixed", "learner=dqn"):
        assert choice in every
    one = berteam("list", "selector").stdout
    assert "selector=berteam" in one
    assert "optimizer" not in one


def test_same_bytes_for_any_number_of_workers(berteam, tmp_path):
    for workers in (1, 2):
        berteam("tournament", "games_per_pair=2", "env.max_time_s=60", f"workers={workers}", f"out=w{workers}")
    for name in ("elo", "pairs", "games"):
        one, two = ((tmp_path / f"w{w}" / f"{name}.csv").read_bytes() for w in (1, 2))
        assert one == two


def test_every_order_of_the_members_from_both_sides(berteam, tmp_path):
    berteam("tournament", "out=t", "env.max_time_s=2")
    games = read(tmp_path / "t", "games")
    assert len(games) == 3024
    assert np.isclose(games.groupby(["blue", "red"]).size(), 4).all()
