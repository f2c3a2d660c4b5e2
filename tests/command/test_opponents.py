"""Runs against other opponents, with the real command."""

import json
import shutil

import pandas as pd
import pytest

from berteam_cli.report.drawing import styled
from berteam_cli.report.opponents import by_age, past
from berteam_cli.report.overview import headline
from berteam_cli.report.source import Source

WORDS = ["env=rps", "population=islands4x3", "selector=mcaa", "games_per_epoch=12", "optimizer.protect_new=1"]
WORDS += [f"population.islands.{name}.learner.n_steps=64" for name in ("ppo64", "ppo96")]
WORDS += [f"population.islands.{name}.learner.buffer_size=500" for name in ("dqn64", "dqn96")]
WORDS += ["record_every=2", "checkpoint_every=4", "evaluation.games=0", "opponents=league"]
WORDS += ["opponents.snapshot_every=1", "opponents.pool_size=4", "opponents.exploiters=[dqn64]"]
WORDS += ["opponents.exploit_share=0.2", "opponents.exploiter_epochs=3"]
WORDS += ["opponents.scripted_share=0.1", "opponents.scripted=[rock]"]
TABLES = ("agents", "team_distribution", "captain_distribution", "island_distribution", "games", "generations")
TABLES += ("learning", "selector", "opponents", "elo")


@pytest.fixture
def whole(berteam, tmp_path):
    berteam("train", *WORDS, "epochs=8", "out=whole")
    return tmp_path / "whole"


def check_same(one, other):
    for name in TABLES:
        assert (one / f"{name}.csv").read_bytes() == (other / f"{name}.csv").read_bytes(), name
    last = "checkpoint/epoch_00000008"
    assert (one / last / "tensors.safetensors").read_bytes() == (other / last / "tensors.safetensors").read_bytes()
    for name in json.loads((one / last / "state.json").read_text())["pool"]:
        assert (one / "pool" / name).read_bytes() == (other / "pool" / name).read_bytes(), name


def test_a_resumed_run_ends_with_the_same_bytes(whole, berteam, tmp_path):
    berteam("train", *WORDS, "epochs=5", "out=parts", "workers=1")
    berteam("resume", "parts", "epochs=8", "workers=2")
    check_same(tmp_path / "parts", whole)
    # Killed before its last checkpoint: the snapshots of later epochs are there, one of them half written.
    killed = tmp_path / "parts"
    shutil.rmtree(killed / "checkpoint" / "epoch_00000008")
    shutil.copy(killed / "pool" / "00000008.npy", killed / "pool" / "00000007.npy")
    (killed / "pool" / "00000006.part").write_bytes(b"half")
    assert "Going on after epoch 5 of 8" in berteam("resume", "parts").stdout
    check_same(killed, whole)
    assert not (killed / "pool" / "00000006.part").exists()


def test_the_tables_of_a_league(whole, berteam, tmp_path):
    facts = json.loads((whole / "manifest.json").read_text())
    assert facts["evaluation"]["teams"] == 45  # of the nine members who are no exploiters
    games, met = pd.read_csv(whole / "games.csv"), pd.read_csv(whole / "opponents.csv", dtype={"opponent": str})
    outsiders = {6, 7, 8}
    assert (games.groupby("epoch").size() == 6).all()
    assert not any(outsiders & {int(m) for m in team.split("-")} for team in [*games.blue, *games.red])
    played = met.groupby(["epoch", "kind"]).games.sum().unstack(fill_value=0)
    assert (played.past + played.past_exploiter == 3).all()
    assert (played.scripted == 1).all()
    assert (played.exploiter == 2).all()
    assert (met.wins + met.draws + met.losses == met.games).all()
    assert set(met[met.kind == "scripted"].opponent) == {"rock-rock"}
    for kind, of_outsiders in (("past", False), ("past_exploiter", True)):
        teams = [x.partition(":")[2] for x in met[met.kind == kind].opponent]
        assert teams
        assert all(bool(outsiders & {int(m) for m in team.split("-")}) == of_outsiders for team in teams)
    old = met[met.kind.str.startswith("past")]
    assert (old.taken_epoch < old.epoch).all()
    assert (old.opponent.str.partition(":")[0].astype(int) == old.taken_epoch).all()
    assert old.chance.between(0, 1, inclusive="neither").sum() == old.chance.notna().sum() > 0
    listed = pd.read_csv(whole / "team_distribution.csv").team
    assert not any(outsiders & {int(m) for m in team.split("-")} for team in listed)
    said = "past members; scripted: rock; exploiters: dqn64"
    assert json.loads((whole / "manifest.json").read_text())["trained_against"] == said
    assert f"Trained against {said}" in (whole / "log.txt").read_text()
    assert headline(Source.of(whole))["Trained against"] == said
    with styled():
        assert "Score by age" in past(Source.of(whole)).alt
    plain = [word for word in WORDS if not word.startswith("opponents")]
    berteam("train", *plain, "epochs=1", "out=whole", "on_exists=overwrite")
    assert not (whole / "opponents.csv").exists()
    assert not (whole / "pool").exists()
    assert past(Source.of(whole)) is None


def test_scores_by_age_by_hand():
    table = pd.DataFrame(
        {
            "epoch": [5, 6, 9, 9],
            "taken_epoch": [4, 5, 1, 1],
            "games": [1, 3, 2, 2],
            "wins": [1, 1, 0, 1],
            "draws": [0, 2, 0, 0],
        }
    )
    ages = by_age(table)
    assert ages.age.tolist() == [1, 8]
    assert ages.games.tolist() == [4, 4]
    assert ages.score.tolist() == [(1 + 1 + 1) / 4, 1 / 4]
    # Scores 1, 1, .5, .5 and 1, 0, 0, 0: variances 1/16 and 3/16, over 4 games.
    assert ages.error.tolist() == pytest.approx([0.125, (3 / 64) ** 0.5])
