"""Looks at a run while it trains: in its tables, its figures and its report."""

import os
import signal
import threading
import time

import numpy as np
import pandas as pd
import pytest

from berteam_cli.evaluation.sight import ALL, BEST_MEMBER, BEST_TEAM, CHOICE
from berteam_cli.records import COLUMNS
from berteam_cli.report.watched import at_places, some
from tests.command.conftest import SMALL_BERTEAM, TINY
from tests.logger.test_loggers import shown

RPS = ["train", "env=rps", "population=ppo6", "selector=mcaa", "learner.n_steps=16", "learner.minibatch_size=8"]
RPS += ["optimizer.protect_new=0", "evaluation.games=0", "record_every=1000"]
SIDES = ["train", "env=rps", "env.sides=3", "population=hands", "optimizer=fixed", "selector=uniform"]
LOOKS = ["evaluate_every=2", "evaluate_teams=3"]
TIMED = {"timing", "summary"}


def read(folder):
    return pd.read_csv(folder / "evaluation.csv", keep_default_na=False, na_values={"elo": "", "elo_low": ""})


def tables(folder):
    return {path.stem: path.read_bytes() for path in folder.glob("*.csv") if path.stem not in TIMED}


def test_a_run_is_the_same_with_looks_and_without(berteam, tmp_path):
    words = ["train", *TINY, *SMALL_BERTEAM, "population=islands4x3", "optimizer=mapelites", "optimizer.protect_new=0"]
    words += [f"population.islands.{name}.learner.n_steps=64" for name in ("ppo64", "ppo96")]
    words += ["evaluation.games=60", "evaluation.reference_teams=3"]
    berteam(*words, "out=plain")
    berteam(*words, *LOOKS, "out=seen")
    plain, seen = tables(tmp_path / "plain"), tables(tmp_path / "seen")
    assert seen.keys() - plain.keys() == {"evaluation"}
    assert {name: seen[name] for name in plain} == plain
    states = [tmp_path / run / "checkpoint" / "epoch_00000004" / "tensors.safetensors" for run in ("plain", "seen")]
    assert states[0].read_bytes() == states[1].read_bytes()
    spent = pd.read_csv(tmp_path / "seen" / "timing.csv").evaluate_s
    assert list(spent > 0) == [False, True, False, True]
    assert not pd.read_csv(tmp_path / "plain" / "timing.csv").evaluate_s.any()

    table = read(tmp_path / "seen")
    assert tuple(table.columns) == COLUMNS["evaluation"]
    assert list(table.epoch.unique()) == [0, 2, 4]
    assert (table.wins + table.draws + table.losses == table.games).all()
    for _, look in table.groupby("epoch"):
        assert list(look.who) == [CHOICE] * 4 + [BEST_MEMBER] * 4 + [BEST_TEAM]
        pairs = look[look.opponent != ALL].groupby("who", sort=False)
        whole = look[look.opponent == ALL].set_index("who")
        assert list(whole.games) == [3 * 3 * 2, 3 * 2, 3]
        for name in ("games", "wins", "draws", "losses"):
            assert (pairs[name].sum() == whole[name][[CHOICE, BEST_MEMBER]]).all()
        for name in ("captures", "grabs", "tags", "wall_hits", "opponent_captures", "opponent_tags", "steps"):
            np.testing.assert_allclose(pairs[name].mean(), whole[name][[CHOICE, BEST_MEMBER]])
        assert (whole.elo_low < whole.elo).all()
        assert len(whole.members[CHOICE].split()) == 3
        assert whole.members[BEST_TEAM] in [*whole.members[CHOICE].split(), whole.members[BEST_MEMBER]]
    assert table.wall_hits.max() > 0
    assert table.opponent[0] == "attack_easy + attack_easy"


@pytest.mark.parametrize("words", [RPS, SIDES])
def test_a_resumed_run_sees_the_same(words, berteam, tmp_path):
    berteam(*words, *LOOKS, "epochs=6", "out=whole", "workers=1")
    berteam(*words, *LOOKS, "epochs=3", "out=parts")
    assert list(read(tmp_path / "parts").epoch.unique()) == [0, 2, 3]
    berteam("resume", "parts", "epochs=6", "workers=2")
    assert list(read(tmp_path / "parts").epoch.unique()) == [0, 2, 4, 6]
    assert tables(tmp_path / "parts") == tables(tmp_path / "whole")
    assert "evaluate_every cannot be changed" in berteam("resume", "parts", "evaluate_every=3", code=2).stderr
    others = berteam("resume", "parts", "epochs=7", "evaluation.reference_teams=2", code=2).stderr
    assert "evaluation.reference_teams is 2, but the run in parts was begun with 28" in others


def test_an_interrupted_run_sees_the_same(berteam, tmp_path):
    def interrupt():
        while not (table.exists() and table.stat().st_size > 8000):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    table = tmp_path / "cut" / "evaluation.csv"
    watcher = threading.Thread(target=interrupt)
    watcher.start()
    berteam(*RPS, *LOOKS, "epochs=100000", "out=cut", code=130)
    watcher.join()
    end = int(pd.read_csv(tmp_path / "cut" / "timing.csv").epoch.max()) + 3
    (tmp_path / "cut" / "config.yaml").write_text(
        (tmp_path / "cut" / "config.yaml").read_text().replace("epochs: 100000", f"epochs: {end}")
    )
    berteam("resume", "cut")
    berteam(*RPS, *LOOKS, f"epochs={end}", "out=whole")
    assert tables(tmp_path / "cut") == tables(tmp_path / "whole")


def test_loggers_and_the_report_show_it(berteam, tmp_path):
    berteam(*RPS, *LOOKS, "epochs=3", "logger=tensorboard", "out=run")
    table, figures = read(tmp_path / "run"), shown(tmp_path / "run")
    whole = table[table.opponent == ALL].set_index(["who", "epoch"])
    choice, best = whole.loc[CHOICE], whole.loc[BEST_TEAM]
    expected = {
        "expected_elo": choice.elo,
        "best_elo": best.elo,
        "won": choice.wins / choice.games,
        "drawn": choice.draws / choice.games,
        "captures": choice.captures,
        "grabs": choice.grabs,
    }
    for name, column in expected.items():
        assert figures[f"evaluation/{name}"] == pytest.approx(column.to_dict(), rel=1e-6)
    with (tmp_path / "run" / "evaluation.csv").open("a") as file:
        file.write("4,choice,rock + rock,6,1,2,3,0.0,0.0,0.0,0.0,0.0,0.0,0.0,1.0,,,,\n")  # half a look, as of a crash
    berteam("report", "run")
    page = (tmp_path / "run" / "report" / "report.html").read_text()
    for name in ("watched_elo", "watched_results"):
        assert (tmp_path / "run" / "report" / f"{name}.png").exists()
        assert f'id="run1-{name}"' in page
    assert "against rock" in page
    assert f"{best.elo[3]:.0f} at the end" in page


def test_a_report_shows_the_hardest_opponents_and_the_easiest():
    rows = [("a", 4, 4, 0), ("b", 4, 0, 4), ("c", 4, 0, 0), ("d", 4, 1, 0), ("e", 4, 3, 0), ("f", 4, 0, 3)]
    assert some(pd.DataFrame(rows, columns=["opponent", "games", "wins", "draws"])) == ["c", "d", "b", "a"]
    assert [list(at_places(count)) for count in (0, 1, 2, 3, 4)] == [[], [0], [0, 1], [0, 1, 2], [0, 1, 2, 3]]
