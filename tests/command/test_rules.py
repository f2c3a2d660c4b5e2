"""Who may stand where, from the command line to the tables."""

import pandas as pd
import pytest

WORDS = ["env=rps", "population=hands", "optimizer=fixed", "epochs=4", "evaluation.games=0", "out=run"]
SMALL = ["selector.width=16", "selector.layers=1", "selector.heads=2", "selector.train_every=2"]


@pytest.mark.parametrize("limit", [5000, 2])
def test_rules_hold_in_games_and_tables_and_in_the_search(berteam, tmp_path, limit):
    rules = ["selector.valid_members=[[0],null]", f"selector.exact_limit={limit}", "selector.weighting=true"]
    berteam("train", *WORDS, *SMALL, *rules)
    games = pd.read_csv(tmp_path / "run" / "games.csv", dtype={"blue": str, "red": str})
    assert set(games.blue) | set(games.red) <= {"0-0", "0-1", "0-2"}
    teams = pd.read_csv(tmp_path / "run" / "team_distribution.csv", dtype={"team": str})
    assert set(teams.team) <= {"0-0", "0-1", "0-2", "other"}
    assert teams.groupby("epoch").probability.sum().round(9).eq(1).all()
    assert teams.error.gt(0).any() == (limit == 2)
    shown = berteam("inspect", "run", "--top", "2").stdout
    assert ("beam" in shown) == (limit == 2)


def test_nothing_to_learn_from_is_counted(berteam, tmp_path):
    """Rock alone always draws."""
    berteam("train", *WORDS, *SMALL, "selector.valid_members=[[0],[0]]")
    table = pd.read_csv(tmp_path / "run" / "selector.csv")
    assert table.skipped.tolist() == [0, 1, 0, 1]
    assert table.updates.tolist() == [0, 0, 0, 0]
