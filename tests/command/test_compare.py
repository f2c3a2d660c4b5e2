"""berteam compare, for real."""

import json
import shutil

import pandas as pd
import pytest

from berteam_cli.evaluation import playing
from berteam_cli.evaluation.contenders import called
from berteam_cli.records import COLUMNS

HANDS = ["env=rps", "team_size=1", "optimizer=fixed", "evaluation.games=0", "games_per_epoch=4", "epochs=2"]
FEW = ["games=240", "reference_games=40"]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Where the runs lie once they are trained."""
    return tmp_path_factory.mktemp("kept")


@pytest.fixture
def runs(berteam, tmp_path, kept):
    """Two runs of uniform choice among all hands, and two that show paper alone."""
    names = ["any0", "any1", "paper0", "paper1"]
    if not any(kept.iterdir()):
        train(berteam)
        for name in names:
            shutil.copytree(tmp_path / name, kept / name)
    else:
        for name in names:
            shutil.copytree(kept / name, tmp_path / name)
    return names


def train(berteam):
    for seed in (0, 1):
        berteam("train", *HANDS, "population=hands", "selector=uniform", f"seed={seed}", f"out=any{seed}")
        words = ["population=hands", "selector=uniform", "selector.valid_members=[[1]]"]
        berteam("train", *HANDS, *words, f"seed={seed}", f"out=paper{seed}")


def tables(folder):
    return {name: pd.read_csv(folder / f"{name}.csv") for name in ("comparison", "runs", "versus")}


def test_algorithms_of_known_strength(runs, berteam, tmp_path):
    said = berteam("compare", *runs, *FEW, "out=c").stdout
    found = tables(tmp_path / "c")
    for name, table in found.items():
        assert tuple(table.columns) == COLUMNS[name]
    both = found["comparison"]
    assert list(both.seeds) == [2, 2]
    # Every hand of three beats one and loses to one: all that there is has the Elo 1000.
    assert ((both.mixed_elo_low <= 1000) & (both.mixed_elo_high >= 1000)).all()
    assert both.expected_elo.to_numpy() == pytest.approx([1000, 1000], abs=1)
    assert list(both.iqm) == pytest.approx(list(both.mixed_elo), abs=25)
    versus = found["versus"].iloc[0]
    assert versus.games == versus.wins + versus.draws + versus.losses == 240
    assert versus.score == pytest.approx((versus.wins + versus.draws / 2) / 240)
    assert versus.score_low <= 0.5 <= versus.score_high
    assert found["versus"].superiority.sum() == pytest.approx(1)
    assert found["versus"].improvement.sum() == pytest.approx(1)
    assert set(found["runs"].run) == set(runs)
    assert "Algorithm against algorithm" in said
    manifest = json.loads((tmp_path / "c" / "manifest.json").read_text())
    assert manifest["status"] == "done"
    assert not list((tmp_path / "c" / "checkpoint").iterdir())


def test_neither_order_nor_workers_nor_an_interruption_change_anything(runs, berteam, tmp_path, monkeypatch):
    berteam("compare", *runs, *FEW, "workers=1", "out=one")
    monkeypatch.setattr(playing, "BATCH", 100)
    berteam("compare", *runs, *FEW, "workers=1", "out=small")
    whole = playing.Games.play

    def interrupted(self, *words, **named):
        if list((tmp_path / "cut" / "checkpoint").glob("played.games")) and self.count_left() == 0:
            raise KeyboardInterrupt
        return whole(self, *words, **named)

    left = iter([2, 1, 0])
    monkeypatch.setattr(playing.Games, "count_left", lambda self: next(left), raising=False)
    monkeypatch.setattr(playing.Games, "play", interrupted)
    berteam("compare", *runs[::-1], *FEW, "workers=2", "out=cut", code=130)
    assert not (tmp_path / "cut" / "comparison.csv").exists()
    monkeypatch.setattr(playing.Games, "play", whole)
    said = berteam("compare", *runs[::-1], *FEW, "workers=2", "out=cut", "on_exists=resume").stdout
    assert "going on after 200 games" in said
    for name in ("comparison", "versus", "runs"):
        assert (tmp_path / "cut" / f"{name}.csv").read_bytes() == (tmp_path / "small" / f"{name}.csv").read_bytes()
    assert "is done" in berteam("compare", *runs[::-1], *FEW, "workers=2", "out=cut", "on_exists=resume", code=2).stderr


def test_one_run_each_says_nothing_of_seeds(runs, berteam, tmp_path):
    berteam("compare", "any0", "paper0", *FEW, "out=c")
    found = tables(tmp_path / "c")
    assert found["comparison"][["iqm", "iqm_low"]].isna().all(axis=None)
    assert found["versus"].improvement_low.isna().all()


def test_what_cannot_be_compared_is_refused_in_one_sentence(runs, berteam, tmp_path):
    berteam("train", *HANDS, "env.sides=3", "population=hands", "selector=uniform", "out=three")
    again = ["selector=uniform", "seed=1", "workers=1", "checkpoint_every=1"]  # which change no number of it
    berteam("train", *HANDS, "population=hands", *again, "out=again")
    for words, said in {
        ("any0",): "two runs at least",
        ("any0", "any0"): "named twice",
        ("any0", "./any1", "any1"): "named twice",
        ("any0", "any1", "again"): "any1 and again are the same training, of one config and seed=1",
        ("any0", "nowhere"): "nowhere is no folder of a run",
        ("any0", "three"): "sides is 2 in any0 and 3 in three",
        ("any0", "paper0", "out=any0"): "is one of the runs",
        (): "runs must be given first",
    }.items():
        error = berteam("compare", *words, code=2).stderr
        assert error.startswith("berteam: ")
        assert said in error
        assert error.count("\n") == 1


def test_a_run_that_was_broken_off_is_compared_as_far_as_it_got(runs, berteam, tmp_path):
    manifest = tmp_path / "any1" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"done"', '"interrupted"'))
    said = berteam("compare", "any0", "any1", "paper0", *FEW, "out=c").stdout
    assert "any1 is interrupted; it is compared as it was after epoch 2." in said


def test_algorithms_are_called_by_what_tells_them_apart():
    def config(selector, optimizer, **rest):
        return {"selector.name": selector, "optimizer.name": optimizer, "optimizer.fitness": selector} | rest

    four = [config(s, o) for s in ("berteam", "mcaa") for o in ("coevolution", "mapelites")]
    assert called(four)[1] == "selector=berteam optimizer=mapelites"
    assert len(set(called(four))) == 4
    rates = [config("mcaa", "fixed", epochs=5, **{"selector.rate": x}) for x in (0.1, 0.2)]
    assert called(rates) == ["selector.rate=0.1", "selector.rate=0.2"]
    assert called(rates[:1]) == ["all"]
    main, extra = ({f"population.islands.{x}.learner.name": y} for x, y in (("main", "ppo"), ("extra", "dqn")))
    told = "population.islands.extra.learner"
    assert called([main, main | extra]) == [f"{told}=none", f"{told}=dqn"]  # and no name is empty
