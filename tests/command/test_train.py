"""The main job, for real: every selector with every optimizer, and the tables they leave."""

import json
import re
import shutil
import signal
import subprocess
import time
import weakref

import numpy as np
import pandas as pd
import pytest

from berteam_cli import checkpoint
from berteam_cli.command import train
from berteam_cli.records import COLUMNS, GROWING
from tests.command.conftest import BERTEAM, SMALL_BERTEAM, TINY

TABLES = ("elo", "summary", *GROWING)
UNTIMED = [name for name in TABLES if name not in {"timing", "summary"}]


def read(folder, name):
    return pd.read_csv(folder / f"{name}.csv", dtype={"team": str, "blue": str, "red": str, "best_team": str})


def selector_words(selector):
    return [f"selector={selector}", *(SMALL_BERTEAM if selector == "berteam" else [])]


def check_tables(folder, members, epochs=4, games=4):
    """Asserts that every table is there with its columns and says what must be true of any run."""
    tables = {name: read(folder, name) for name in TABLES}
    for name, table in tables.items():
        assert tuple(table.columns) == COLUMNS[name]
        assert b"\r" not in (folder / f"{name}.csv").read_bytes()
    recorded = [0, 2, 4]
    teams = members * (members + 1) // 2
    for name, rows in (("team_distribution", teams), ("captain_distribution", members)):
        assert list(tables[name].epoch.unique()) == recorded
        np.testing.assert_allclose(tables[name].groupby("epoch").probability.sum(), 1, atol=1e-9)
        assert len(tables[name]) == rows * len(recorded)
    np.testing.assert_allclose(tables["island_distribution"].groupby("epoch").probability.sum(), 1, atol=1e-9)
    played = tables["games"]
    assert len(played) == epochs * games
    assert ((played.blue_score + played.red_score) == 1).all()
    assert ((played.blue_score > played.red_score) == (played.blue_captures > played.red_captures)).all()
    assert played.seed.is_unique
    agents = tables["agents"]
    assert len(agents) == members * len(recorded)
    assert list(tables["timing"].epoch) == list(range(1, epochs + 1)) == list(tables["selector"].epoch)
    elo = tables["elo"]
    assert (elo.elo_low < elo.elo).all()
    assert (elo.elo < elo.elo_high).all()
    assert elo.elo.is_monotonic_decreasing
    assert ((elo.wins + elo.draws + elo.losses) == elo.games).all()
    assert list(elo["rank"]) == list(range(1, len(elo) + 1))
    last = tables["team_distribution"].query("epoch == 4").set_index("team").probability
    np.testing.assert_array_equal(elo.set_index("team").probability, last[elo.team])
    summary = tables["summary"].iloc[0]
    assert summary.best_team == elo.team[0]
    assert summary.games == epochs * games
    assert summary.env_steps == tables["timing"].env_steps.sum() >= played.steps.sum()
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["status"] == "done"
    assert manifest["evaluation"]["rated"] == len(elo)
    return tables


@pytest.mark.parametrize("optimizer", ["coevolution", "mapelites"])
@pytest.mark.parametrize("selector", ["berteam", "mcaa", "uniform"])
def test_every_selector_with_every_optimizer(selector, optimizer, berteam, tmp_path):
    words = [*TINY, *selector_words(selector), f"optimizer={optimizer}", "population=islands4x3", "out=run"]
    learner = "population.islands.{}.learner.n_steps=64"
    words += [learner.format(name) for name in ("ppo64", "ppo96")] + ["optimizer.protect_new=0"]
    words += ["evaluation.games=448"]  # 8 of the 78 teams
    done = berteam("train", *words)
    assert done.stdout.splitlines()[0] == "run"
    tables = check_tables(tmp_path / "run", 12)
    assert len(tables["elo"]) == 8
    assert (tables["learning"].updates > 0).any()
    assert len(tables["generations"]) > 0
    assert set(tables["learning"].algorithm) == {"ppo", "dqn"}
    captains = tables["games"].blue_captain
    assert (captains == -1).all() if selector == "mcaa" else (captains >= 0).all()
    assert tables["agents"].aggression.notna().any() == (optimizer == "mapelites")


def test_fixed_policies(process, tmp_path):
    words = ["optimizer=fixed", "population=fixed_policies", *TINY, *SMALL_BERTEAM, "out=run"]
    process("train", *words, "evaluation.games=10000")
    tables = check_tables(tmp_path / "run", 7)
    assert len(tables["elo"]) == 28
    assert len(tables["generations"]) == 0
    assert set(tables["agents"].name) > {"attack_hard", "random"}


def test_the_same_seed_gives_the_same_bytes_whatever_the_workers(berteam, tmp_path):
    words = ["population=islands4x3", *TINY, *SMALL_BERTEAM, "optimizer=mapelites", "optimizer.protect_new=0"]
    for workers in (1, 2, 3):
        berteam("train", *words, f"workers={workers}", f"out=w{workers}")
    for name in UNTIMED:
        one = (tmp_path / "w1" / f"{name}.csv").read_bytes()
        assert one == (tmp_path / "w2" / f"{name}.csv").read_bytes(), name
        assert one == (tmp_path / "w3" / f"{name}.csv").read_bytes(), name
    berteam("train", *words, "seed=1", "out=other")
    assert (tmp_path / "other" / "games.csv").read_bytes() != (tmp_path / "w1" / "games.csv").read_bytes()


@pytest.mark.parametrize("selector", ["berteam", "mcaa"])
def test_a_resumed_run_ends_with_the_same_bytes(selector, berteam, tmp_path):
    words = [*selector_words(selector), "population=islands4x3", *TINY, "optimizer.protect_new=1"]
    words += [f"population.islands.{name}.learner.n_steps=64" for name in ("ppo64", "ppo96")]
    berteam("train", *words, "out=whole", "epochs=6")
    berteam("train", *words, "out=parts", "epochs=3")
    berteam("resume", "parts", "epochs=6", "workers=1")
    for name in UNTIMED:
        assert (tmp_path / "parts" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()


def test_an_interrupted_run_goes_on(berteam, tmp_path):
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "games_per_epoch=4"]
    words += ["record_every=100", "checkpoint_every=10000"]
    berteam(*words, "epochs=1200", "out=whole")
    process = subprocess.Popen(
        [BERTEAM, *words, "epochs=1200", "out=cut"], cwd=tmp_path, stdout=subprocess.PIPE, text=True
    )
    table = tmp_path / "cut" / "games.csv"
    while not (table.exists() and table.stat().st_size > 5000):
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "berteam resume cut" in said
    assert json.loads((tmp_path / "cut" / "manifest.json").read_text())["status"] == "interrupted"
    berteam("resume", "cut")
    for name in UNTIMED:
        assert (tmp_path / "cut" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()


def test_on_exists(berteam, tmp_path):
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "out=run"]
    berteam(*words, "epochs=2")
    (tmp_path / "run" / "notes.txt").write_text("mine")
    before = {path.name: path.read_bytes() for path in (tmp_path / "run").glob("*.*")}
    refused = berteam(*words, "epochs=2", code=2)
    assert "on_exists=overwrite" in refused.stderr
    assert {path.name: path.read_bytes() for path in (tmp_path / "run").glob("*.*")} == before
    changed = berteam(*words, "games_per_epoch=5", "epochs=3", "on_exists=resume", code=2)
    assert "games_per_epoch" in changed.stderr
    berteam(*words, "epochs=3", "on_exists=resume")
    assert len(read(tmp_path / "run", "timing")) == 3
    berteam(*words, "epochs=1", "on_exists=overwrite")
    assert len(read(tmp_path / "run", "timing")) == 1
    assert (tmp_path / "run" / "notes.txt").read_text() == "mine"


def test_a_failed_run_says_so_and_keeps_its_state(berteam, tmp_path):
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "out=run"]
    berteam(*words, "epochs=2")
    newest, _ = sorted((tmp_path / "run" / "checkpoint").glob("epoch_*/tensors.safetensors"), reverse=True)
    newest.write_bytes(newest.read_bytes()[:-1] + b"?")
    assert "epoch_00000002 is damaged" in berteam("resume", "run", "epochs=3").stderr
    for state in (tmp_path / "run" / "checkpoint").glob("epoch_*/tensors.safetensors"):
        state.write_bytes(state.read_bytes()[:-1] + b"?")
    before = (tmp_path / "run" / "config.yaml").read_bytes()
    done = berteam("resume", "run", "epochs=4", code=3)
    assert "checksum" in done.stderr
    assert (tmp_path / "run" / "config.yaml").read_bytes() == before
    assert "Traceback" not in done.stderr


def test_sweep(process, tmp_path):
    words = ["-m", "selector=uniform,mcaa", "seed=0,1", "population=islands4x3", "hydra.sweep.dir=sweep"]
    process("train", *words, *TINY, "epochs=2", "evaluation.games=112")
    table = pd.read_csv(tmp_path / "sweep" / "sweep.csv")
    assert list(table.job) == [0, 1, 2, 3]
    assert (table.status == "done").all()
    assert table.overrides[1].startswith("selector=uniform seed=1")
    assert table.expected_elo.notna().all()
    for job in range(4):
        assert (tmp_path / "sweep" / str(job) / "elo.csv").exists()


def test_sampled_distribution_says_so(berteam, tmp_path):
    words = ["env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "epochs=1", "selector.exact_limit=4"]
    berteam("train", *words, "out=run")
    table = read(tmp_path / "run", "team_distribution")
    assert list(table[table.epoch == 1].team[-1:]) == ["other"]
    np.testing.assert_allclose(table.groupby("epoch").probability.sum(), 1)
    assert len(table[table.epoch == 1]) == 5
    assert "estimated from 20000" in json.loads((tmp_path / "run" / "manifest.json").read_text())["team_distribution"]
    assert read(tmp_path / "run", "selector")[["effective_teams", "entropy"]].isna().all(axis=None)


def test_flags_of_hydra(berteam, tmp_path):
    assert "learning_rate" in berteam("train", "selector=mcaa", "--cfg", "job").stdout
    helped = berteam("train", "--help").stdout
    assert "  selector: assessor, berteam, best_members, best_team, mcaa, psro, uniform\n" in helped
    assert "schema" not in helped
    assert "berteam train selector=mcaa optimizer=mapelites" in helped
    assert list(tmp_path.iterdir()) == []
    assert berteam("--version").stdout.strip()
    assert "tournament" in berteam("--help").stdout


def test_a_folder_of_ones_own_choices(berteam, tmp_path):
    mine = tmp_path / "mine" / "population"
    mine.mkdir(parents=True)
    (mine / "pair.yaml").write_text(
        "defaults: [/schema/population/islands@_here_, _self_]\nislands: {main: {size: 2, learner: '${learner}'}}\n"
    )
    berteam("train", "--config-dir", "mine", "population=pair", "env=rps", "selector=uniform", "epochs=2", "out=run")
    assert set(read(tmp_path / "run", "agents").agent) == {0, 1}


def test_an_island_without_a_learner_is_told_where_one_is_chosen(berteam, tmp_path):
    mine = tmp_path / "mine" / "population"
    mine.mkdir(parents=True)
    for name, learner in (("bare", "{name: ppo}"), ("odd", "{name: ppo, n_steps: 64}")):
        text = (
            f"defaults: [/schema/population/islands@_here_, _self_]\nislands: {{main: {{size: 2, learner: {learner}}}}}"
        )
        (mine / f"{name}.yaml").write_text(text)
    words = ["train", "--config-dir", "mine", "env=rps", "out=run"]
    said = berteam(*words, "population=bare", code=2).stderr
    assert "population.islands.main.learner must be one of ppo, dqn, sb3: a population's yaml chooses it" in said
    assert "learner.n_steps is no key here; there are name." in berteam(*words, "population=odd", code=2).stderr


def test_a_run_that_ends_before_its_first_checkpoint_does_not_promise_to_go_on(berteam, tmp_path, monkeypatch):
    from berteam_cli.command import train  # noqa: PLC0415

    def interrupted(parts):
        raise KeyboardInterrupt

    monkeypatch.setattr(train, "begin", interrupted)
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "out=run"]
    assert "Interrupted. Begin anew with on_exists=overwrite." in berteam(*words, code=130).stdout


def test_a_run_killed_at_once_goes_on(tmp_path, process):
    """Before its first regular checkpoint, and without a chance to say good-bye."""
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "record_every=100"]
    killed = subprocess.Popen([BERTEAM, *words, "epochs=100000", "out=cut"], cwd=tmp_path, stdout=subprocess.DEVNULL)
    table = tmp_path / "cut" / "games.csv"
    while not (table.exists() and table.stat().st_size > 500):
        assert killed.poll() is None
        time.sleep(0.02)
    killed.kill()
    killed.wait()
    assert json.loads((tmp_path / "cut" / "manifest.json").read_text())["status"] == "running"
    config = tmp_path / "cut" / "config.yaml"
    config.write_text(config.read_text().replace("epochs: 100000", "epochs: 30"))
    process("resume", "cut")
    process(*words, "epochs=30", "out=whole")
    for name in UNTIMED:
        assert (tmp_path / "cut" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()
    manifest = json.loads((tmp_path / "cut" / "manifest.json").read_text())
    assert manifest["status"] == "done"
    assert len(manifest["resumed"]) == 1


def test_what_was_loaded_does_not_stay_in_memory(berteam, monkeypatch):
    words = ["selector=uniform", "population=ppo6", *TINY, "evaluation.games=0", "out=run"]
    berteam("train", *words)
    loaded, alive = [], []
    load, end = checkpoint.load, train.conclude

    def kept(*args):
        saved = load(*args)
        loaded[:] = [weakref.ref(saved), weakref.ref(saved.run)]
        return saved

    def looked(*args):
        alive[:] = [ref() is not None for ref in loaded]
        return end(*args)

    monkeypatch.setattr(checkpoint, "load", kept)
    monkeypatch.setattr(train, "conclude", looked)
    berteam("resume", "run", "epochs=5")
    assert alive == [False, False]


@pytest.mark.parametrize("moment", ["between two epochs", "after the last one"])
def test_a_signal_outside_of_an_epoch_loses_nothing(moment, berteam, tmp_path, monkeypatch):
    words = ["selector=uniform", "population=ppo6", *TINY, "checkpoint_every=100", "evaluation.games=8", "out=run"]
    done, keep = train.epoch, checkpoint.save

    def at_the_beginning(run, parts):
        if run.epoch == 1:  # the first thing in the second epoch is the last between the two
            signal.raise_signal(signal.SIGINT)
        return done(run, parts)

    def at_the_end(folder, saved, parts):
        keep(folder, saved, parts)
        if saved.run.epoch == 4:
            signal.raise_signal(signal.SIGINT)

    between = moment == "between two epochs"
    monkeypatch.setattr(*((train, "epoch", at_the_beginning) if between else (checkpoint, "save", at_the_end)))
    berteam("train", *words, code=130)
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert len(read(tmp_path / "run", "timing")) == (2 if between else 4)
    assert not (tmp_path / "run" / "summary.csv").exists()
    berteam("resume", "run")
    assert len(read(tmp_path / "run", "timing")) == 4


def test_resume_refuses_what_would_not_be_the_same_run(berteam, tmp_path):
    berteam("train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "epochs=3", "out=run")
    assert "epochs must be >= 3" in berteam("resume", "run", "epochs=2", code=2).stderr
    assert "seed cannot be changed" in berteam("resume", "run", "seed=2", code=2).stderr
    assert "cannot be read as key=value" in berteam("resume", "run", "epochs", code=2).stderr
    (tmp_path / "run" / "games.csv").write_text("epoch\n")
    assert "games.csv is shorter" in berteam("resume", "run", "epochs=4", code=3).stderr
    (tmp_path / "run" / "config.yaml").write_text("a: [")
    assert "config.yaml cannot be read" in berteam("resume", "run", code=2).stderr
    (tmp_path / "run" / "manifest.json").write_text("[1]")
    assert "is no folder of a run" in berteam("inspect", "run", code=2).stderr


def test_train_goes_on_with_a_run_that_it_is_told(berteam, tmp_path):
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform"]
    berteam(*words, "epochs=4", "out=whole")
    berteam(*words, "epochs=2", "out=run")
    berteam("train", "resume=run", "epochs=4")
    for name in UNTIMED:
        assert (tmp_path / "run" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()
    assert "seed cannot be changed" in berteam("train", "resume=run", "seed=3", code=2).stderr
    assert "goes on with one run" in berteam("train", "-m", "resume=run", "epochs=5", code=2).stderr
    assert "nowhere is no folder of a run" in berteam("train", "resume=nowhere", code=2).stderr


def test_what_is_a_share_of_the_epochs_stays_as_it_began(berteam, tmp_path):
    """However a run is told to go on, newcomers are protected for an eighth of the epochs it began with."""
    learner = ["population=ppo6", "learner.n_steps=4", "learner.minibatch_size=4", "evaluation.games=0"]
    words = ["train", "env=rps", "selector=mcaa", *learner]
    for name in ("one", "other"):
        berteam(*words, "epochs=16", f"out={name}")
    berteam(*words, "epochs=24", "out=one", "on_exists=resume")
    berteam("resume", "other", "epochs=24")
    for name in UNTIMED:
        assert (tmp_path / "one" / f"{name}.csv").read_bytes() == (tmp_path / "other" / f"{name}.csv").read_bytes()
    assert "protect_new: 2\n" in (tmp_path / "one" / "config.yaml").read_text()
    fixed = [*words, "optimizer=fixed", "out=fixed"]  # which replaces nobody
    berteam(*fixed, "epochs=2")
    berteam(*fixed, "epochs=3", "on_exists=resume")
    said = berteam(*words, "epochs=32", "optimizer.protect_new=3", "out=one", "on_exists=resume", code=2).stderr
    assert "optimizer.protect_new is 3, but the run in one was begun with 2" in said


def test_a_run_killed_in_the_middle_of_rows_is_read(berteam, tmp_path):
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=mcaa", "epochs=4", "out=run"]
    berteam(*words, "evaluation.games=0", "record_every=2")
    manifest = tmp_path / "run" / "manifest.json"
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | {"status": "running"}))
    for name in GROWING:
        table = tmp_path / "run" / f"{name}.csv"
        table.write_bytes(table.read_bytes()[:-3])
    for name in ("elo", "summary"):
        (tmp_path / "run" / f"{name}.csv").unlink()
    for command in ("inspect", "report", "evaluate"):
        berteam(command, "run")
    said = berteam("inspect", "run").stdout
    assert "run: broken off, started" in said
    assert "Next: berteam resume run" in said
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | {"status": "done"}))
    assert "is cut off in the middle of line" in berteam("inspect", "run", code=2).stderr


def test_a_run_without_a_checkpoint_begins_again(berteam, tmp_path):
    words = ["train", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "epochs=2", "out=run"]
    berteam(*words)
    whole = {name: (tmp_path / "run" / f"{name}.csv").read_bytes() for name in UNTIMED}
    shutil.rmtree(tmp_path / "run" / "checkpoint")
    (tmp_path / "run" / "elo.csv").unlink()
    berteam("resume", "run")
    assert {name: (tmp_path / "run" / f"{name}.csv").read_bytes() for name in UNTIMED} == whole
    for state in (tmp_path / "run" / "checkpoint").glob("*/state.json"):
        state.write_text("{}")
    assert "is damaged" in berteam(*words, "on_exists=resume", code=3).stderr  # which is not for us to throw away


def test_a_run_goes_on_where_updates_explode(berteam, tmp_path):
    words = ["env=rps", "population=ppo6", "selector=uniform", "games_per_epoch=12", "epochs=12"]
    words += ["learner.n_steps=16", "learner.minibatch_size=8", "learner.activation=relu", "learner.max_grad_norm=1e9"]
    words += ["learner.learning_rate=1e9", "learner.value_coef=1e9", "optimizer.protect_new=2"]
    said = berteam("train", *words, "out=whole").stdout
    assert "Updates gave weights or a loss that are not finite, and were undone; of members:" in said
    learning = read(tmp_path / "whole", "learning")
    assert learning.failures.sum() > 10
    assert learning.loss[learning.failures > 0].isna().any()
    assert np.isfinite(read(tmp_path / "whole", "elo").elo).all()
    berteam("train", *words, "workers=1", "epochs=7", "out=parts")
    berteam("resume", "parts", "epochs=12")
    for name in UNTIMED:
        assert (tmp_path / "parts" / f"{name}.csv").read_bytes() == (tmp_path / "whole" / f"{name}.csv").read_bytes()


def test_a_run_of_another_version_is_refused_before_anything_else(berteam, tmp_path):
    words = ["env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "out=run"]
    berteam("train", *words, "epochs=2")
    for state in (tmp_path / "run" / "checkpoint").glob("*/state.json"):
        state.write_text(re.sub(r'"schema": \d+', '"schema": 1', state.read_text()))
    config = (tmp_path / "run" / "config.yaml").read_text()
    (tmp_path / "run" / "config.yaml").write_text(config.replace("epochs: 2\n", "epochs: 2\nforgotten: 1\n"))
    for command in (["resume", "run"], ["train", *words, "on_exists=resume"], ["tournament", "run=run"]):
        assert "run of another version of berteam" in berteam(*command, code=2).stderr
    berteam("train", *words, "epochs=1", "on_exists=overwrite")


def test_a_sweep_does_not_take_another_ones_runs_for_its_own(berteam, tmp_path):
    words = ["-m", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "hydra.sweep.dir=sweep"]
    berteam("train", *words, "seed=0,1", "epochs=2")
    before = (tmp_path / "sweep" / "sweep.csv").read_bytes()
    assert "holds a sweep already" in berteam("train", *words, "seed=5,6", "epochs=2", code=2).stderr
    assert (tmp_path / "sweep" / "sweep.csv").read_bytes() == before
    berteam("resume", "sweep/1", "epochs=3")
    table = pd.read_csv(tmp_path / "sweep" / "sweep.csv")
    assert list(table.games) == [32, 48]
    assert "seed=1" in table.overrides[1]
    assert "seed=1" in berteam("inspect", "sweep").stdout


def test_a_job_that_fails_does_not_end_the_sweep(berteam, tmp_path, monkeypatch):
    from berteam_cli.command import train  # noqa: PLC0415

    begin = train.begin

    def begin_unless_one(parts):
        if parts.seed == 1:
            raise MemoryError("no room")
        return begin(parts)

    monkeypatch.setattr(train, "begin", begin_unless_one)
    words = ["-m", "env=rps", "population=hands", "optimizer=fixed", "selector=uniform", "hydra.sweep.dir=sweep"]
    done = berteam("train", *words, "seed=0,1,2", "epochs=1", "evaluation.games=1000", code=3)
    assert "1 runs of the sweep failed" in done.stderr
    table = pd.read_csv(tmp_path / "sweep" / "sweep.csv")
    assert list(table.status) == ["done", "failed", "done"]
    assert "MemoryError: no room" in table.error[1]
    assert table.expected_elo.isna().tolist() == [False, True, False]
    assert "no room" in (tmp_path / "sweep" / "1" / "error.txt").read_text()


def test_a_reward_of_ones_own_lies_in_the_current_folder(process, tmp_path):
    (tmp_path / "mine.py").write_text("def pay(terms, before, after):\n    return terms[12] - before[3] + after[3]\n")
    words = ["selector=uniform", "population=ppo6", *TINY, "learner.n_steps=32", "learner.minibatch_size=16"]
    process("train", *words, "env.reward=mine:pay", "out=mine")
    process("train", *words, "env.reward=sparse", "out=sparse")
    losses = [read(tmp_path / run, "learning").loss.dropna() for run in ("mine", "sparse")]
    assert len(losses[0]) == len(losses[1]) > 0
    assert not losses[0].equals(losses[1])
    process("resume", "mine", "epochs=5", "trust=mine:pay")


def test_a_reward_that_is_no_number_ends_the_run(process, tmp_path):
    (tmp_path / "mine.py").write_text("def pay(terms, before, after):\n    return 1.0 / (terms[0] - terms[0])\n")
    words = ["selector=uniform", "population=ppo6", *TINY, "env.reward=mine:pay", "out=run"]
    said = process("train", *words, code=3).stderr
    assert "env.reward must give finite numbers, but failed or did not in game 0, of seed" in said
