"""Games on a Ray cluster: two machines, in Ray's eyes, that are started here."""

import gc
import logging
import os
import pickle
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from logging.handlers import MemoryHandler
from pathlib import Path

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_name

from berteam_cli import cluster
from berteam_cli.acting import fixed_policies
from berteam_cli.cluster import Call, Cluster, play_slice, slice_size
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.errors import RunError
from berteam_cli.games import Games, pairings
from tests.command.conftest import BERTEAM, berteam  # noqa: F401 (a fixture)
from tests.env import games_for_tests
from tests.makers import mctf, random_networks

MISSING = "Ray is not installed: pip install 'berteam-cli[ray]'"
STORE = 80 * 2**20  # bytes, of the objects of a machine
PPO = ["population=ppo6", "learner.n_steps=32", "learner.minibatch_size=32", "selector=mcaa", "epochs=2"]
MCTF = [*PPO, "env.max_time_s=30", "games_per_epoch=8", "evaluation.games=0"]
TIMED = {"timing.csv", "summary.csv"}
QUIET = {
    "num_cpus": 1,
    "object_store_memory": STORE,
    "include_dashboard": False,
    "include_log_monitor": False,
}
OWN = """
def pay(terms, before, after):
    return 3.0 * terms[0] + before[1] / 100.0

def broken(terms, before, after):
    return 1.0 / 0.0
"""


@pytest.fixture(scope="module")
def machines():
    """Two machines of one processor each; RAY_ADDRESS is theirs."""
    ray = pytest.importorskip("ray", reason=MISSING)
    from ray._private.authentication_test_utils import reset_auth_token_state  # noqa: PLC0415 (an extra)
    from ray.cluster_utils import Cluster as Machines  # noqa: PLC0415 (an extra)

    folder = tempfile.mkdtemp(prefix="ray")  # short, as sockets want it
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("RAY_AUTH_TOKEN", secrets.token_hex())  # else Ray keeps one in the user's home
        patch.setenv("RAY_AUTH_MODE", "token")
        reset_auth_token_state()  # Ray keeps those of the first Ray of a process, whichever test started that
        head = {**QUIET, "temp_dir": folder}
        made = Machines(initialize_head=True, head_node_args=head)
        try:
            made.add_node(**QUIET)
            patch.setenv("RAY_ADDRESS", made.address)
            yield made
        finally:
            ray.shutdown()
            made.shutdown()
            shutil.rmtree(folder, ignore_errors=True)
    reset_auth_token_state()


def raylet(machine):
    """Returns the process that starts and ends the workers of a machine."""
    return machine.all_processes["raylet"][0].process.pid


def busy(machine):
    """Returns the processes that play on a machine."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            name, parent = (folder / "cmdline").read_text(), (folder / "stat").read_text().rpartition(")")[2].split()[1]
        except OSError:  # it has just ended
            continue
        if name.startswith("ray::play_slice") and int(parent) == raylet(machine):
            found.append(int(folder.name))
    return found


def same_tables(one, other, timed=TIMED):
    names = {path.name for path in one.glob("*.csv")}
    assert names and names == {path.name for path in other.glob("*.csv")}
    for name in names - timed:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


def test_a_training_has_the_same_bytes_as_on_this_machine(machines, berteam, tmp_path):  # noqa: F811
    berteam("train", *MCTF, "workers=1", "out=here")
    said = berteam("train", *MCTF, "workers=ray", "out=there", "epochs=1").stdout
    assert "Games are played by Ray on 2 machine(s) with 2 processor(s)." in said
    berteam("resume", "there", "epochs=2")
    same_tables(tmp_path / "here", tmp_path / "there")


def test_an_evaluation_has_the_same_bytes_as_on_this_machine(machines, berteam, tmp_path):  # noqa: F811
    berteam("train", "env=rps", "population=ppo6", "selector=mcaa", "epochs=2", "evaluation.games=0", "out=run")
    for workers in ("1", "ray"):
        berteam("evaluate", "run", "games_per_pair=2", "payoff_games=2", f"workers={workers}")
        shutil.copytree(tmp_path / "run" / "evaluation", tmp_path / workers)
    same_tables(tmp_path / "1", tmp_path / "ray", set())


def test_a_reward_of_the_users_own_travels_and_so_does_its_failure(machines, berteam, tmp_path):  # noqa: F811
    (tmp_path / "paid.py").write_text(OWN)
    said = {}
    for workers in ("1", "ray"):
        berteam("train", *MCTF, "epochs=1", "env.reward=paid:pay", f"workers={workers}", f"out=w{workers}")
        words = ["env.reward=paid:broken", f"workers={workers}", "out=broken", "on_exists=overwrite"]
        said[workers] = berteam("train", *MCTF, *words, code=3).stderr
    same_tables(tmp_path / "w1", tmp_path / "wray")
    assert "env.reward must give finite numbers, but failed or did not in game " in said["1"]
    assert said["1"] == said["ray"]


def test_an_environment_of_the_users_own_travels(machines, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(games_for_tests.__file__, tmp_path / "own_games.py")
    env = Pettingzoo(1, "own_games:Contest", {}, {}, 1000, "reward")
    lineups = pairings(*np.zeros((2, 6, 1), dtype=np.int64))
    played = [
        Games(env, mctf().workers, elsewhere).play(fixed_policies([0]), lineups, 5, record=True)
        for elsewhere in (None, Cluster())
    ]
    (here, seen), (there, seen_there) = played
    assert np.array_equal(here.scores, there.scores)
    assert np.array_equal(seen.rewards[:, :, :6], seen_there.rewards[:, :, :6])


def test_workers_and_machines_that_die_change_nothing(machines):
    """A machine joins and loses two workers while they play, and then goes itself."""
    games = mctf()
    acting = random_networks(12, games.env, hidden=64)
    lineups = pairings(*np.random.default_rng(0).integers(12, size=(2, 100, 2)))
    here, _ = games.play(acting, lineups, 3)
    mortal, killed = machines.add_node(**QUIET), []

    def kill():
        while len(killed) < 2:
            for process in busy(mortal):
                os.kill(process, signal.SIGKILL)
                killed.append(process)
            time.sleep(0.02)
        while not busy(mortal):
            time.sleep(0.02)
        machines.remove_node(mortal, allow_graceful=False)
        killed.append(mortal)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    elsewhere = Games(games.env, games.workers, Cluster())
    for _ in range(200):
        there, _ = elsewhere.play(acting, lineups, 3)
        for name in ("scores", "steps", "events", "seeds"):
            assert np.array_equal(getattr(here, name), getattr(there, name)), name
        if not killer.is_alive():
            break
    assert killed[-1] is mortal


def test_another_kind_of_processor_is_told_once(machines, monkeypatch):
    kept = MemoryHandler(100)
    monkeypatch.setattr(cluster.log, "handlers", [kept])
    there = Cluster()
    for processor in ("z80", "z80", get_host_cpu_name()):
        there.look(processor)
    assert ["has a z80 processor" in record.getMessage() for record in kept.buffer] == [True]


def test_a_machine_with_other_versions_is_refused():
    call = Call("", b"", *[None] * 4, versions={**cluster.versions(), "numba": "0.1"})
    with pytest.raises(RunError, match=r"A machine of the Ray cluster has numba .*, this one 0\.1\."):
        play_slice(pickle.dumps(call), 0, 1)


def test_when_all_tasks_fail_one_is_told(machines, monkeypatch, caplog):
    """Ray would tell of the others too, whenever Python collects what nobody asks for."""
    monkeypatch.setattr(cluster, "versions", lambda: {"numba": "0.1"})
    games, lineups = mctf(), pairings(*np.zeros((2, 8, 2), dtype=np.int64))
    elsewhere = Games(games.env, games.workers, Cluster())
    for _ in range(3):
        with pytest.raises(RunError, match=r"A machine of the Ray cluster has numba"):
            elsewhere.play(fixed_policies([0]), lineups, 5)
        time.sleep(1)  # in which the others fail
        gc.collect()
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


@pytest.mark.parametrize(("games", "processors", "size"), [(1, 2, 1), (25, 2, 3), (2000, 2, 64), (2000, 64, 7)])
def test_slices_are_small_enough_for_everybody_to_play(games, processors, size):
    assert slice_size(games, processors) == size


def test_an_address_without_a_cluster_is_refused(berteam, tmp_path, monkeypatch):  # noqa: F811
    ray = pytest.importorskip("ray", reason=MISSING)
    ray.shutdown()
    monkeypatch.setenv("RAY_ADDRESS", "somewhere")
    said = berteam("train", *MCTF, "workers=ray", "out=run", code=2).stderr
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
        said, _ = run.communicate(timeout=60)
    finally:
        run.kill()
    assert run.returncode == 130
    assert "Interrupted." in said
    assert not session(run.pid)


def session(leader):
    """Returns the processes of a session, when they have had the time to end."""
    for _ in range(100):
        left = []
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                state, *_, sid = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if int(sid) == leader and state != "Z":
                left.append((folder / "cmdline").read_text())
        if not left:
            break
        time.sleep(0.1)
    return left
