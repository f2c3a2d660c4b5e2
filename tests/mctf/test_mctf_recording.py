"""Files that hold no recorded games are refused in one sentence."""

from pathlib import Path

import numpy as np
import pytest

from mctf.check import main

TRACES = Path(__file__).parents[1] / "traces"
SMALL = TRACES / "mixed_1v1.npz"
TABLE = TRACES / "tournament_2v2.csv"


@pytest.fixture
def refused(capsys):
    """Returns what is said of a file, one line that names it."""

    def told(path):
        assert main([str(path)]) == 2
        out = capsys.readouterr().out
        assert out.startswith(f"{path}: ")
        assert out.count("\n") == 1
        assert out[-2:] in (".\n", "?\n")
        return out.removeprefix(f"{path}: ")

    return told


def written(tmp_path, **changes):
    with np.load(SMALL) as archive:
        arrays = dict(archive)
    for name, change in changes.items():
        arrays[name] = change(arrays[name].copy())
    path = tmp_path / "changed.npz"
    np.savez(path, **arrays)
    return path


def in_meta(old, new):
    def change(meta):
        assert old in str(meta)
        return np.array(str(meta).replace(old, new))

    return {"meta": change}


@pytest.mark.parametrize("kept", [1, 10, 0.1, 0.5, 0.9, 0.99, -1])
def test_a_cut_off_file(tmp_path, refused, kept):
    whole = SMALL.read_bytes()
    path = tmp_path / "cut.npz"
    path.write_bytes(whole[: kept if isinstance(kept, int) else int(kept * len(whole))])
    assert refused(path).startswith(
        "is no npz archive of arrays, or is cut off or damaged; it must be a whole npz file"
    )


def test_damaged_files(tmp_path):
    """Whatever byte is wrong, the file is refused in words, or the byte belongs to none of the numbers."""
    whole, path = SMALL.read_bytes(), tmp_path / "damaged.npz"
    rng = np.random.default_rng(0)
    wrong = [*range(0, 120, 3), *range(len(whole) - 60, len(whole)), *rng.integers(len(whole), size=60)]
    statuses = []
    for place in wrong:
        damaged = bytearray(whole)
        damaged[place] ^= 0xFF
        path.write_bytes(damaged)
        statuses.append(main([str(path)]))
    assert set(statuses) == {0, 2}
    assert statuses.count(2) > 100


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"pos": lambda a: a[:-1]}, "has an array pos of float64 of shape (602, 2, 2); for the team_size 1 "),
        ({"pos": lambda a: a.astype(int)}, "must be floating-point numbers of shape (603, 2, 2)."),
        ({"has_flag": lambda a: a.astype(int)}, "must be True and False of shape (603, 2)."),
        ({"score": lambda a: a.astype(float)}, "must be signed whole numbers of shape (603, 2, 3)."),
        ({"obs": lambda a: a[..., :-1]}, "must be floating-point numbers of shape (603, 2, 29)."),
        ({"action": lambda a: a + 20}, "has entries of action in 19..36; they must be in -1..16."),
        ({"policy": lambda a: a - 1}, "they must be in 0..7."),
        ({"heading": lambda a: a * np.inf}, "they must be in -180..180."),
        ({"heading": lambda a: a + 1e300}, "they must be in -180..180."),
        ({"episode_step": lambda a: a + 1}, "has no row that starts an episode at its top"),
        ({"episode": lambda a: a + 1}, "has rows 0 to 200 as episode 0 with episode out of order"),
        (
            {"meta": lambda a: np.array("{}")},
            "has settings (meta) that cannot be read (lacks 'team_size'); they must be",
        ),
        ({"meta": lambda a: np.array("no json")}, "has settings (meta) that cannot be read (Expecting value"),
        ({"meta": lambda a: np.array("[1]")}, "has settings (meta) that cannot be read"),
        (in_meta('"team_size": 1', '"team_size": 2'), "for the team_size 2 of its settings and 603 rows it must be"),
        (in_meta('"team_size": 1', '"team_size": 1.5'), "has reward and team_size 'custom_rew2' and 1.5; they must be"),
        (in_meta('"team_size": 1', '"team_size": true'), "cannot be read (team_size is True, not a number)"),
        (in_meta('"tau": 0.1', '"tau": -0.1'), "has steps of 1 s in time; its settings must say the same"),
        (in_meta('"tau": 0.1', '"tau": NaN'), "has steps of 1 s in time; its settings must say the same"),
        (in_meta("custom_rew2", "sparse"), "has reward and team_size 'sparse' and 1; they must be 'custom_rew2'"),
        (in_meta('"max_time": 200.0', '"max_time": [200.0]'), "max_time is [200.0], not a number"),
        (in_meta('"max_speed": 1.5', '"max_speed": 0'), "not allowed: max_speed must be a finite number > 0"),
        (in_meta("[200.0, 100.0]", "[200.0]"), "not allowed: world_size_m must be two numbers"),
        ({"pos": lambda a: np.array([None])}, "is no npz archive of arrays"),
    ],
)
def test_other_content(tmp_path, refused, changes, said):
    assert said in refused(written(tmp_path, **changes))


def test_missing_arrays(tmp_path, refused):
    with np.load(SMALL) as archive:
        arrays = {name: archive[name] for name in archive.files if name not in ("thrust", "meta")}
    np.savez(tmp_path / "less.npz", **arrays)
    assert refused(tmp_path / "less.npz").startswith("lacks the arrays thrust, meta; it must be a whole npz file")


def test_no_rows(tmp_path, refused):
    with np.load(SMALL) as archive:
        arrays = {name: archive[name] if name == "meta" else archive[name][:0] for name in archive.files}
    np.savez(tmp_path / "none.npz", **arrays)
    assert refused(tmp_path / "none.npz").startswith("has no rows; it must be a whole npz file")


def test_an_episode_of_one_row(tmp_path, refused):
    with np.load(SMALL) as archive:
        arrays = {name: archive[name] if name == "meta" else archive[name][:202] for name in archive.files}
    np.savez(tmp_path / "start.npz", **arrays)
    assert refused(tmp_path / "start.npz").startswith("has rows 201 to 201 as episode 1 with ")


@pytest.mark.parametrize("name", ["games.npz", "games.csv", "games"])
def test_what_is_no_file_of_games(tmp_path, refused, name):
    path = tmp_path / name
    assert refused(path).startswith("cannot be read (No such file or directory); it must be a ")
    path.mkdir()
    assert refused(path).startswith("cannot be read (Is a directory); it must be a ")
    path.rmdir()
    path.write_text("")
    assert refused(path).startswith("is empty; it must be a ")
    path.write_text("hello")
    assert " must be " in refused(path)
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    assert " must be " in refused(path)
    with path.open("wb") as file:
        np.savez(file, x=np.zeros(3))
    assert " must be " in refused(path)


def test_no_file(capsys):
    assert main([]) == 2
    assert capsys.readouterr().out.count("\n") == 1


def test_one_bad_file_does_not_hide_the_others(tmp_path, capsys):
    assert main([str(tmp_path / "none.npz"), str(SMALL)]) == 2
    assert f"{SMALL}: all as recorded\n" in capsys.readouterr().out


def table(tmp_path, change):
    path = tmp_path / "games.csv"
    path.write_text(change(TABLE.read_text()))
    return path


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[: len(text) // 2], "; there must be 12, one for each column."),
        (lambda text: text.split("\n")[0], "has no games below its columns"),
        (lambda text: text.replace("blue_0,", "", 1), "has the columns 'blue_1,red_0,red_1,blue_captures,"),
        (
            lambda text: text.replace("blue_1,", "", 1),
            "has 12 values in line 2; there must be 11, one for each column.",
        ),
        (lambda text: text.replace("steps", "length", 1), "; they must be 'blue_0,blue_1,red_0,red_1,blue_captures,"),
        (lambda text: text.replace(",263,", ",many,", 1), "has 'many' as steps in line 2; it must be a whole number"),
        (lambda text: text.replace(",263,", ",-263,", 1), "has '-263' as steps in line 2; it must be a whole number"),
        (lambda text: text.replace("attack_easy", "attack_esay", 1), "defend_hard. Did you mean attack_easy?"),
        (lambda text: text.replace("attack_easy", "random", 1), "has 'random' as blue_0 in line 2; it must be one of"),
        (lambda text: text.replace("263", "2\x0063", 1), " in line "),
        (lambda text: text.replace("attack_easy", '"attack_easy', 1), "is no csv text (unexpected end of data)"),
    ],
)
def test_other_tables(tmp_path, refused, change, said):
    assert said in refused(table(tmp_path, change))
