"""The kernel against games recorded from the original."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mctf.check import main
from mctf.comparing import FLIP_M, FLIP_SHARE, SAME_M, check
from mctf.recording import SHAPES
from mctf.tournament import check_table

TRACES = Path(__file__).parents[1] / "traces"
EPISODES = {
    "default_config_2v2": 2,
    "mixed_1v1": 3,
    "mixed_3v3": 3,
    "mixed_5v5": 2,
    "policies_2v2": 26,
    "random_2v2": 7,
    "scripted_2v2": 14,
}
SMALL = TRACES / "mixed_1v1.npz"
TABLE = TRACES / "tournament_2v2.csv"


@pytest.fixture(scope="module")
def reports():
    return {name: check(TRACES / f"{name}.npz") for name in EPISODES}


@pytest.mark.parametrize("name", EPISODES)
def test_every_step_from_its_recorded_state(reports, name):
    report = reports[name]
    assert report.steps.first == []
    assert set(report.steps.counts.values()) == {0}
    # Far closer than the check asks: only the keep-out circle is not the original to the bit
    assert report.steps.worst["obs"] < 1e-6
    assert report.steps.worst["pos"] < 1e-6


@pytest.mark.parametrize("name", EPISODES)
def test_whole_episodes_from_their_start(reports, name):
    report = reports[name]
    assert len(report.episodes) == EPISODES[name]
    for episode in report.episodes:
        assert episode.as_recorded
        assert episode.captures[0] == episode.captures[1]
        assert episode.worst_m <= (FLIP_M if episode.contacts else SAME_M)
        assert episode.contacts or episode.differing == 0
    assert report.differing_share <= FLIP_SHARE
    assert report.as_recorded


def test_how_much_was_checked(reports):
    assert sorted(path.stem for path in TRACES.glob("*.npz")) == sorted(EPISODES)
    assert sum(report.steps.steps for report in reports.values()) == 17542
    assert sum(report.steps.choices for report in reports.values()) == 45486
    touched = [bool(episode.contacts) for report in reports.values() for episode in report.episodes]
    assert len(touched) == 57
    assert sum(touched) == 32


def test_tournament_of_fixed_teams():
    outcomes = check_table(TABLE)
    assert len(outcomes.same) == 441
    assert outcomes.same.all()


@pytest.mark.parametrize("name", SHAPES)
def test_a_changed_number_is_found(tmp_path, name):
    rng = np.random.default_rng(list(SHAPES).index(name))
    with np.load(SMALL) as archive:
        arrays = dict(archive)
    for row in (0, 200, 201, 602, *rng.integers(603, size=2)):
        index = (row, *(int(rng.integers(size)) for size in arrays[name].shape[1:]))
        if name == "action" and arrays["is_tagged"][index]:
            continue  # a tagged vehicle drives home by itself
        changed = arrays[name].copy()
        by_one = changed.dtype.kind == "i"
        changed[index] = ~changed[index] if changed.dtype.kind == "b" else changed[index] + (1 if by_one else 1e-3)
        path = tmp_path / "changed.npz"
        np.savez(path, **(arrays | {name: changed}))
        assert main([str(path)]) in (1, 2), (name, index)


def test_not_a_number_is_found(tmp_path, capsys):
    with np.load(SMALL) as archive:
        arrays = dict(archive)
    arrays["speed"][7, 1] = np.nan
    np.savez(tmp_path / "changed.npz", **arrays)
    assert main([str(tmp_path / "changed.npz")]) == 1
    assert "row 7, agent 1, field speed: recorded nan, computed " in capsys.readouterr().out


@pytest.mark.parametrize("column", range(12))
def test_a_changed_outcome_is_found(tmp_path, capsys, column):
    lines = TABLE.read_text().splitlines()[:40]
    values = lines[22].split(",")
    names = ("attack_medium", "defend_hard")
    values[column] = names[values[column] == names[0]] if column < 4 else str(int(values[column]) + 1)
    path = tmp_path / "changed.csv"
    path.write_text("\n".join([*lines[:22], ",".join(values), *lines[23:]]))
    assert main([str(path)]) == 1
    out = capsys.readouterr().out
    assert "38 of 39 games end with the same blue_captures, " in out
    assert "  line 23, " in out
    assert column < 4 or f"{lines[0].split(',')[column]} recorded {values[column]}, computed " in out


def test_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "mctf.check", str(SMALL), str(TABLE)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{SMALL}: all as recorded\n" in done.stdout
    assert "600 steps, 800 actions of fixed policies; 13 discrete fields equal\n" in done.stdout
    assert "3 of 3 replayed to their end as recorded\n" in done.stdout
    assert f"{TABLE}: all as recorded\n  441 of 441 games end with the same " in done.stdout
