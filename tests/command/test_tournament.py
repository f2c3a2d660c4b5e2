import json

import numpy as np
import pandas as pd

from berteam_cli.evaluation import playing
from berteam_cli.games import Games
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
    shown = berteam("inspect", "run", "--top", "3").stdout
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


HANDS = ("tournament", "env=rps", "team_size=1")


def test_rock_paper_scissors_shows_its_circle(berteam, tmp_path):
    """A circle, a Nash of thirds and an alpha-rank of thirds; all of it known after two games a pair."""
    berteam(*HANDS, "games_per_pair=2", "out=t")
    assert (tmp_path / "t" / "cycles.csv").read_text() == "cycle,weakest_score,weakest_low\n0 > 2 > 1,1.0,1.0\n"
    strategies = read(tmp_path / "t", "strategies")
    for column in ("nash", "nash_low", "nash_high", "alpha_rank", "alpha_rank_low", "alpha_rank_high"):
        assert np.allclose(strategies[column], 1 / 3)
    table = pd.read_csv(tmp_path / "t" / "crosstable.csv", dtype={"team": str}, index_col="team")
    assert table.loc["0", "2"] == table.loc["1", "0"] == table.loc["2", "1"] == 1.0
    assert np.allclose((table + table.T).to_numpy()[~np.eye(3, dtype=bool)], 1.0)
    elo = read(tmp_path / "t", "elo")
    assert (elo.rank_low == 1).all()
    assert (elo.rank_high == 3).all()
    pairs = read(tmp_path / "t", "pairs").set_index(["team", "opponent", "side"]).superiority
    assert np.isclose(pairs["0", "1", "blue"] + pairs["1", "0", "blue"], 1.0)


def test_copies_make_no_interval_narrower(berteam, tmp_path):
    for games in (2, 40):
        berteam(*HANDS, f"games_per_pair={games}", f"out=t{games}")
    two, forty = (read(tmp_path / f"t{games}", "elo") for games in (2, 40))
    assert ((forty.elo_high - forty.elo_low) > 0.9 * (two.elo_high - two.elo_low)).all()
    berteam(*HANDS, "games_per_pair=40", "action_noise=0.5", "out=noisy")
    noisy = read(tmp_path / "noisy", "elo")
    assert (noisy.elo_high - noisy.elo_low).max() < (two.elo_high - two.elo_low).min()


def test_a_list_of_teams_and_action_noise_are_the_same_every_time(berteam, tmp_path):
    for k in (1, 2):
        berteam("tournament", "teams=[2-5,0-3]", "env.max_time_s=30", "action_noise=0.3", f"workers={k}", f"out=t{k}")
    assert set(read(tmp_path / "t1", "elo").team) == {"2-5", "0-3"}
    assert (tmp_path / "t1" / "games.csv").read_bytes() == (tmp_path / "t2" / "games.csv").read_bytes()


def test_teams_of_two_runs_and_fixed_ones(berteam, tmp_path):
    for seed in (1, 2):
        berteam("train", "population=hands", "env=rps", "epochs=1", f"seed={seed}", f"out=r{seed}")
    berteam("tournament", "run=[r1,r2]", "top=2", "fixed=true", "games_per_pair=2", "out=t")
    elo = read(tmp_path / "t", "elo")
    assert elo.members.str.contains("r1/").sum() == elo.members.str.contains("r2/").sum() == 2
    assert len(elo) > 4


def test_a_cut_tournament_of_a_run_that_went_on_says_so(berteam, tmp_path, monkeypatch):
    """It begins anew with the run as it stands then."""
    berteam("train", "population=hands", "env=rps", "optimizer=fixed", "epochs=1", "out=r")

    def interrupted(self, *words, **named):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Games, "play", interrupted)
        berteam("tournament", "run=r", "out=t", code=130)
    assert json.loads((tmp_path / "t" / "manifest.json").read_text())["epoch"] == 1
    berteam("resume", "r", "epochs=3")
    berteam("tournament", "run=r", "out=t", "on_exists=resume")
    assert json.loads((tmp_path / "t" / "manifest.json").read_text())["epoch"] == 3


def test_a_cut_tournament_goes_on(berteam, tmp_path, monkeypatch):
    """Interrupted after the first batch, it goes on with the second, to the same bytes; another config is refused."""
    words = (*HANDS, "games_per_pair=100", "action_noise=0.2")
    monkeypatch.setattr(playing, "BATCH", 80)
    berteam(*words, "out=whole")
    play, calls = Games.play, []

    def interrupted(self, policies, lineups, *rest, **named):
        calls.append(len(lineups))
        if len(calls) == 2:
            raise KeyboardInterrupt
        return play(self, policies, lineups, *rest, **named)

    monkeypatch.setattr(Games, "play", interrupted)
    said = berteam(*words, "out=cut", code=130).stdout
    assert "on_exists=resume" in said
    assert not (tmp_path / "cut" / "elo.csv").exists()
    assert "begun with" in berteam(*words, "seed=5", "out=cut", "on_exists=resume", code=2).stderr
    berteam(*words, "workers=1", "out=cut", "on_exists=resume")
    assert calls == [80, 80, 80, 80, 60]
    for name in ("elo", "games", "pairs", "strategies", "cycles"):
        assert (tmp_path / "cut" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()
    assert not (tmp_path / "cut" / "checkpoint").exists()
    assert "it is done" in berteam(*words, "workers=1", "out=cut", "on_exists=resume", code=2).stderr


def test_a_sequential_tournament_goes_on_from_its_second_round(berteam, tmp_path, monkeypatch):
    words = (*HANDS, "games_per_pair=10", "action_noise=0.3", "sprt.rounds=6", "workers=1")
    play, calls, last = Games.play, [], [-1]

    def interrupted(*call, **named):
        if len(calls) == last[0]:
            last[0] = -1
            raise KeyboardInterrupt
        calls.append(0)
        return play(*call, **named)

    monkeypatch.setattr(Games, "play", interrupted)
    berteam(*words, "out=whole")
    rounds = len(calls)
    assert rounds > 3
    calls.clear()
    last[0] = 2
    berteam(*words, "out=cut", code=130)
    berteam(*words, "out=cut", "on_exists=resume")
    assert len(calls) == rounds  # none was played twice
    for path in (tmp_path / "whole").glob("*.csv"):
        assert path.read_bytes() == (tmp_path / "cut" / path.name).read_bytes(), path.name


def test_pairs_play_until_it_is_clear_who_is_stronger(berteam, tmp_path):
    noisy = (*HANDS, "games_per_pair=10", "action_noise=0.3", "sprt.rounds=60")
    for workers in (1, 2):
        berteam(*noisy, f"workers={workers}", f"out=t{workers}")
    pairs = read(tmp_path / "t1", "pairs")
    assert pairs.equals(read(tmp_path / "t2", "pairs"))
    verdict = pairs.drop_duplicates(["team", "opponent"]).set_index(["team", "opponent"])
    for winner, loser in (("1", "0"), ("2", "1"), ("0", "2")):  # paper wraps rock, and so on
        assert verdict.decision[winner, loser] == "stronger"
        assert verdict.decision[loser, winner] == "weaker"
        assert abs(verdict.log_ratio[winner, loser]) > np.log(19)
    games = pairs.groupby(["team", "opponent"]).games.sum()
    assert (games < 600).all()
    assert (games % 10 == 0).all()
    berteam(*HANDS, "games_per_pair=2", "sprt.rounds=60", "out=sure")
    assert (read(tmp_path / "sure", "pairs").groupby(["team", "opponent"]).games.sum() == 2).all()  # more are copies
    berteam(*HANDS, "games_per_pair=10", "out=once")
    assert read(tmp_path / "once", "pairs")[["log_ratio", "decision"]].isna().all(axis=None)


def test_other_ratings(berteam, tmp_path):
    words = ("tournament", "env=rps", "games_per_pair=4", "action_noise=0.4")
    for rating in ("ml", "davidson", "paper"):
        berteam(*words, f"rating={rating}", f"out={rating}")
    ml, davidson, paper = (read(tmp_path / x, "elo").set_index("team") for x in ("ml", "davidson", "paper"))
    assert np.isclose(davidson.elo.mean(), 1000)
    assert np.corrcoef(ml.elo, davidson.elo[ml.index])[0, 1] > 0.9
    assert ((davidson.elo_low < davidson.elo) & (davidson.elo < davidson.elo_high)).all()
    assert paper[["elo_low", "elo_high", "rank_low", "rank_high"]].isna().all(axis=None)
    online = read(tmp_path / "paper", "online_elo")
    assert np.isclose(online.elo.mean(), 1000)
    assert set(online.team) == set(ml.index)
    assert not (tmp_path / "ml" / "online_elo.csv").exists()


def test_naming_policies_in_another_order_renames_teams_only(berteam, tmp_path):
    berteam(*HANDS, "policies=[rock,paper,scissors]", "games_per_pair=2", "out=a")
    berteam(*HANDS, "policies=[scissors,rock,paper]", "games_per_pair=2", "out=b")
    one, two = (read(tmp_path / x, "elo").set_index("members") for x in "ab")
    assert np.allclose(one.elo, two.elo[one.index])
    assert (tmp_path / "b" / "cycles.csv").read_text().count(" > ") == 2


def test_random_starts_make_games_differ(berteam, tmp_path):
    words = ("tournament", "teams=[2-2,0-0]", "games_per_pair=16", "env.max_time_s=60")
    berteam(*words, "out=fixed")
    berteam(*words, "random_starts=true", "out=anywhere")
    manifests = [json.loads((tmp_path / x / "manifest.json").read_text()) for x in ("fixed", "anywhere")]
    assert [x["copies"] for x in manifests] == [14, 0]


def test_runs_of_different_games_do_not_meet(berteam):
    berteam("train", "population=hands", "env=rps", "epochs=1", "out=two")
    berteam("train", "population=hands", "env=rps", "epochs=1", "team_size=1", "out=one")
    said = berteam("tournament", "run=[two,one]", "out=t", code=2).stderr
    assert said.count("\n") == 1
    assert "two" in said and "one" in said
