"""Checkpoints, tables and archives that hold something else than numbers."""

import json
import pickle
import re
import shutil
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from berteam_cli import checkpoint
from berteam_cli.errors import RunError
from berteam_cli.reading import last_state
from tests.hostile.conftest import FEW, MARK, READERS, RUNS, Bomb, changed, refused


def checkpoint_of(folder):
    (place,) = (folder / "checkpoint").glob("epoch_*1")
    shutil.rmtree(folder / "checkpoint" / "epoch_00000000")
    return place


def signed(place):
    """Makes the checksum of a changed checkpoint right again, as whoever changed it would."""
    said = json.loads((place / "state.json").read_text())
    said["crc32"] = checkpoint.file_sum(place / "tensors.safetensors")
    said["checksum"] = checkpoint.state_sum(said)
    (place / "state.json").write_text(json.dumps(said))


def header(entries, data=b""):
    text = json.dumps(entries).encode()
    return struct.pack("<Q", len(text)) + text + data


def entry(dtype="F32", shape=(1,), offsets=(0, 4)):
    return {"population.fitness": {"dtype": dtype, "shape": list(shape), "data_offsets": list(offsets)}}


def pickled(tmp_path):
    torch.save({"weights": Bomb()}, tmp_path / "bomb.pt")
    return (tmp_path / "bomb.pt").read_bytes()


TENSORS = {
    "pickle": lambda place: pickle.dumps(Bomb()),
    "torch": pickled,
    "huge header": lambda place: struct.pack("<Q", 2**63) + b"{}",
    "a header longer than the file": lambda place: struct.pack("<Q", 10**6) + b"{}",
    "overlapping": lambda place: header({**entry(), "b": entry(offsets=(2, 6))["population.fitness"]}, b"\0" * 6),
    "behind the end": lambda place: header(entry(offsets=(0, 2**40), shape=(2**38,))),
    "backwards": lambda place: header(entry(offsets=(4, 0)), b"\0" * 4),
    "negative": lambda place: header(entry(shape=(-1,)), b"\0" * 4),
    "overflowing": lambda place: header(entry(shape=(2**32, 2**32, 2**32)), b"\0" * 4),
    "no such type": lambda place: header(entry(dtype="O"), b"\0" * 4),
    "other names": lambda place: header(entry(), b"\0" * 4),
    "nested": lambda place: struct.pack("<Q", 200_000) + b"[" * 200_000,
    "nothing": lambda place: b"",
}


@pytest.fixture(scope="module")
def parts(kept):
    """Of the runs that are kept, by kind."""
    return {kind: last_state(kept / kind)[0] for kind in ("hands", "learners")}


@pytest.mark.parametrize("kind", TENSORS)
def test_tensors_that_are_none(kind, parts, run, berteam, tmp_path):
    folder = run("hands")
    place = checkpoint_of(folder)
    (place / "tensors.safetensors").write_bytes(TENSORS[kind](tmp_path))
    signed(place)
    with pytest.raises(RunError, match="no checkpoint to go on from"):
        checkpoint.load(folder, parts["hands"])
    if kind in {"pickle", "torch"}:
        assert "no checkpoint to go on from" in refused(berteam(*READERS["evaluate"](str(folder)), code=2))
    assert not Path(MARK).exists()


def twisted(tensor, way):
    """Returns another tensor for ``tensor``, None where that way makes no difference."""
    if way == "type":
        return tensor.to(torch.int32 if tensor.dtype.is_floating_point else torch.float64)
    if way == "axis":
        return tensor.reshape(*tensor.shape, 1).repeat(*[1] * tensor.ndim, 2) if tensor.ndim else None
    if way == "short":
        return tensor[:-1].clone() if tensor.ndim and len(tensor) else None
    if way == "long":
        return torch.cat([tensor, tensor]) if tensor.ndim and len(tensor) else None
    if tensor.dtype not in {torch.int64, torch.int16} or not tensor.numel():
        return None
    return torch.full_like(tensor, 30_000 if way == "large" else -30_000)


WHATEVER = (
    "steps",
    "pushed",
    "epochs",
    "updates",
    "filled",
    "collected",
    "age",
    "games",
    "parent",
    "failed",
    "lengths",
)
"""Counts, which may be wrong; whoever reads them looks at bounds. So do numpy and torch, which keep the winners."""


@pytest.mark.parametrize("way", ["type", "axis", "short", "long", "large", "small"])
def test_tensors_that_compiled_games_and_updates_could_not_take_are_refused(way, parts, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = run("learners")
    place = checkpoint_of(folder)
    tensors, harmless, tried = load_file(place / "tensors.safetensors"), [], 0
    assert checkpoint.load(folder, parts["learners"]).run.epoch == 1
    for name, tensor in tensors.items():
        other = twisted(tensor, way)
        if other is None or (name.startswith("selector.learnt") and tried % 5):  # which are many of a kind
            tried += other is not None
            continue
        tried += 1
        save_file(tensors | {name: other}, place / "tensors.safetensors")
        signed(place)
        try:
            checkpoint.load(folder, parts["learners"])
        except RunError as error:
            assert "has no checkpoint to go on from" in str(error)
        else:
            harmless.append(name)
    assert tried > (5 if way in {"large", "small"} else 20)
    assert [x for x in harmless if not x.startswith("selector.winners.") and not x.endswith(WHATEVER)] == []


@pytest.mark.parametrize(
    "facts",
    [
        {"epoch": "1"},
        {"epoch": -1},
        {"played": 1e9},
        {"seconds": "x"},
        {"table_sizes": []},
        {"table_sizes": {"games": -5}},
    ],
    ids=str,
)
def test_a_state_of_another_kind_is_none(facts, run, berteam):
    folder = run("hands")
    path = checkpoint_of(folder) / "state.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **facts}))
    assert "no checkpoint to go on from" in refused(berteam("resume", "run", "epochs=2", code=3), 3)


def test_a_pickle_in_a_tables_or_a_sheets_place_is_none(run, berteam):
    folder = run("hands")
    for name in ("elo", "agents", "team_distribution", "summary"):
        (folder / f"{name}.csv").write_bytes(pickle.dumps(Bomb()))
    for words in (["inspect", "run"], ["report", "run"]):
        assert re.search("cannot be read as a table|is cut off", refused(berteam(*words, code=2)))
    (folder / "evaluation").mkdir()
    for name in ("played.games", "played.json", "payoffs.games", "payoffs.json"):
        (folder / "evaluation" / name).write_bytes(pickle.dumps(Bomb()))
    berteam("evaluate", "run", *FEW)
    assert not Path(MARK).exists()


def test_files_that_a_run_folder_names_are_not_read_again(run, berteam):
    folder = run("hands")
    changed(folder, "members: []", "members:\n  - {file: evil.zip, name: evil, trust: true}")
    with zipfile.ZipFile("evil.zip", "w") as archive:
        archive.writestr("data", json.dumps({"policy_class": {":serialized:": "gASV"}}))
        archive.writestr("policy.pth", pickle.dumps(Bomb()))
    for command, code in (("resume", 3), ("evaluate", 2), ("export", 2)):
        assert "no checkpoint to go on from" in refused(berteam(*READERS[command]("run"), code=code), code)
    words = [*RUNS["hands"], "population=imported", "population.members=[{file: evil.zip}]", "out=new"]
    assert "population.members[0].file=evil.zip" in refused(berteam("train", *words, code=2))


def test_a_table_of_objects_is_no_recording(tmp_path, monkeypatch):
    from mctf.recording import TraceError, read  # noqa: PLC0415

    monkeypatch.chdir(tmp_path)
    np.savez("bomb.npz", meta=np.array([Bomb()], dtype=object))
    Path("bomb.npy").write_bytes(pickle.dumps(Bomb()))
    for name in ("bomb.npz", "bomb.npy"):
        with pytest.raises(TraceError):
            read(Path(name))
    assert not Path(MARK).exists()
