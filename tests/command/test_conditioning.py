import pandas as pd


def test_the_command_tells_what_seeing_is_worth(berteam, tmp_path):
    words = ["experiment=unknown_opponent", "team_size=1", "epochs=60", "evaluation.games=0", "out=run"]
    berteam("train", *words)
    shown = berteam("evaluate", "run")
    assert "before and after a first game" in " ".join(shown.stdout.split())
    elos = pd.read_csv(tmp_path / "run" / "evaluation" / "conditioning.csv").set_index("choice")
    assert elos.elo_low["gain"] > 100
    table = pd.read_csv(tmp_path / "run" / "evaluation" / "encounters.csv", dtype={"opponent": str})
    assert table.opponent.tolist() == ["0", "1", "2"]
    assert (table.score_after > 0.9).all()


def test_a_resumed_run_has_the_bytes_of_an_unbroken_one(berteam, tmp_path):
    """With observations in the winners' memory, a network for each side, and rules."""
    words = ["experiment=unknown_opponent", "games_per_epoch=6", "evaluation.games=0", "record_every=2"]
    words += ["selector.observations=previous_game", "selector.side=separate", "selector.dataset=per_side"]
    words += ["selector.valid_members=[[0,1],null]"]
    berteam("train", *words, "epochs=6", "out=whole")
    berteam("train", *words, "epochs=4", "out=parts")
    berteam("resume", "parts", "epochs=6")
    for name in ("games", "team_distribution", "side_distribution", "selector", "captain_distribution"):
        whole, parts = ((tmp_path / run / f"{name}.csv").read_bytes() for run in ("whole", "parts"))
        assert whole == parts, name
    sides = pd.read_csv(tmp_path / "whole" / "side_distribution.csv", dtype={"team": str})
    last = sides[sides.epoch == 6]
    assert set(last.side) == {"blue", "red"}
    assert last.groupby("side").probability.sum().round(9).tolist() == [1.0, 1.0]
    teams = pd.read_csv(tmp_path / "whole" / "team_distribution.csv", dtype={"team": str})
    assert set(teams.team) == {"0-0", "0-1", "0-2", "1-1", "1-2"}  # nobody but 0 or 1 at the first place
    merged = last.groupby("team").probability.mean()
    now = teams[teams.epoch == 6].set_index("team").probability
    assert (merged - now).abs().max() < 1e-6  # float32 logits, in batches of another size
    games = pd.read_csv(tmp_path / "whole" / "games.csv", dtype={"blue": str, "red": str})
    for _, epoch in games.groupby("epoch"):
        first, second = epoch.iloc[:3].reset_index(), epoch.iloc[3:].reset_index()
        # Side b % 2 of game b chose anew, the other kept its team and captain.
        for b, kept in enumerate(("red", "blue", "red")):
            assert first[kept][b] == second[kept][b]
            assert first[f"{kept}_captain"][b] == second[f"{kept}_captain"][b]
