import json

import numpy as np
import pytest

from berteam_cli import build, checkpoint
from berteam_cli.checkpoint import Saved
from berteam_cli.config import checked
from berteam_cli.errors import RunError
from berteam_cli.training import begin, epoch
from tests.test_config import composed

WORDS = ["env.max_time_s=20", "population=islands4x3", "selector.width=16", "selector.layers=1", "selector.heads=2"]


@pytest.fixture(scope="module")
def parts():
    return build.parts(checked(composed(*WORDS)))


@pytest.fixture
def runs(parts, tmp_path):
    """Three saved epochs; returns the runs."""
    made = [begin(parts)]
    for _ in range(3):
        made.append(epoch(made[-1], parts)[0])
        checkpoint.save(tmp_path, Saved(made[-1], {"games": 7}, 1.5), parts)
    return made


def tensors(run, parts):
    return {name: tensor.numpy().tobytes() for name, tensor in checkpoint.tensors_of(run, parts).items()}


def test_a_run_comes_back_whole(runs, parts, tmp_path):
    saved = checkpoint.load(tmp_path, parts)
    assert saved.run.epoch == 3
    assert saved.run.played == 48
    assert saved.table_sizes == {"games": 7}
    assert tensors(saved.run, parts) == tensors(runs[3], parts)
    again, _ = epoch(saved.run, parts)
    once, _ = epoch(runs[3], parts)
    assert tensors(again, parts) == tensors(once, parts)


def test_the_last_two_are_kept(runs, tmp_path):
    assert sorted(p.name for p in (tmp_path / "checkpoint").iterdir()) == ["epoch_00000002", "epoch_00000003"]


@pytest.mark.parametrize("damage", ["flip", "cut", "no state", "half a state", "other", "number"])
def test_a_damaged_checkpoint_is_passed_over(damage, runs, parts, tmp_path):
    newest = tmp_path / "checkpoint" / "epoch_00000003"
    state, data = newest / "state.json", newest / "tensors.safetensors"
    if damage == "flip":
        raw = bytearray(data.read_bytes())
        raw[len(raw) // 2] ^= 1
        data.write_bytes(raw)
    elif damage == "cut":
        data.write_bytes(data.read_bytes()[:1000])
    elif damage == "no state":
        state.unlink()
    elif damage == "half a state":
        state.write_text(state.read_text()[:40])
    elif damage == "number":  # still good JSON, of another epoch
        state.write_text(state.read_text().replace('"played": 48', '"played": 40'))
    else:
        state.write_text(json.dumps(json.loads(state.read_text()) | {"schema": 99}))
    assert checkpoint.load(tmp_path, parts).run.epoch == 2


def test_a_run_that_went_back_leaves_no_later_checkpoint(runs, parts, tmp_path):
    """Else a damaged one would be taken for the newest for ever, and be one of the two that are kept."""
    newest = tmp_path / "checkpoint" / "epoch_00000003" / "tensors.safetensors"
    newest.write_bytes(newest.read_bytes()[:-1])
    back = checkpoint.load(tmp_path, parts)
    assert back.run.epoch == 2
    checkpoint.save(tmp_path, back, parts)
    assert [p.name for p in (tmp_path / "checkpoint").iterdir()] == ["epoch_00000002"]
    checkpoint.save(tmp_path, Saved(runs[3], {}, 0.0), parts)
    assert checkpoint.load(tmp_path, parts).run.epoch == 3


def test_what_cannot_be_written_leaves_the_others(runs, parts, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(checkpoint, "save_file", full)
    with pytest.raises(OSError, match="No space"):
        checkpoint.save(tmp_path, Saved(runs[1], {}, 0.0), parts)
    assert sorted(p.name for p in (tmp_path / "checkpoint").iterdir()) == ["epoch_00000002", "epoch_00000003"]


def test_an_unfinished_checkpoint_is_not_one(runs, parts, tmp_path):
    (tmp_path / "checkpoint" / "part").mkdir()
    (tmp_path / "checkpoint" / "part" / "state.json").write_text("{")
    assert checkpoint.load(tmp_path, parts).run.epoch == 3


def test_no_checkpoint_is_said(parts, tmp_path):
    with pytest.raises(RunError, match="no checkpoint"):
        checkpoint.load(tmp_path, parts)


def test_an_epoch_depends_on_nothing_but_the_run(runs, parts):
    """The run before is as it was, but for the minds, which learn in place."""
    assert [run.epoch for run in runs] == [0, 1, 2, 3]
    np.testing.assert_array_equal(runs[0].population.age, 0)
    np.testing.assert_array_equal(runs[0].population.games, 0)


def test_restored_tensors_begin_where_new_ones_would(runs, parts, tmp_path):
    """By where a tensor lies torch chooses its kernels, and so the last bits: within a file they lie anywhere."""
    (learnt,) = checkpoint.load(tmp_path, parts).run.selection.learnt
    for kind in (learnt.weights, learnt.means, learnt.squares):
        assert {tensor.data_ptr() % 64 for tensor in kind.values()} == {0}
