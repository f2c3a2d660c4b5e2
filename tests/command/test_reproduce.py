"""berteam reproduce, for real, at a scale at which nothing is learnt."""

import json

import pandas as pd

from berteam_cli.command import reproduce
from berteam_cli.records import COLUMNS

WORDS = ("reproduce", "paper_fixed", "scale=0.001", "out=again")


def test_it_goes_on_where_it_stopped_and_does_nothing_twice(berteam, tmp_path, monkeypatch):
    def stopped(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(reproduce, "evaluate", stopped)
        berteam(*WORDS, code=130)
    run = tmp_path / "again" / "train" / "fixed_berteam_seed0"
    trained = (run / "manifest.json").read_bytes()
    assert json.loads(trained)["status"] == "done"
    said = berteam(*WORDS).stdout
    assert (run / "manifest.json").read_bytes() == trained
    evaluated = (run / "evaluation" / "manifest.json").read_bytes()
    assert json.loads(evaluated)["status"] == "done"
    table = pd.read_csv(tmp_path / "again" / "paper.csv")
    assert tuple(table.columns) == COLUMNS["paper"]
    assert table[["paper", "here"]].notna().all(axis=None)
    elo = pd.read_csv(tmp_path / "again" / "tournament" / "elo.csv").set_index("team").elo
    assert table.set_index("quantity").here["Elo of 2-5"] == elo["2-5"]
    assert "its numbers are not the paper's" in said
    assert (tmp_path / "again" / "report" / "report.html").stat().st_size > 10_000

    def never(*_):
        raise AssertionError("this has been done")

    for part in ("train", "evaluate", "tournament"):
        monkeypatch.setattr(reproduce, part, never)
    monkeypatch.setattr(reproduce, "report", lambda *_: None)  # which is always written anew
    before = (tmp_path / "again" / "paper.csv").read_bytes()
    berteam(*WORDS)
    assert (tmp_path / "again" / "paper.csv").read_bytes() == before
    other = berteam("reproduce", "paper_fixed", "scale=0.002", "out=again", code=2).stderr
    assert "begun with scale=0.001, but scale is 0.002" in other
