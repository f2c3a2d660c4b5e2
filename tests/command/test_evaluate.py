"""berteam evaluate, and the column of selector.csv that tells the same, for real."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from scipy.stats import linregress

from berteam_cli.env.rps import Rps
from berteam_cli.evaluation import conditioning, playing
from berteam_cli.games import Games
from berteam_cli.records import COLUMNS, SHEETS
from tests.command.conftest import SMALL_BERTEAM, TINY

HANDS = ["env=rps", "population=hands", "optimizer=fixed", "evaluation.games=0", "games_per_epoch=8", "record_every=2"]
RATED = ("elo", "figures", "regression", "calibration")
LEARNERS = ["env=rps", "population=ppo6", "evaluation.games=0", "games_per_epoch=4", "record_every=2"]


def read(folder, name):
    return pd.read_csv(folder / "evaluation" / f"{name}.csv", dtype={"team": str})


def tables(place):
    return {path.name: path.read_bytes() for path in place.glob("*.csv")}


def exploited(folder):
    return pd.read_csv(folder / "selector.csv").set_index("epoch").exploitability


def test_reference_points_of_rock_paper_scissors(berteam, tmp_path):
    berteam("train", *HANDS, *SMALL_BERTEAM, "team_size=1", "epochs=4", "out=run")
    said = berteam("evaluate", "run").stdout
    table = read(tmp_path / "run", "reference_points")
    assert tuple(table.columns) == COLUMNS["reference_points"]
    assert set(table.epoch) == {4}
    assert sorted(table.members) == ["paper", "rock", "scissors"]
    assert table.probability.is_monotonic_decreasing
    for mix in ("fixed_point", "replicator", "nash"):
        np.testing.assert_allclose(table[mix], 1 / 3, atol=1e-9)
    share = table.set_index("members").probability
    gained = {"paper": share.rock - share.scissors, "rock": share.scissors - share.paper}
    for member, gain in gained.items():
        assert table.set_index("members").against_mix[member] == pytest.approx(gain, abs=1e-12)
    assert (table.worst == -1).all()
    assert (table.most_lost == 1).all()
    assert table.against_mix.max() == pytest.approx(exploited(tmp_path / "run")[4], abs=1e-12)
    assert "the only one" in said


def test_reference_points_of_fixed_policies(berteam, tmp_path):
    words = [*SMALL_BERTEAM, "epochs=2", "games_per_epoch=4", "evaluation.games=0", "payoff_steps=0"]
    berteam("train", "population=fixed_policies", "optimizer=fixed", *words, "out=run")
    said = berteam("evaluate", "run", "games_per_pair=2", "replay_games=2").stdout
    table = read(tmp_path / "run", "reference_points").set_index("team")
    assert f"Teams that never lost: {', '.join(sorted(table.index[table.most_lost == 0]))}." in said
    assert len(table) == 28
    for mix in ("probability", "fixed_point", "replicator", "nash"):
        assert table[mix].sum() == pytest.approx(1)
    assert table.fixed_point.idxmax() == "2-5"
    assert 0.65 < table.fixed_point[table.index.str.contains("2")].sum() < 0.8  # the hard attacker
    assert table.replicator["2-2"] > 0.99
    assert table.nash["5-5"] > 0.1
    assert table.worst["5-5"] == table.most_lost["5-5"] == 0  # two hard defenders never lose
    assert not table.nash[table.worst < -0.5].any()
    alike = read(tmp_path / "run", "embeddings").set_index("group")
    assert alike.members["aggressive"] >= 3
    assert {"island attackers", "island defenders", "island random"} <= set(alike.index)
    check_manners(tmp_path / "run", alike.members)


def check_manners(run, groups):
    """Fixed policies behave as they are called, and their teams as their members."""
    members, teams, composition = (read(run, name) for name in ("members", "teams", "composition"))
    for name, table in (("members", members), ("teams", teams), ("composition", composition)):
        assert tuple(table.columns) == COLUMNS[name]
    assert (members.games == 28 * 2).all()
    assert (teams.games == 28 * 2).all()
    assert members.aggression.between(members.aggression_low, members.aggression_high).all()
    behaved = members.set_index("name")
    assert set(behaved.group[["attack_easy", "attack_medium", "attack_hard"]]) == {"aggressive"}
    assert behaved.group["defend_hard"] == "defensive"
    assert behaved.grabs["attack_hard"] > behaved.grabs["defend_hard"] == 0
    counts = members.group.value_counts()
    assert counts["aggressive"] == groups["aggressive"]
    both = teams.set_index("team").kind
    assert both["2-2"] == "aggressive"
    assert both["5-5"] == "defensive"
    assert both["2-5"] == "balanced"
    chances = read(run, "elo").set_index("team").probability
    for row in composition.itertuples():
        assert row.teams == (both == row.kind).sum()
        assert row.probability == pytest.approx(chances[both.index[both == row.kind]].sum(), abs=1e-12)
    copies = teams.set_index("team").aggression[[f"{n}-{n}" for n in range(7)]]
    assert np.corrcoef(copies, members.aggression)[0, 1] > 0.95


def test_embeddings(berteam, tmp_path):
    words = ["population=islands4x3", *TINY, *SMALL_BERTEAM, "evaluation.games=0", "out=run"]
    berteam("train", *words)
    said = berteam("evaluate", "run", "most=10", "games_per_pair=1", "aggression_games=1", "replay_games=1").stdout
    assert "78 possible teams are more than most=10, so there are no reference points." in said
    assert not (tmp_path / "run" / "evaluation" / "reference_points.csv").exists()
    table, near = read(tmp_path / "run", "embeddings"), read(tmp_path / "run", "neighbours")
    assert tuple(table.columns) == COLUMNS["embeddings"]
    assert tuple(near.columns) == COLUMNS["neighbours"]
    table = table.set_index("group")
    assert table.members["all"] == 12
    assert table.pairs["all"] == 66
    assert table.above_all["all"] == 0
    assert {"island ppo64", "island dqn96", "algorithm ppo", "algorithm dqn"} <= set(table.index)
    assert (table.cosine.isna() == (table.pairs == 0)).all()
    np.testing.assert_allclose(table.cosine - table.cosine["all"], table.above_all, atol=1e-12)
    assert len(near) == 12 * 5
    assert (near.agent != near.neighbour).all()
    assert near.groupby("agent").cosine.apply(lambda column: column.is_monotonic_decreasing).all()


def test_it_says_the_same_every_time_and_writes_over_its_own_tables_only(berteam, tmp_path):
    berteam("train", *LEARNERS, *SMALL_BERTEAM, "epochs=2", "out=run")
    berteam("evaluate", "run")
    place = tmp_path / "run" / "evaluation"
    first = tables(place)
    assert set(first) == {f"{name}.csv" for name in (*RATED, "reference_points", "embeddings", "neighbours")}
    assert {path.name for path in place.iterdir()} - set(first) == {"manifest.json", "config.yaml", "log.txt"}
    (place / "notes.txt").write_text("mine")
    berteam("evaluate", "run", "top=2", "workers=1")
    assert tables(place) == first
    berteam("evaluate", "run", "most=1", "seed=1")  # what it has nothing to say of is removed
    assert set(first) - set(tables(place)) == {"reference_points.csv"}
    assert tables(place)["elo.csv"] != first["elo.csv"]
    assert tables(place)["neighbours.csv"] == first["neighbours.csv"]
    berteam("train", *LEARNERS, "selector=mcaa", "epochs=2", "out=run", "on_exists=overwrite")
    assert [path.name for path in place.iterdir()] == ["notes.txt"]
    assert "The selector has no embeddings" in berteam("evaluate", "run").stdout


@pytest.mark.parametrize("people", [HANDS, LEARNERS])
def test_exploitability_is_the_same_whatever_the_workers_and_where_a_run_was_cut(people, berteam, tmp_path):
    words = [*people, "selector=mcaa", "selector.train_every=1"]
    berteam("train", *words, "epochs=6", "workers=1", "out=whole")
    berteam("train", *words, "epochs=3", "workers=2", "out=cut")
    berteam("resume", "cut", "epochs=6")
    column = exploited(tmp_path / "whole")
    assert (column.notna() == (column.index % 2 == 0)).all()
    assert column.dropna().between(0, 1).all()
    assert column.max() > 1e-9
    assert (tmp_path / "whole" / "selector.csv").read_bytes() == (tmp_path / "cut" / "selector.csv").read_bytes()


@pytest.mark.parametrize(
    ("people", "needed"),
    [(HANDS, 6 * 7 // 2 * 8), (LEARNERS, 21 * 22 // 2 * 8 * 100)],
)
def test_exploitability_is_measured_where_the_steps_suffice(people, needed, berteam, tmp_path):
    for steps in (0, needed - 1, needed):
        berteam("train", *people, "selector=uniform", "epochs=2", f"payoff_steps={steps}", f"out=r{steps}")
        assert exploited(tmp_path / f"r{steps}").notna()[2] == (steps == needed)


def test_figures_are_those_of_the_tables(berteam, tmp_path):
    berteam("train", *LEARNERS, *SMALL_BERTEAM, "epochs=6", "out=run")
    said = berteam("evaluate", "run").stdout
    assert said.startswith("run/evaluation\nrun after epoch 6\n")
    elo, regressed, deciles = (read(tmp_path / "run", name) for name in ("elo", "regression", "calibration"))
    figures = read(tmp_path / "run", "figures").set_index("quantity")
    last = pd.read_csv(tmp_path / "run" / "team_distribution.csv", dtype={"team": str}).query("epoch == 6")
    assert len(elo) == 21
    np.testing.assert_allclose(elo.set_index("team").probability[last.team], last.probability, atol=1e-12)
    assert (elo.games == 6 * 8).all()
    assert (elo.games == elo.wins + elo.draws + elo.losses).all()
    assert elo.elo.between(elo.elo_low, elo.elo_high).all()
    assert (elo.rank_low < elo.rank_high).all()
    assert elo.rank_low.between(1, 21).all()
    assert figures.value["expected_elo"] == pytest.approx(elo.probability @ elo.elo)
    entropy = -(elo.probability * np.log(elo.probability)).sum()
    assert figures.value["effective_teams"] == pytest.approx(np.exp(entropy))
    assert figures.team["best_elo"] == elo.team[0]
    assert figures.team["chosen_elo"] == elo.team[elo.probability.idxmax()]
    fresh = figures.value["best_elo_replayed"]
    assert fresh != figures.value["best_elo"]
    assert figures.value["regret"] == pytest.approx(fresh - figures.value["expected_elo"])
    assert figures.value["top_1_regret"] == pytest.approx(fresh - figures.value["chosen_elo_replayed"])
    off = (elo["rank"] - elo.predicted_rank).abs().mean() / 21
    assert figures.value["rank_error"] == pytest.approx(off, abs=0.06)  # ties share their ranks
    theirs = linregress(elo.elo, elo.probability)
    fitted = regressed.set_index("quantity").value
    assert fitted["slope"] == pytest.approx(theirs.slope)
    assert fitted["r_squared"] == pytest.approx(theirs.rvalue**2)
    assert deciles.teams.sum() == 21
    assert deciles.teams @ deciles.elo == pytest.approx(elo.elo.sum())
    assert deciles.predicted_elo.is_monotonic_decreasing


def test_it_goes_on_where_it_was_interrupted(berteam, tmp_path, monkeypatch):
    berteam("train", *LEARNERS, "selector=mcaa", "epochs=2", "out=run")
    place = tmp_path / "run" / "evaluation"
    berteam("evaluate", "run")
    whole = tables(place)
    shutil.rmtree(place)
    monkeypatch.setattr(playing, "BATCH", 400)
    monkeypatch.setattr(Rps, "play", interrupting(Rps.play, 1000))
    said = berteam("evaluate", "run", "workers=1", code=130).stdout
    assert said.endswith("Interrupted. The same command goes on from there.\n")
    assert tables(place) == {}
    assert json.loads((place / "manifest.json").read_text())["status"] == "interrupted"
    again = berteam("evaluate", "run", "workers=1")
    assert "Rating 21 teams: going on after 800 games." in again.stdout
    cut = tables(place)
    assert cut.keys() == whole.keys()
    assert json.loads((place / "manifest.json").read_text())["status"] == "done"
    assert not list(place.glob("*.games"))
    shutil.rmtree(place)
    berteam("evaluate", "run")
    assert tables(place) == cut


def test_wherever_it_is_interrupted_it_ends_the_same(berteam, tmp_path, monkeypatch):
    """Before each of its batches in turn: of the ratings, of the replays, of all teams, and of the encounters."""
    berteam("train", "experiment=unknown_opponent", "epochs=2", "out=run")
    monkeypatch.setattr(playing, "BATCH", 400)
    monkeypatch.setattr(conditioning, "BATCH", 32)
    play, calls, last = Games.play, [], [0]

    def interrupted(*call, **named):
        if len(calls) == last[0]:
            raise KeyboardInterrupt
        calls.append(0)
        return play(*call, **named)

    place, words = tmp_path / "run" / "evaluation", ("run", "games_per_pair=20", "replay_games=200", "workers=1")
    last[0] = -1
    monkeypatch.setattr(Games, "play", interrupted)
    berteam("evaluate", *words)
    whole, needed = tables(place), len(calls)
    assert {"reference_points.csv", "encounters.csv"} <= whole.keys()
    shutil.rmtree(place)
    calls.clear()
    commands = 0
    while not tables(place):
        last[0] = len(calls) + 4  # of which one is the reference's, and a batch of encounters takes two
        berteam("evaluate", *words, code=(0, 130))
        commands += 1
        assert commands < needed
    assert tables(place) == whole
    assert commands > 4
    assert len(calls) <= needed + 2 * commands  # again only the reference's, and half a batch of encounters
    assert not [path for name in SHEETS for path in place.glob(f"{name}.*") if path.suffix != ".csv"]


def interrupting(play, after):
    """Returns ``play``, which is interrupted once so many games are played of a batch that is kept."""
    played = [0]

    def until(self, batch, players, policies, seeds, results):
        if len(seeds) <= playing.BATCH and len(policies.kind) > 6:
            played[0] += len(batch)
        if played[0] > after:
            played[0] = -(10**9)
            raise KeyboardInterrupt
        play(self, batch, players, policies, seeds, results)

    return until


def test_a_run_that_was_broken_off_is_looked_at_as_far_as_it_got(berteam, tmp_path):
    berteam("train", *LEARNERS, "selector=uniform", "epochs=4", "out=run")
    manifest = tmp_path / "run" / "manifest.json"
    about = json.loads(manifest.read_text())
    config = tmp_path / "run" / "config.yaml"
    config.write_text(config.read_text().replace("epochs: 4", "epochs: 200"))
    for status, word in (("interrupted", "interrupted"), ("running", "broken off")):
        manifest.write_text(json.dumps(about | {"status": status}))
        said = berteam("evaluate", "run").stdout
        assert said.startswith(f"run/evaluation\nrun after epoch 4 of 200, {word}\n")
        kept = json.loads((tmp_path / "run" / "evaluation" / "manifest.json").read_text())
        assert kept["evaluated"] == f"after epoch 4 of 200, {word}"
        assert (kept["epoch"], kept["status"], kept["rated"]) == (4, "done", 21)


def test_until_it_ends_the_tables_stay_with_what_they_were_made_by(berteam, tmp_path, monkeypatch):
    berteam("train", *LEARNERS, "selector=mcaa", "epochs=2", "out=run")
    berteam("evaluate", "run", "seed=3")
    place = tmp_path / "run" / "evaluation"
    before, whole = json.loads((place / "manifest.json").read_text()), tables(place)
    told = (place / "config.yaml").read_text()
    with monkeypatch.context() as patch:
        patch.setattr(Rps, "play", interrupting(Rps.play, 0))
        berteam("evaluate", "run", "seed=4", "games_per_pair=2", "teams_at_most=3", "workers=1", code=130)
    after = json.loads((place / "manifest.json").read_text())
    assert after["status"] == "interrupted"
    kept = ("seed", "epoch", "evaluated", "teams", "rated", "reference")
    assert [after[name] for name in kept] == [before[name] for name in kept]
    assert (place / "config.yaml").read_text() == told
    assert tables(place) == whole
    berteam("evaluate", "run", "seed=4", "games_per_pair=2", "teams_at_most=3")
    assert json.loads((place / "manifest.json").read_text())["seed"] == 4
    assert "games_per_pair: 2\n" in (place / "config.yaml").read_text()


def test_games_of_three_sides_and_many_teams(berteam, tmp_path):
    berteam("train", *HANDS, "env.sides=3", "selector=mcaa", "epochs=2", "out=three")
    said = berteam("evaluate", "three").stdout
    assert "Games of 3 sides have no payoff matrix, so there are no reference points." in said
    assert "Games of rps count no events" in said
    assert set(tables(tmp_path / "three" / "evaluation")) == {f"{name}.csv" for name in RATED}
    berteam("train", *LEARNERS, "selector=mcaa", "selector.exact_limit=5", "epochs=2", "out=many")
    said = berteam("evaluate", "many", "teams_at_most=8").stdout
    assert "The chances of teams are estimated from 20,000 drawn ones" in said
    assert "of 21 possible teams are rated (teams_at_most=8)." in said
    place = tmp_path / "many" / "evaluation"
    assert set(tables(place)) == {"elo.csv", "figures.csv"}
    figures = pd.read_csv(place / "figures.csv").set_index("quantity")
    assert figures.low["expected_elo"] < figures.value["expected_elo"] < figures.high["expected_elo"]


def test_exploitability_of_equal_chances(berteam, tmp_path):
    berteam("train", *HANDS, "selector=uniform", "epochs=2", "out=run")
    # A pair of different hands beats two of the three pairs of equal ones and loses to the third; each has 1/9.
    assert exploited(tmp_path / "run")[2] == pytest.approx(1 / 9)


def test_luck_does_not_make_equal_teams_exploitable(berteam, tmp_path):
    """Networks that have not learnt show any hand alike, so that no team has an edge."""
    words = [*LEARNERS, "selector=uniform", "learner.learning_rate=1e-9", "learner.n_steps=1024", "epochs=24"]
    berteam("train", *words, "record_every=1", "out=run")
    measured = exploited(tmp_path / "run")
    assert measured.notna().all()
    assert measured.mean() < 0.09  # .13 where the same games choose the best answer and rate it
    assert (measured == 0).any()


def test_errors_are_one_sentence(berteam, tmp_path):
    berteam("train", *HANDS, "selector=uniform", "epochs=2", "out=run")
    (tmp_path / "empty").mkdir()
    berteam("tournament", "env=rps", "team_size=1", "games_per_pair=2", "out=cup")
    for words in (["nowhere"], ["empty"], ["cup"], [], ["run", "top=0"], ["run", "most=-1"], ["run", "x"]):
        said = berteam("evaluate", *words, code=2)
        assert said.stderr.startswith("berteam: ")
        assert said.stderr.count("\n") == 1
        assert "Traceback" not in said.stderr
    assert not (tmp_path / "run" / "evaluation").exists()
    shutil.rmtree(tmp_path / "run" / "checkpoint")
    said = berteam("evaluate", "run", code=2).stderr
    assert said == "berteam: run has no checkpoint to go on from (there is none).\n"
    assert not (tmp_path / "run" / "evaluation").exists()
