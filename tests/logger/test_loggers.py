"""The figures of an epoch where loggers show them."""

import shutil
from contextlib import nullcontext

import pandas as pd
import pytest

from berteam_cli.config_groups import LoggerConfig
from berteam_cli.logger import opening
from berteam_cli.logger.base import Once
from berteam_cli.logger.tensorboard import FOLDER, events
from tests.command.conftest import TINY, berteam  # noqa: F401 (a fixture)

SMALL = ["env=rps", "population=ppo6", "selector=mcaa", "checkpoint_every=2", "record_every=2", "epochs=4"]
NEVER_THE_SAME = {"timing.csv", "summary.csv"}


def shown(folder):
    """Returns {name: {epoch: value}}; a figure that is there twice is an error."""
    figures = {}
    for path in sorted((folder / FOLDER).iterdir()):
        for event in events(path):
            for value in event.summary.value:
                of = figures.setdefault(value.tag, {})
                assert event.step not in of, f"{value.tag} twice in epoch {event.step}"
                of[event.step] = value.simple_value
    return figures


@pytest.fixture
def run(berteam, tmp_path):  # noqa: F811
    berteam("train", *SMALL, "logger=tensorboard", "out=run")
    return tmp_path / "run"


def test_the_figures_are_the_tables(run):
    figures = shown(run)
    selector, timing = (pd.read_csv(run / f"{name}.csv").set_index("epoch") for name in ("selector", "timing"))
    assert list(figures["selector/buffer"]) == [1, 2, 3, 4]
    assert list(figures["selector/effective_teams"]) == [2, 4]
    for epoch, value in figures["selector/buffer"].items():
        assert value == selector.buffer[epoch]
    for epoch, value in figures["timing/play_s"].items():
        assert value == pytest.approx(timing.play_s[epoch], rel=1e-6)
    agents = pd.read_csv(run / "agents.csv")
    last = agents[agents.epoch == 4].fitness
    assert figures["fitness/main"][4] == pytest.approx(last.mean(), rel=1e-6)
    assert figures["fitness/main_best"][4] == pytest.approx(last.max(), rel=1e-6)
    expected = pd.read_csv(run / "summary.csv").expected_elo[0]
    assert figures["elo/expected"] == {4: pytest.approx(expected, rel=1e-6)}


def test_speeds_are_those_of_the_training_s_own_games(berteam, tmp_path):  # noqa: F811
    words = ["optimizer=mapelites", "selector=mcaa", "population=ppo6", *TINY, "evaluation.games=0"]
    berteam("train", *words, "optimizer.protect_new=0", "logger=tensorboard", "out=run")
    games, timing = (pd.read_csv(tmp_path / "run" / f"{name}.csv") for name in ("games", "timing"))
    own = games.groupby("epoch").steps.sum()
    assert (timing.set_index("epoch").env_steps > own).any()  # there are probing games, too
    for epoch, value in shown(tmp_path / "run")["play/steps_per_s"].items():
        assert value == pytest.approx(own[epoch] / timing.play_s[epoch - 1], rel=1e-6)


def test_the_tables_stay_as_they_are(run, berteam, tmp_path):  # noqa: F811
    berteam("train", *SMALL, "out=plain")
    tables = {path.name for path in run.glob("*.csv")}
    assert tables == {path.name for path in (tmp_path / "plain").glob("*.csv")}
    assert not (tmp_path / "plain" / FOLDER).exists()
    for name in tables - NEVER_THE_SAME:
        assert (run / name).read_bytes() == (tmp_path / "plain" / name).read_bytes(), name


def test_going_on_doubles_nothing(run, berteam):  # noqa: F811
    before = shown(run)
    shutil.rmtree(run / "checkpoint" / "epoch_00000004")  # as if it had been killed in epoch 4
    path = next((run / FOLDER).iterdir())
    path.write_bytes(path.read_bytes() + b"\x30\0\0\0")  # the beginning of a record
    berteam("resume", str(run), "epochs=6")
    after = shown(run)
    assert list(after["selector/buffer"]) == [1, 2, 3, 4, 5, 6]
    assert list(after["elo/expected"]) == [4, 6]
    assert after["timing/play_s"][3] == before["timing/play_s"][3]


def test_a_run_may_go_on_with_another_logger(berteam, tmp_path):  # noqa: F811
    berteam("train", *SMALL, "out=run")
    error = berteam("resume", "run", "epochs=6", "logger=tensorbord", code=2).stderr
    assert "logger must be one of csv, mlflow, tensorboard, wandb, but is 'tensorbord'. Did you mean" in error
    berteam("resume", "run", "epochs=6", "logger=tensorboard")
    assert list(shown(tmp_path / "run")["selector/buffer"]) == [5, 6]
    berteam("train", *SMALL, "out=run", "on_exists=overwrite")
    assert not (tmp_path / "run" / FOLDER).exists()


@pytest.mark.parametrize(("error", "ended"), [(None, "finished"), (OSError, "failed"), (KeyboardInterrupt, "killed")])
def test_it_is_told_how_the_run_ended(error, ended, tmp_path, monkeypatch):
    told = []
    monkeypatch.setattr(opening.Nowhere, "close", lambda self, how: told.append(how))
    opened = opening.logger(LoggerConfig(name="csv"), tmp_path, {"started": "now"}, {})
    with nullcontext() if error is None else pytest.raises(error), opened:
        if error is not None:
            raise error
    assert told == [ended]


def test_exploiters_are_not_rated(berteam, tmp_path):  # noqa: F811
    words = ["experiment=strong", *TINY, "evaluation.games=0", "evaluate_every=0", "logger=tensorboard", "out=run"]
    berteam("train", *words, "games_per_epoch=8")
    names = {name for name in shown(tmp_path / "run") if name.startswith("fitness/")}
    assert names == {"fitness/ppo64", "fitness/ppo64_best"}  # of ppo64 and the exploiters, ppo96


class Kept:
    def __init__(self, last):
        self.known, self.rows = last, []

    def last(self):
        return self.known

    def write(self, epoch, figures):
        self.rows.append((epoch, dict(figures)))


def test_each_figure_once():
    kept = Kept({"a": 3})
    once = Once(kept)
    once(3, {"a": 1.0})
    once(3, {"a": 1.0, "b": 2})
    once(4, {"a": 1.0, "b": float("nan")})
    once(4, {"a": 5.0})
    assert kept.rows == [(3, {"b": 2.0}), (4, {"a": 1.0})]
