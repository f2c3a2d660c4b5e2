"""berteam evaluate, and the column of selector.csv that tells the same, for real."""

import shutil

import numpy as np
import pandas as pd
import pytest

from berteam_cli.records import COLUMNS
from tests.command.conftest import SMALL_BERTEAM, TINY

HANDS = ["env=rps", "population=hands", "optimizer=fixed", "evaluation.games=0", "games_per_epoch=8", "record_every=2"]
LEARNERS = ["env=rps", "population=ppo6", "evaluation.games=0", "games_per_epoch=4", "record_every=2"]


def read(folder, name):
    return pd.read_csv(folder / "evaluation" / f"{name}.csv", dtype={"team": str})


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
    said = berteam("evaluate", "run").stdout
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


def test_embeddings(berteam, tmp_path):
    words = ["population=islands4x3", *TINY, *SMALL_BERTEAM, "evaluation.games=0", "out=run"]
    berteam("train", *words)
    said = berteam("evaluate", "run", "most=10").stdout
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
    first = {path.name: path.read_bytes() for path in place.iterdir()}
    assert set(first) == {"reference_points.csv", "embeddings.csv", "neighbours.csv"}
    (place / "notes.txt").write_text("mine")
    berteam("evaluate", "run", "top=2")
    assert {name: (place / name).read_bytes() for name in first} == first
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
    assert column.dropna().between(1e-9, 1).all()
    assert (tmp_path / "whole" / "selector.csv").read_bytes() == (tmp_path / "cut" / "selector.csv").read_bytes()


@pytest.mark.parametrize(
    ("people", "needed"),
    [(HANDS, 6 * 7 // 2 * 8), (LEARNERS, 21 * 22 // 2 * 8 * 100)],
)
def test_exploitability_is_measured_where_the_steps_suffice(people, needed, berteam, tmp_path):
    for steps in (0, needed - 1, needed):
        berteam("train", *people, "selector=uniform", "epochs=2", f"payoff_steps={steps}", f"out=r{steps}")
        assert exploited(tmp_path / f"r{steps}").notna()[2] == (steps == needed)


def test_exploitability_of_equal_chances(berteam, tmp_path):
    berteam("train", *HANDS, "selector=uniform", "epochs=2", "out=run")
    # A pair of different hands beats two of the three pairs of equal ones and loses to the third; each has 1/9.
    assert exploited(tmp_path / "run")[2] == pytest.approx(1 / 9)


def test_errors_are_one_sentence(berteam, tmp_path):
    berteam("train", *HANDS, "selector=uniform", "epochs=2", "out=run")
    (tmp_path / "empty").mkdir()
    berteam("tournament", "env=rps", "team_size=1", "games_per_pair=2", "out=cup")
    for words in (["nowhere"], ["empty"], ["cup"], [], ["run", "top=0"], ["run", "most=-1"], ["run", "x"]):
        said = berteam("evaluate", *words, code=2)
        assert said.stderr.startswith("berteam: ")
        assert said.stderr.count("\n") == 1
        assert "Traceback" not in said.stderr
    shutil.rmtree(tmp_path / "run" / "checkpoint")
    said = berteam("evaluate", "run", code=2).stderr
    assert said == "berteam: run has no checkpoint to go on from (there is none).\n"
