"""The kernel against games recorded from the original, and the check that compares them."""

import csv
import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mctf.check import check, main
from mctf.kernel import step
from mctf.play import play_scripted
from mctf.recording import read
from mctf.rules import make_rules
from mctf.scripted import NAMES
from mctf.state import CAPTURES, GRABS, TAGS, empty, reset

TRACES = Path(__file__).parents[1] / "traces"
FILES = sorted(TRACES.glob("*.npz"))
SMALL = TRACES / "mixed_1v1.npz"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_recorded_games(path):
    report = check(path)
    assert report.mismatches == []
    assert report.rows > 0
    # Far closer than the check asks: only the keep-out circle is not the original to the bit
    assert report.worst["obs"] < 1e-6
    assert report.worst["pos"] < 1e-6


def test_how_much_was_checked():
    reports = [check(path) for path in FILES]
    assert len(FILES) == 7
    assert sum(report.rows for report in reports) == 17542
    assert sum(report.choices for report in reports) == 45486


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_whole_episodes_from_their_first_row(path):
    recording = read(path)
    for episode, rules in enumerate(recording.rules):
        rows = recording.rows(episode)
        recorded = {name: array[rows] for name, array in recording.arrays.items()}
        state = empty(1, rules.team_size)
        reset(state, 0, rules)
        for row, actions in enumerate(recorded["action"][:-1].astype(np.int64)):
            step(state, 0, actions, rules)
            np.testing.assert_array_equal(state.score[0], recorded["score"][row + 1])
            np.testing.assert_array_equal(state.is_tagged[0], recorded["is_tagged"][row + 1])
            np.testing.assert_allclose(state.pos[0], recorded["pos"][row + 1], rtol=0, atol=1e-4)


def test_tournament_of_fixed_teams():
    with (TRACES / "tournament_2v2.csv").open() as file:
        games = list(csv.DictReader(file))
    policies = np.array([[NAMES.index(game[place]) for place in list(game)[:4]] for game in games])
    state = play_scripted(policies, np.zeros(len(games), np.uint64), make_rules())
    played = np.column_stack(
        [*(state.score[:, team, kind] for kind in (CAPTURES, GRABS, TAGS) for team in (0, 1)), state.steps]
    )
    recorded = np.array([[int(value) for value in list(game.values())[4:11]] for game in games])
    assert list(games[0])[4:11] == [
        *(f"{team}_{kind}" for kind in ("captures", "grabs", "tags") for team in ("blue", "red")),
        "steps",
    ]
    assert len(games) == 441
    assert (played == recorded).all(axis=1).sum() == 441


def changed(tmp_path, **changes):
    with np.load(SMALL) as archive:
        arrays = dict(archive)
    for name, change in changes.items():
        arrays[name] = change(arrays[name].copy())
    path = tmp_path / "changed.npz"
    np.savez(path, **arrays)
    return path


def nudged(field, row):
    def change(array):
        first = (row, *[0] * (array.ndim - 1))
        if array.dtype.kind == "f":
            array[first] += 1e-3 if field == "obs" else 1e-4
        else:
            array[first] = not array[first] if array.dtype.kind == "b" else array[first] + 1
        return array

    return {field: change}


FIELDS = sorted(np.load(SMALL).files)


@pytest.mark.parametrize(
    ("field", "row"), list(itertools.product((name for name in FIELDS if name != "meta"), (0, 100, 200, 602)))
)
def test_a_changed_number_is_found(tmp_path, capsys, field, row):
    status = main([str(changed(tmp_path, **nudged(field, row)))])
    assert status == 1 or (status == 2 and field in ("policy", "episode", "episode_step"))
    assert field in capsys.readouterr().out or status == 2 or field == "action"


def test_not_a_number_is_found(tmp_path, capsys):
    def spoil(array):
        array[7, 1] = np.nan
        return array

    assert main([str(changed(tmp_path, speed=spoil))]) == 1
    assert "row 7, agent 1, field speed: recorded nan, computed " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"max_time": 200.0', '"max_time": 199.0'),
        ('"max_score": 99', '"max_score": 98'),
        ("10.0", "10.1"),
        ("30.0", "29.0"),
    ],
)
def test_a_changed_setting_is_found(tmp_path, old, new):
    def change(meta):
        assert old in str(meta)
        return np.array(str(meta).replace(old, new))

    assert main([str(changed(tmp_path, meta=change))]) == 1


@pytest.mark.parametrize("kept", [0, 10, 0.1, 0.5, 0.99])
def test_a_cut_off_file_is_refused(tmp_path, capsys, kept):
    whole = SMALL.read_bytes()
    path = tmp_path / "cut.npz"
    path.write_bytes(whole[: kept if isinstance(kept, int) else int(kept * len(whole))])
    assert main([str(path)]) == 2
    assert capsys.readouterr().out.count("\n") == 1


def test_a_damaged_file_is_refused(tmp_path):
    whole = bytearray(SMALL.read_bytes())
    whole[5000] ^= 0xFF
    path = tmp_path / "damaged.npz"
    path.write_bytes(whole)
    assert main([str(path)]) == 2


@pytest.mark.parametrize(
    "changes",
    [
        {"pos": lambda a: a[:-1]},
        {"pos": lambda a: a.astype(int)},
        {"obs": lambda a: a[..., :-1]},
        {"action": lambda a: a + 20},
        {"episode_step": lambda a: a + 1},
        {"meta": lambda a: np.array("{}")},
        {"meta": lambda a: np.array("no json")},
        {"meta": lambda a: np.array(str(a).replace('"team_size": 1', '"team_size": 2'))},
        {"meta": lambda a: np.array(str(a).replace('"tau": 0.1', '"tau": -0.1'))},
        {"meta": lambda a: np.array(str(a).replace("custom_rew2", "sparse"))},
        {"pos": lambda a: np.array([None])},
    ],
)
def test_other_content_is_refused(tmp_path, capsys, changes):
    assert main([str(changed(tmp_path, **changes))]) == 2
    assert capsys.readouterr().out.count("\n") == 1


def test_foreign_files_are_refused(tmp_path, capsys):
    np.save(tmp_path / "one.npy", np.zeros(3))
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    (tmp_path / "text.npz").write_text("hello")
    assert main([]) == 2
    for path in (tmp_path / "one.npy", tmp_path / "other.npz", tmp_path / "text.npz", tmp_path / "none.npz", tmp_path):
        assert main([str(path)]) == 2
    assert capsys.readouterr().out.count("\n") == 6


def test_the_command():
    done = subprocess.run([sys.executable, "-m", "mctf.check", str(SMALL)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "600 rows" in done.stdout
