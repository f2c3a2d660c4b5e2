"""Games on a Ray cluster of two machines."""

import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from logging.handlers import MemoryHandler
from pathlib import Path

import pytest
from llvmlite.binding import get_host_cpu_name

from berteam_cli import cluster
from berteam_cli.cluster import Call, Cluster, play_slice, slice_size
from berteam_cli.errors import RunError
from tests.command.conftest import BERTEAM, berteam, process  # noqa: F401 (fixtures)
from tests.env import games_for_tests
from tests.ray_machines import PATIENCE_S, Machine, kill, processes, until, variables

MISSING = "Ray is not installed: pip install 'berteam-cli[ray]'"
PPO = ["population=ppo6", "learner.n_steps=32", "learner.minibatch_size=32", "selector=mcaa", "epochs=2"]
MCTF = [*PPO, "env.max_time_s=30", "games_per_epoch=8", "evaluation.games=0"]
TIMED = {"timing.csv", "summary.csv"}
OWN = """
def pay(terms, before, after):
    return 3.0 * terms[0] + before[1] / 100.0

def broken(terms, before, after):
    return 1.0 / 0.0
"""


@pytest.fixture(scope="module")
def machines():
    """Two machines of one processor each; RAY_ADDRESS is theirs."""
    pytest.importorskip("ray", reason=MISSING)
    folder, started = Path(tempfile.mkdtemp(prefix="ray")), []
    with pytest.MonkeyPatch.context() as patch:
        for name, value in variables(str(folder)).items():
            patch.setenv(name, value)
        try:
            started.append(Machine(folder / "first.txt"))
            address = (folder / "ray" / "ray_current_cluster").read_text()
            started.append(Machine(folder / "second.txt", address))
            patch.setenv("RAY_ADDRESS", address)
            yield address
        finally:
            for machine in started:
                machine.cut()
            shutil.rmtree(folder)


def driving(*words, **settings):
    return subprocess.Popen(
        [sys.executable, "-m", "tests.ray_drivers", *map(str, words)],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
        **{"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, **settings},
    )


def drive(*words, **settings):
    with driving(*words, **settings) as driver:
        try:
            said, _ = driver.communicate(timeout=PATIENCE_S)
        finally:
            driver.kill()
    assert driver.returncode == 0, said


def same_tables(one, other, timed=TIMED):
    names = {path.name for path in one.glob("*.csv")}
    assert names and names == {path.name for path in other.glob("*.csv")}
    for name in names - timed:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def test_a_training_has_the_same_bytes_as_on_this_machine(machines, berteam, process, tmp_path):  # noqa: F811
    berteam("train", *MCTF, "workers=1", "out=here")
    said = process("train", *MCTF, "workers=ray", "out=there", "epochs=1").stdout
    assert "Games are played by Ray on 2 machine(s) with 2 processor(s)." in said
    process("resume", "there", "epochs=2")
    same_tables(tmp_path / "here", tmp_path / "there")


def test_an_evaluation_has_the_same_bytes_as_on_this_machine(machines, berteam, process, tmp_path):  # noqa: F811
    berteam("train", "env=rps", "population=ppo6", "selector=mcaa", "epochs=2", "evaluation.games=0", "out=run")
    for run, workers in ((berteam, "1"), (process, "ray")):
        run("evaluate", "run", "games_per_pair=2", "payoff_games=2", f"workers={workers}")
        shutil.copytree(tmp_path / "run" / "evaluation", tmp_path / workers)
    same_tables(tmp_path / "1", tmp_path / "ray", set())


def test_a_reward_of_the_users_own_travels_and_so_does_its_failure(machines, berteam, process, tmp_path):  # noqa: F811
    (tmp_path / "paid.py").write_text(OWN)
    said = {}
    for run, workers in ((berteam, "1"), (process, "ray")):
        run("train", *MCTF, "epochs=1", "env.reward=paid:pay", f"workers={workers}", f"out=w{workers}")
        words = ["env.reward=paid:broken", f"workers={workers}", "out=broken", "on_exists=overwrite"]
        said[workers] = run("train", *MCTF, *words, code=3).stderr
    same_tables(tmp_path / "w1", tmp_path / "wray")
    assert "env.reward must give finite numbers, but failed or did not in game " in said["1"]
    assert said["1"] == said["ray"]


def test_an_environment_of_the_users_own_travels(machines, tmp_path):
    shutil.copy(games_for_tests.__file__, tmp_path / "own_games.py")
    drive("plays_an_environment_of_the_users_own", cwd=tmp_path)


def test_workers_and_machines_that_die_change_nothing(machines, tmp_path):
    """A machine joins, loses two workers while they play, and then goes itself."""
    start, stop, said = tmp_path / "start", tmp_path / "stop", tmp_path / "said.txt"
    with said.open("w") as out, driving("plays_between", start, stop, stdout=out) as driver:
        try:
            until(lambda: "Connected." in said.read_text(), said.read_text)  # to a machine that stays
            mortal, killed = Machine(tmp_path / "mortal.txt", machines), set()
            try:
                start.touch()
                while len(killed) < 2:
                    until(lambda: set(mortal.playing()) - killed, said.read_text)
                    for player in set(mortal.playing()) - killed:
                        kill(player)
                        killed.add(player)
                until(lambda: set(mortal.playing()) - killed, said.read_text)
            finally:
                mortal.cut()
            before = said.read_text().count("The same.")
            until(lambda: said.read_text().count("The same.") >= before + 2, said.read_text)
            stop.touch()
            assert driver.wait(PATIENCE_S) == 0, said.read_text()
        finally:
            driver.kill()


def test_another_kind_of_processor_is_told_once(monkeypatch):
    kept = MemoryHandler(100)
    monkeypatch.setattr(cluster.log, "handlers", [kept])
    monkeypatch.setattr(cluster, "connect", lambda: None)
    there = Cluster()
    for processor in ("z80", "z80", get_host_cpu_name()):
        there.look(processor)
    assert ["has a z80 processor" in record.getMessage() for record in kept.buffer] == [True]


def test_a_machine_with_other_versions_is_refused():
    call = Call("", b"", *[None] * 4, versions={**cluster.versions(), "numba": "0.1"})
    with pytest.raises(RunError, match=r"A machine of the Ray cluster has numba .*, this one 0\.1\."):
        play_slice(pickle.dumps(call), 0, 1)


def test_when_all_tasks_fail_one_is_told(machines):
    drive("fails_everywhere")


@pytest.mark.parametrize(("games", "processors", "size"), [(1, 2, 1), (25, 2, 3), (2000, 2, 64), (2000, 64, 7)])
def test_slices_are_small_enough_for_everybody_to_play(games, processors, size):
    assert slice_size(games, processors) == size


def test_an_address_without_a_cluster_is_refused(process, tmp_path, monkeypatch):  # noqa: F811
    pytest.importorskip("ray", reason=MISSING)
    monkeypatch.setenv("RAY_ADDRESS", "somewhere")
    said = process("train", *MCTF, "workers=ray", "out=run", code=2).stderr
    assert said.startswith("berteam: workers=ray needs a Ray cluster, but there is none at RAY_ADDRESS=somewhere: ")
    assert not (tmp_path / "run").exists()


def test_without_ray_the_command_to_install_it_is_told(berteam, tmp_path, monkeypatch):  # noqa: F811
    monkeypatch.setitem(sys.modules, "ray", None)
    for words in (["train", *MCTF], ["tournament"]):
        said = berteam(*words, "workers=ray", "out=run", code=2).stderr
        assert said.endswith("which is not installed: pip install 'berteam-cli[ray]'.\n")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("given", ["rey", "1.5", "-1", "4097", "true", "null", "[1]", "''"])
def test_other_workers_are_refused(given, berteam, tmp_path):  # noqa: F811
    said = berteam("train", f"workers={given}", "out=run", code=2).stderr
    assert said.startswith("berteam: workers must be a whole number from 0 to 4096, or ray, but is ")
    assert ("Did you mean ray?" in said) == (given == "rey")
    assert not (tmp_path / "run").exists()


def test_ctrl_c_leaves_no_process(machines, tmp_path):
    """Of a Ray that the command started for itself."""
    environment = {name: value for name, value in os.environ.items() if name != "RAY_ADDRESS"}
    heard = ["env", "--default-signal=INT"]  # else it is deaf where a shell started the tests in the background
    words = [*heard, str(BERTEAM), "tournament", "games_per_pair=2000", "workers=ray", "out=run"]
    run = subprocess.Popen(
        words, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        assert any("Games are played by Ray on 1 machine(s)" in line for line in run.stdout)
        time.sleep(1)
        os.killpg(run.pid, signal.SIGINT)
        said, _ = run.communicate(timeout=PATIENCE_S)
    finally:
        run.kill()
    assert run.returncode == 130
    assert "Interrupted." in said
    until(lambda: not processes(run.pid), lambda: str(processes(run.pid)))
