import fcntl
import os
import subprocess
import sys

import pytest

from berteam_cli.errors import InputError, RunError
from berteam_cli.holding import held, in_use


def test_one_process_at_a_time(tmp_path):
    folder = tmp_path / "a" / "run"
    with held(folder):
        assert in_use(folder)
        with pytest.raises(InputError, match="is in use"), held(folder):
            pass
        other = f"import pathlib, berteam_cli.holding as h; print(h.in_use(pathlib.Path({str(folder)!r})))"
        assert subprocess.check_output([sys.executable, "-c", other], text=True) == "True\n"
    assert not in_use(folder)
    with held(folder):
        pass


def test_a_process_that_is_killed_holds_nothing(tmp_path):
    code = f"import pathlib, time, berteam_cli.holding as h\nwith h.held(pathlib.Path({str(tmp_path)!r})):\n"
    code += " print('held', flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "held\n"
        assert in_use(tmp_path)
        child.kill()
    assert not in_use(tmp_path)


def test_what_is_refused_leaves_nothing_that_was_not_there(tmp_path):
    with pytest.raises(InputError), held(tmp_path / "a" / "b"):
        raise InputError("no")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError), held(tmp_path):
        raise InputError("no")
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_folder_that_cannot_be_made_or_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"), held(tmp_path / "file" / "run"):
        pass
    with pytest.raises(RunError, match="No space"), held(tmp_path / "run"):
        raise OSError(28, "No space left on device")


def test_a_file_system_without_locks_is_told(tmp_path, monkeypatch, caplog):
    def none(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", none)
    with held(tmp_path):
        assert not in_use(tmp_path)
    assert "start no second process there" in caplog.text
    assert os.listdir(tmp_path) == ["log.txt"]
