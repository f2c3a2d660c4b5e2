import os
import stat

import pytest

from mctf.cache import forget_stale


@pytest.fixture
def package(tmp_path):
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "rule.py").write_text("x = 1\n")
    forget_stale(tmp_path)
    return tmp_path


def compiled(package):
    paths = [package / "__pycache__" / name for name in ("f.nbi", "f.1.nbc", "rule.cpython.pyc")]
    for path in paths:
        path.touch()
    return paths


def test_kept_while_sources_are_the_same(package):
    paths = compiled(package)
    forget_stale(package)
    assert all(path.exists() for path in paths)


@pytest.mark.parametrize("edit", ["change", "add", "remove", "rename"])
def test_forgotten_after_an_edit(package, edit):
    paths = compiled(package)
    source = package / "rule.py"
    if edit == "change":
        source.write_text("x = 2\n")
    elif edit == "add":
        (package / "more.py").touch()
    elif edit == "remove":
        source.unlink()
    else:
        source.rename(package / "law.py")
    forget_stale(package)
    assert [path.exists() for path in paths] == [False, False, True]
    paths = compiled(package)
    forget_stale(package)
    assert all(path.exists() for path in paths)


def test_other_folders_count(package, tmp_path):
    other = tmp_path / "other"
    other.mkdir()
    (other / "callee.py").write_text("y = 1\n")
    forget_stale(package, other)
    paths = compiled(package)
    (other / "callee.py").write_text("y = 2\n")
    forget_stale(package, other)
    assert not paths[0].exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_silent_where_it_cannot_write(package):
    folder = package / "__pycache__"
    (package / "rule.py").write_text("x = 2\n")
    folder.chmod(stat.S_IRUSR | stat.S_IXUSR)
    before = sorted(path.name for path in folder.iterdir())
    forget_stale(package)
    folder.chmod(stat.S_IRWXU)
    assert sorted(path.name for path in folder.iterdir()) == before


def test_silent_where_there_is_nothing(tmp_path):
    (tmp_path / "__pycache__").write_text("a file")
    forget_stale(tmp_path)
    assert (tmp_path / "__pycache__").read_text() == "a file"
