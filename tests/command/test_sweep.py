"""Sweeps by the real launchers."""

import json
import re
import shlex
import shutil
import signal
import subprocess
import threading
import time
from collections import Counter

import pandas as pd
import pytest
import yaml

from berteam_cli.folder import Manifest
from berteam_cli.sweep.folder import LOCKS, STOP, Sweep, make_table, working
from berteam_cli.sweep.job import cores_each
from berteam_cli.sweep.launching import beginning
from berteam_cli.sweep.plan import NEEDS, spelt
from berteam_cli.workers import available_cores
from tests.command.conftest import BERTEAM

RPS = ["env=rps", "population=hands", "optimizer=fixed", "selector=uniform"]
TABLES = ("elo.csv", "games.csv", "team_distribution.csv", "selector.csv", "config.yaml")


def table(folder):
    return pd.read_csv(folder / "sweep.csv", index_col="job", keep_default_na=False, na_values={"expected_elo": [""]})


def break_job(sweep, job):
    """Puts a file where the job's checkpoints need a folder."""
    (sweep / str(job)).mkdir(parents=True)
    (sweep / str(job) / "checkpoint").write_text("in the way")


def test_joblib_goes_on_past_a_job_that_fails_and_resume_runs_it_again(berteam, tmp_path):
    sweep = tmp_path / "sweep"
    break_job(sweep, 3)
    words = ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]
    seeds = ",".join(map(str, range(8)))
    failed = berteam("train", "-m", *RPS, "epochs=2", f"seed={seeds}", "hydra.sweep.dir=sweep", *words, code=3)
    assert "1 runs of the sweep failed; sweep/sweep.csv says which" in failed.stderr
    assert f"berteam sweep --resume sweep {' '.join(words)}" in failed.stderr
    rows = table(sweep)
    assert list(rows.index) == list(range(8))
    assert list(rows.status) == ["failed" if job == 3 else "done" for job in range(8)]
    assert "NotADirectoryError" in rows.error[3]
    assert rows.expected_elo.isna().sum() == 1
    assert "seed=5" in rows.overrides[5]

    def written():
        return [(sweep / str(job) / "manifest.json").stat().st_mtime_ns for job in range(8)]

    before = written()
    (sweep / "3" / "checkpoint").unlink()
    assert "All 8 jobs are done" in berteam("sweep", "--resume", "sweep").stdout
    assert [job for job in range(8) if written()[job] != before[job]] == [3]
    assert (table(sweep).status == "done").all()
    berteam("train", *RPS, "epochs=2", "seed=5", "out=alone")
    for name in TABLES:
        assert (sweep / "5" / name).read_bytes() == (tmp_path / "alone" / name).read_bytes().replace(
            b"out: alone", b"out: null"
        )


@pytest.mark.parametrize(
    ("launcher", "settings"),
    [
        ("submitit_local", ["hydra.launcher.cpus_per_task=1"]),
        ("ray", ["+hydra.launcher.ray.init.num_cpus=1", "+hydra.launcher.ray.init.include_dashboard=false"]),
    ],
)
def test_a_job_that_fails_elsewhere_is_told_here(process, tmp_path, launcher, settings):
    break_job(tmp_path / "sweep", 1)
    words = ["hydra.sweep.dir=sweep", f"hydra/launcher={launcher}", *settings]
    failed = process("train", "-m", *RPS, "epochs=1", "seed=0,1", *words, code=3)  # Ray may end who drives it
    assert "berteam: job 1 (" in failed.stderr
    assert "seed=1): The run failed: NotADirectoryError" in failed.stderr
    assert "1 runs of the sweep failed" in failed.stderr
    assert list(table(tmp_path / "sweep").status) == ["done", "failed"]


def test_a_job_that_ends_is_not_seen_half_ended(tmp_path):
    """Its holder writes that it failed before why, and is found at any moment of that."""
    sweep = Sweep(tmp_path, "train", {0: []})
    sweep.keep()
    (tmp_path / "0").mkdir()
    ended, seen = threading.Event(), Counter()

    def look():
        while not ended.is_set():
            status, facts = sweep.status(0)
            seen[status, facts.get("error", "")] += 1

    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        for _ in range(300):
            with working(tmp_path / "0"):
                manifest = Manifest.begun(tmp_path / "0", error="")
                manifest.add(status="failed")
                manifest.add(error="the disk is full")
    finally:
        ended.set()
        watcher.join()
    assert ("failed", "the disk is full") in seen
    assert ("failed", "") not in seen
    assert {status for status, _ in seen} <= {"waiting", "running", "failed"}  # never as if it had been killed


def test_a_job_that_went_on_alone_no_longer_tells_how_it_failed(tmp_path):
    Sweep(tmp_path, "train", {0: ["seed=0"]}).keep()
    (tmp_path / "0").mkdir()
    Manifest.begun(tmp_path / "0").add(status="failed", error="the disk is full")
    make_table(tmp_path)
    assert list(table(tmp_path).error) == ["the disk is full"]
    with Manifest.resumed(tmp_path / "0").until_the_end():
        pass
    make_table(tmp_path)
    assert list(table(tmp_path).status) == ["done"]
    assert list(table(tmp_path).error) == [""]


def test_killed_in_the_middle_and_resumed(berteam, tmp_path):
    words = [*RPS, "epochs=20", "checkpoint_every=1", "evaluation.games=0"]
    berteam("train", *words, "seed=1", "out=whole")
    command = [BERTEAM, "train", *words, "seed=0,1,2", "hydra.sweep.dir=sweep", "-m"]
    running = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL)
    sweep, checkpoints = tmp_path / "sweep", tmp_path / "sweep" / "1" / "checkpoint"
    while not list(checkpoints.glob("epoch_0000000[3-9]")):
        assert running.poll() is None
        time.sleep(0.002)
    assert list(table(sweep).status) == ["done", "running", "waiting"]
    running.send_signal(signal.SIGKILL)
    running.wait()
    assert [Sweep.read(sweep).status(job)[0] for job in range(3)] == ["done", "interrupted", "waiting"]
    first = (sweep / "0" / "manifest.json").read_bytes()
    berteam("sweep", "--resume", "sweep")
    assert (table(sweep).status == "done").all()
    assert (sweep / "0" / "manifest.json").read_bytes() == first
    for job in (1, 2):
        assert ("resumed" in json.loads((sweep / str(job) / "manifest.json").read_text())) == (job == 1)
    for name in TABLES[:-1]:
        assert (sweep / "1" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes(), name


def test_a_file_lists_variants_and_what_each_is_combined_with(berteam, tmp_path):
    (tmp_path / "jobs.yaml").write_text(
        "command: train\n"
        "overrides: [env=rps, population=hands, optimizer=fixed, evaluation.games=0]\n"
        "list:\n- [selector=uniform, epochs=1]\n- [selector=mcaa, epochs=2]\n"
        "sweep:\n  seed: [3, 4]\n"
    )
    berteam("sweep", "jobs.yaml", "hydra.sweep.dir=my sweep")
    rows = table(tmp_path / "my sweep")
    assert [sorted(words.split()[-3:]) for words in rows.overrides] == [
        sorted([*variant, f"seed={seed}"])
        for variant in (["selector=uniform", "epochs=1"], ["selector=mcaa", "epochs=2"])
        for seed in (3, 4)
    ]
    assert list(rows.games.astype(int)) == [16, 16, 32, 32]
    assert (rows.status == "done").all()
    refused = berteam("sweep", "jobs.yaml", "hydra.sweep.dir=my sweep", code=2).stderr
    assert "berteam sweep --resume" in refused
    berteam("sweep", "jobs.yaml", "hydra.sweep.dir=short", "epochs=1", "seed=7")  # wins over all that the file says
    configs = [yaml.safe_load((tmp_path / "short" / job / "config.yaml").read_text()) for job in ("0", "1")]
    assert [(config["epochs"], config["seed"]) for config in configs] == [(1, 7), (1, 7)]
    assert list(table(tmp_path / "short").status) == ["done"] * 2


def test_a_job_that_ends_before_its_turn_is_not_begun_anew(tmp_path):
    """Whoever is at work on it, `berteam resume` or a task of an earlier launch."""
    sweep = Sweep(tmp_path, "train", {0: []})
    sweep.keep()
    (tmp_path / "0").mkdir()
    with working(tmp_path / "0"):
        Manifest.begun(tmp_path / "0")
        assert beginning(sweep, 0) == ["on_exists=resume"]
    assert beginning(sweep, 0) == ["on_exists=overwrite"]  # killed before its first checkpoint
    (tmp_path / "0" / "manifest.json").write_text("{")
    assert sweep.status(0)[0] == "failed"
    assert "no readable manifest.json" in sweep.status(0)[1]["error"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("overides: [seed=1]", "Did you mean overrides?"),
        ("sweep: {seed: 1}", "sweep must give each key a list of values"),
        ("sweep: {sead: [1, 2]}", "sead is no key"),
        ("list: [[selector=nobody]]", "selector must be one of"),
        ("list: [[seed]]", "list must be a list of KEY=VALUE"),
        ("command: inspect", "command must be one of"),
        ("- 1", "must hold the keys"),
        ("a: [", "cannot be read"),
        ("overrides: ['seed=interval(0,1)']", "berteam optuna searches through ranges"),
        ("overrides: [hydra.sweep.subdir=x]", "hydra.sweep.subdir cannot be changed"),
    ],
)
def test_a_wrong_file_is_refused_before_anything_is_written(berteam, tmp_path, text, said):
    (tmp_path / "jobs.yaml").write_text(text)
    assert said in berteam("sweep", "jobs.yaml", code=2).stderr
    assert [path.name for path in tmp_path.iterdir()] == ["jobs.yaml"]


@pytest.mark.parametrize("launcher", NEEDS)
def test_a_launcher_that_is_not_installed_is_named_with_its_command(berteam, tmp_path, monkeypatch, launcher):
    from berteam_cli.sweep import plan  # noqa: PLC0415

    monkeypatch.setattr(plan, "find_spec", lambda module: None)  # as where nothing is installed
    said = berteam("train", "-m", *RPS, "seed=0,1", f"hydra/launcher={launcher}", code=2).stderr
    assert f"pip install 'berteam-cli[{NEEDS[launcher][1]}]'" in said
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_sweep_does_not_go_on(berteam, tmp_path):
    berteam("train", *RPS, "epochs=1", "evaluation.games=0", "out=run")
    assert "berteam resume goes on with a run" in berteam("sweep", "--resume", "run", code=2).stderr
    assert "run/none is no folder of a sweep" in berteam("sweep", "--resume", "run/none", code=2).stderr
    assert not (tmp_path / "run" / "none").exists()
    assert "the file must be given first" in berteam("sweep", code=2).stderr


def test_nothing_runs_that_only_lies_in_the_folder(berteam, tmp_path):
    Sweep(tmp_path / "sweep", "train", {0: [*RPS, "epochs=1", "env.reward=os:abort"]}).keep()
    said = berteam("sweep", "--resume", "sweep", code=2).stderr
    assert "env.reward=os:abort, which may run code" in said
    Sweep(tmp_path / "sweep", "train", {0: [*RPS, "+hydra.callbacks.x._target_=os.abort"]}).keep()
    assert "which may run code" in berteam("sweep", "--resume", "sweep", code=2).stderr
    Sweep(tmp_path / "sweep", "doctor", {}).keep()
    assert "command must be one of" in berteam("sweep", "--resume", "sweep", code=2).stderr


@pytest.mark.parametrize(
    "words",
    [
        ["+hydra={job_logging:{handlers:{x:{class:os.abort}}}}"],
        ["out=os:abort", "env.reward=${out}"],
        ["logger=mlflow", "logger.tracking=http://example.com"],
        ["logger={name:wandb,mode:online}"],
    ],
)
def test_no_way_round_is_left_to_what_only_lies_in_the_folder(berteam, tmp_path, words):
    Sweep(tmp_path / "my sweep", "train", {0: [*RPS, "epochs=1", *words]}).keep()
    said = berteam("sweep", "--resume", "my sweep", code=2).stderr
    assert f"says {words[-1]}, which may run code or send something elsewhere" in said
    assert f"berteam sweep --resume 'my sweep' {shlex.quote(words[-1])}" in said
    assert not (tmp_path / "my sweep" / "0").exists()


def test_neither_ranges_nor_trials_of_a_folder_bring_code(berteam, tmp_path):
    optuna = pytest.importorskip("optuna")
    asked = {"overrides": [*RPS, "epochs=1"], "trials": 1, "at_once": 1, "seed": 0}
    Sweep(tmp_path / "sweep", "train", {}, asked | {"ranges": {"env.reward": ["os:abort"]}}).keep()
    assert "env.reward='os:abort', which may run code" in berteam("sweep", "--resume", "sweep", code=2).stderr
    Sweep(tmp_path / "sweep", "train", {}, asked | {"ranges": 3}).keep()
    assert "holds no search that can go on" in berteam("sweep", "--resume", "sweep", code=2).stderr
    # A trial whose value is none of the range's, as only a hand can have written it
    Sweep(tmp_path / "sweep", "train", {}, asked | {"ranges": {"selector": ["uniform"]}}).keep()
    backend = optuna.storages.journal.JournalFileBackend(str(tmp_path / "sweep" / "optuna.log"))
    storage = optuna.storages.JournalStorage(backend)
    study = optuna.create_study(study_name="berteam", storage=storage, direction="maximize")
    study.ask({"selector": optuna.distributions.CategoricalDistribution(["trust=os:abort"])})
    berteam("sweep", "--resume", "sweep")
    assert Sweep.read(tmp_path / "sweep").jobs == {}
    assert [trial.state.name for trial in study.get_trials()] == ["FAIL"]


def test_a_job_whose_words_do_not_fit_for_a_while_keeps_what_it_has(berteam, tmp_path):
    sweep, job = tmp_path / "sweep", tmp_path / "sweep" / "0"
    Sweep(sweep, "train", {0: [*RPS, "epochs=2"]}).keep()
    berteam("sweep", "--resume", "sweep")
    manifest = Manifest.of(job)
    manifest.add(status="interrupted")
    kept = sorted(path.name for path in (job / "checkpoint").iterdir())
    Sweep(sweep, "train", {0: [*RPS, "epochs=2", "selector=mine"]}).keep()  # as where --config-dir is forgotten
    berteam("sweep", "--resume", "sweep", code=3)
    (row,) = table(sweep).itertuples()
    assert row.status == "interrupted"
    assert "mine" in row.error
    assert sorted(path.name for path in (job / "checkpoint").iterdir()) == kept
    Sweep(sweep, "train", {0: [*RPS, "epochs=2"]}).keep()
    berteam("sweep", "--resume", "sweep")
    assert len(Manifest.of(job).facts["resumed"]) == 1  # it went on
    assert table(sweep).status[0] == "done"


def test_a_job_is_asked_to_stop_wherever_it_runs(berteam, tmp_path, monkeypatch):
    """By a file that all see, as not every process hears of Ctrl-C. One that lay there before asks for nothing."""
    from berteam_cli.command import train  # noqa: PLC0415

    sweep, whole = tmp_path / "sweep", train.epoch
    Sweep(sweep, "train", {0: [*RPS, "epochs=5"]}).keep()
    stop = sweep / LOCKS / STOP

    def epoch(run, parts):
        if run.epoch == 2:
            stop.touch()
        return whole(run, parts)

    monkeypatch.setattr(train, "epoch", epoch)
    berteam("train", *RPS, "epochs=5", "out=sweep/0", code=130)
    assert len(pd.read_csv(sweep / "0" / "timing.csv")) == 3
    monkeypatch.setattr(train, "epoch", whole)
    assert stop.exists()
    berteam("resume", "sweep/0")
    assert len(pd.read_csv(sweep / "0" / "timing.csv")) == 5


def test_a_job_is_one_of_its_sweep_s_from_within_its_folder_too(berteam, tmp_path, monkeypatch):
    sweep = tmp_path / "sweep"
    Sweep(sweep, "train", {0: [*RPS, "epochs=2"]}).keep()
    berteam("sweep", "--resume", "sweep")
    monkeypatch.chdir(sweep / "0")
    with working(sweep / "0"):
        assert "Another process is at work" in berteam("resume", ".", "epochs=3", code=2).stderr
    before = (sweep / "sweep.csv").read_text()
    berteam("resume", ".", "epochs=3")
    assert (sweep / "sweep.csv").read_text() != before


def test_what_does_not_go_together_is_refused_and_the_rest_runs(berteam, tmp_path):
    Sweep(tmp_path / "sweep", "train", {0: [*RPS, "selector=nobody"], 1: [*RPS, "epochs=1"]}).keep()
    refused = berteam("sweep", "--resume", "sweep", code=3).stderr
    assert "berteam: job 0 (" in refused
    assert list(table(tmp_path / "sweep").status) == ["refused", "done"]


def test_a_sweeper_that_is_not_ours_has_a_table_too(berteam, tmp_path):
    berteam("train", "-m", *RPS, "epochs=1", "seed=0,1", "hydra/sweeper=basic", "hydra.sweep.dir=sweep")
    rows = table(tmp_path / "sweep")
    assert list(rows.status) == ["done", "done"]
    assert "seed=1" in rows.overrides[1]


def test_two_processes_do_not_share_a_job(berteam, tmp_path):
    Sweep(tmp_path / "sweep", "train", {0: [*RPS, "epochs=1"]}).keep()
    with working(tmp_path / "sweep" / "0"):
        assert Sweep.read(tmp_path / "sweep").status(0)[0] == "running"
    with working(tmp_path / "sweep" / "sweep"):
        assert "Another process is at work" in berteam("sweep", "--resume", "sweep", code=2).stderr


def test_cores_are_divided_among_the_jobs_at_once():
    cores = available_cores()
    joblib = {"_target_": "hydra_plugins.hydra_joblib_launcher.joblib_launcher.JoblibLauncher", "n_jobs": -1}
    assert cores_each(joblib, 1000) == 1
    assert cores_each(joblib, 1) == cores
    assert cores_each(joblib | {"n_jobs": 1}, 8) == cores
    assert cores_each(joblib | {"n_jobs": 10 * cores}, 1000) == 1
    local = {"_target_": "a.LocalLauncher", "cpus_per_task": None}
    assert cores_each(local, cores) == 1
    assert cores_each({"_target_": "a.SlurmLauncher", "cpus_per_task": None}, 8) == 1
    assert cores_each({"_target_": "a.RayLauncher", "ray": {"remote": {"num_cpus": cores}}}, 8) == cores
    assert cores_each({"_target_": "a.BasicLauncher"}, 8) == cores


def test_optuna_searches_and_goes_on(berteam, tmp_path):
    pytest.importorskip("optuna")
    (tmp_path / "search.yaml").write_text(
        "overrides: [env=rps, population=hands, optimizer=fixed, selector=mcaa, evaluation.games=200]\n"
        "search:\n"
        "  selector.learning_rate: {low: 1e-3, high: 1.0, log: true}\n"
        "  games_per_epoch: {low: 16, high: 24}\n"
        "  epochs: [1, 2]\n"
        "trials: 4\nat_once: 2\nseed: 5\n"
    )
    done = berteam("optuna", "search.yaml", "hydra.sweep.dir=whole")
    rows = table(tmp_path / "whole")
    best = int(re.search(r"Best of 4 trials: job (\d)", done.stdout)[1])
    assert rows.expected_elo[best] == rows.expected_elo.max()
    given = [dict(word.split("=") for word in words.split()) for words in rows.overrides]
    assert all(1e-3 <= float(x["selector.learning_rate"]) <= 1 for x in given)
    assert all(16 <= int(x["games_per_epoch"]) <= 24 and x["epochs"] in "12" for x in given)
    assert len({x["selector.learning_rate"] for x in given}) == 4

    # As a kill leaves it while trials 2 and 3 run: they were asked for, and nothing came of them.
    cut = tmp_path / "cut"
    shutil.copytree(tmp_path / "whole", cut)
    lines = (cut / "optuna.log").read_text().splitlines(keepends=True)
    told = [k for k, line in enumerate(lines) if re.search(r'"state": ?1\b', line)]
    (cut / "optuna.log").write_text("".join(lines[: told[2]]))
    sweep = Sweep.read(cut)
    for job in (2, 3):
        shutil.rmtree(cut / str(job))
        del sweep.jobs[job]
    sweep.keep()
    assert len(table(cut)) == 2
    assert "Best of 4 trials" in berteam("sweep", "--resume", "cut").stdout
    assert list(table(cut).overrides) == list(rows.overrides)
    assert list(table(cut).expected_elo) == list(rows.expected_elo)

    break_job(tmp_path / "sweep", 3)
    failed = berteam("optuna", "search.yaml", "hydra.sweep.dir=sweep", code=3)
    assert "Best of 3 trials" in failed.stdout
    assert list(table(tmp_path / "sweep").overrides) == list(rows.overrides)
    assert list(table(tmp_path / "sweep").status) == ["done", "done", "done", "failed"]


def test_a_trial_whose_process_died_is_not_told_as_failed(berteam, tmp_path):
    pytest.importorskip("optuna")
    from berteam_cli.sweep.search import search  # noqa: PLC0415

    asked = {"overrides": [*RPS, "epochs=1", "evaluation.games=200"], "trials": 2, "at_once": 1, "seed": 0}
    Sweep(tmp_path / "sweep", "train", {}, asked | {"ranges": {"seed": [1, 2]}}).keep()
    begun = []

    def killed(jobs):  # as the launcher leaves it: a run that began, and nobody at work on it
        begun.extend(jobs)
        for job in jobs:
            (tmp_path / "sweep" / str(job)).mkdir()
            Manifest.begun(tmp_path / "sweep" / str(job))
        make_table(tmp_path / "sweep")
        return True

    search(Sweep.read(tmp_path / "sweep"), killed)
    assert begun == [0]
    assert "Best of 2 trials" in berteam("sweep", "--resume", "sweep").stdout
    assert list(table(tmp_path / "sweep").status) == ["done", "done"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("search: {seed: {low: 5, high: 1}}", "search.seed is no range"),
        ("search: {seed: {low: 0, top: 1}}", "must be a list of choices, or low and high"),
        ("search: {epochs: {low: -3, high: 1}}", "epochs must be"),
        ("search: {seed: [0, 1]}\ntrials: 0", "trials must be a whole number >= 1"),
        ("trials: 3", "search must give keys"),
        ("search: {seed: {low: a, high: 1}}", "search.seed.low must be a number"),
    ],
)
def test_a_wrong_search_is_refused_before_anything_is_written(berteam, tmp_path, text, said):
    pytest.importorskip("optuna")
    (tmp_path / "search.yaml").write_text(text)
    assert said in berteam("optuna", "search.yaml", code=2).stderr
    assert [path.name for path in tmp_path.iterdir()] == ["search.yaml"]


@pytest.mark.parametrize("value", [None, True, 3, 0.25, "a-b", "it's", "a,b", "x\\", "x\\'y", [1, "a b"], {"k": [1]}])
def test_values_of_yaml_survive_as_words(value):
    from hydra.core.override_parser.overrides_parser import OverridesParser  # noqa: PLC0415

    assert OverridesParser.create().parse_override(f"key={spelt(value)}").value() == value
