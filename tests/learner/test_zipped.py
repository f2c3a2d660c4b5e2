"""Files that are not what they seem: nothing in them runs, and each is refused in one sentence."""

import base64
import io
import json
import os
import pickle
import stat
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest
import torch
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.torch_layers import FlattenExtractor

from berteam_cli.learner.imported import read
from berteam_cli.learner.zipped import LARGEST, Unfit
from tests.learner.conftest import ACTIONS, OBSERVATION

SIZES = (OBSERVATION, ACTIONS)


@pytest.fixture
def good(sb3_model, tmp_path):
    """The path of a PPO that can act here."""
    sb3_model(PPO, policy_kwargs={"activation_fn": torch.nn.Tanh, "net_arch": [8, 8]}).save(tmp_path / "good.zip")
    return tmp_path / "good.zip"


@pytest.fixture
def changed(good, tmp_path):
    """A function that writes the good file with parts of it replaced, None for none, and returns its path."""

    def write(compression=zipfile.ZIP_STORED, **parts):
        with zipfile.ZipFile(good) as archive:
            old = {name: archive.read(name) for name in archive.namelist()}
        new = old | {name.replace("policy_pth", "policy.pth"): part for name, part in parts.items()}
        with zipfile.ZipFile(tmp_path / "changed.zip", "w", compression) as archive:
            for name, part in new.items():
                if part is not None:
                    archive.writestr(name, part)
        return tmp_path / "changed.zip"

    return write


def data_of(path):
    with zipfile.ZipFile(path) as archive:
        return json.loads(archive.read("data"))


def weights_of(path):
    with zipfile.ZipFile(path) as archive:
        return torch.load(io.BytesIO(archive.read("policy.pth")), weights_only=True)


def packed(weights):
    written = io.BytesIO()
    torch.save(weights, written)
    return written.getvalue()


class Trap:
    """What makes a folder when it is unpickled."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return os.mkdir, (self.path,)


def test_nothing_runs_that_is_pickled_in_data(good, changed, tmp_path):
    data, trap = data_of(good), base64.b64encode(pickle.dumps(Trap(tmp_path / "sprung"))).decode()
    pickled = [key for key, value in data.items() if isinstance(value, dict) and ":serialized:" in value]
    assert {"policy_class", "policy_kwargs", "observation_space", "action_space"} <= set(pickled)
    for key in pickled:
        data[key][":serialized:"] = trap
    path = changed(data=json.dumps(data))
    np.testing.assert_array_equal(read(path, *SIZES, trust=True).weights, read(good, *SIZES, trust=False).weights)
    assert not (tmp_path / "sprung").exists()
    data["policy_class"]["__module__"] = "my.own"
    path = changed(data=json.dumps(data))
    with pytest.raises(
        Unfit, match=r"has a policy of 'my.own', not of stable_baselines3.common.policies; if you trust"
    ):
        read(path, *SIZES, trust=False)
    assert not (tmp_path / "sprung").exists()
    with pytest.raises(Unfit, match="cannot be loaded by Stable-Baselines3"):
        read(path, *SIZES, trust=True)
    assert (tmp_path / "sprung").exists()  # so it was a trap


def test_nothing_runs_that_is_pickled_in_the_weights(good, changed, tmp_path):
    bad = packed({**weights_of(good), "action_net.bias": Trap(tmp_path / "sprung")})
    path = changed(policy_pth=bad)
    for trust in (False, True):
        with pytest.raises(Unfit, match=r"policy.pth with something else than tensors, which is not read"):
            read(path, *SIZES, trust=trust)
    assert not (tmp_path / "sprung").exists()
    torch.load(io.BytesIO(bad), weights_only=False)
    assert (tmp_path / "sprung").exists()


FIRST, LAST = "mlp_extractor.policy_net.0", "action_net"
WEIGHTS = {
    "NaN": ({f"{FIRST}.weight": torch.full((8, 9), torch.nan)}, "not finite numbers"),
    "too large": ({f"{LAST}.bias": torch.full((5,), 1e300, dtype=torch.float64)}, "not finite numbers"),
    "other width": ({f"{FIRST}.weight": torch.zeros(7, 9)}, "do not fit each other"),
    "chain": ({f"{LAST}.weight": torch.zeros(5, 7)}, "do not fit each other"),
    "other game": (
        {f"{FIRST}.weight": torch.zeros(8, 4)},
        "sees 4 numbers and has 5 actions, but in this game observations have 9 and there are 5 actions",
    ),
    "other actions": ({f"{LAST}.weight": torch.zeros(3, 8), f"{LAST}.bias": torch.zeros(3)}, "has 3 actions, but"),
    "a cube": ({f"{FIRST}.weight": torch.zeros(8, 9, 1)}, "do not fit each other"),
    "a number": ({f"{FIRST}.bias": torch.tensor(1.0)}, "do not fit each other"),
    "no bias": ({f"{LAST}.bias": None}, "not both there"),
    "integers": ({f"{LAST}.bias": torch.zeros(5, dtype=torch.int64)}, "something else than tensors by name"),
    "sparse": ({f"{FIRST}.weight": torch.zeros(8, 9).to_sparse()}, "something else than tensors by name"),
    "convolution": ({"features_extractor.cnn.0.weight": torch.zeros(1)}, "has weights 'features_extractor.cnn.0.weig"),
    "shared": ({"mlp_extractor.shared_net.0.weight": torch.zeros(1)}, "has weights 'mlp_extractor.shared_net.0.we"),
    "continuous": ({"log_std": torch.zeros(5)}, "has weights 'log_std'"),
    "gap": ({"mlp_extractor.policy_net.5.weight": torch.zeros(8, 8)}, r"its layers in places \[0, 2, 5\]"),
    "deep": (
        {f"mlp_extractor.policy_net.{k}.weight": torch.zeros(8, 8) for k in range(4, 14, 2)},
        "has 7 hidden layers; supported are",
    ),
    "huge": (
        {
            f"{FIRST}.weight": torch.zeros(1, 1).expand(10**7, 9),
            f"{FIRST}.bias": torch.zeros(1).expand(10**7),
            "mlp_extractor.policy_net.2.weight": torch.zeros(1, 1).expand(8, 10**7),
        },
        "has hidden layers of",
    ),
}


@pytest.mark.parametrize(("changes", "said"), WEIGHTS.values(), ids=WEIGHTS)
def test_weights_that_cannot_act_here(good, changed, changes, said):
    weights = {name: tensor for name, tensor in (weights_of(good) | changes).items() if tensor is not None}
    with pytest.raises(Unfit, match=said):
        read(changed(policy_pth=packed(weights)), *SIZES, trust=False)


@pytest.mark.parametrize("other", [[1, 2], {}, torch.zeros(3), {"a": 1}, {"a": {"b": torch.zeros(1)}}, None])
def test_what_torch_saved_must_be_tensors_by_name(changed, other):
    with pytest.raises(Unfit, match="something else than tensors by name"):
        read(changed(policy_pth=packed(other)), *SIZES, trust=False)


DATA = {
    "ELU": (
        ("policy_kwargs", "activation_fn", "<class 'torch.nn.modules.activation.ELU'>"),
        "has ELU for its activation; supported are PPO, A2C, TRPO and DQN with 0 to 6 hidden layers of tanh or ReLU",
    ),
    "own activation": (("policy_kwargs", "activation_fn", "<function f>"), "activation of its own; if you trust"),
    "extractor": (
        ("policy_kwargs", "features_extractor_class", "<class 'stable_baselines3.common.torch_layers.NatureCNN'>"),
        "has 'features_extractor_class' in policy_kwargs, whose effect is not plain to see; if you trust",
    ),
    "continuous": (("action_space", ":type:", "<class 'gymnasium.spaces.box.Box'>"), "only Discrete is supported"),
    "many": (("action_space", ":type:", "<class 'gymnasium.spaces.multi_discrete.MultiDiscrete'>"), "only Discrete"),
    "dict": (("observation_space", ":type:", "<class 'gymnasium.spaces.dict.Dict'>"), "only Box and Discrete are"),
}


@pytest.mark.parametrize(("change", "said"), DATA.values(), ids=DATA)
def test_data_that_tells_of_something_else(good, changed, change, said):
    data = data_of(good)
    key, inner, value = change
    data[key][inner] = value
    with pytest.raises(Unfit, match=said):
        read(changed(data=json.dumps(data)), *SIZES, trust=False)


def test_the_default_extractor_may_be_named(sb3_model, good, tmp_path):
    path = tmp_path / "named.zip"
    sb3_model(PPO, policy_kwargs={"features_extractor_class": FlattenExtractor, "net_arch": [8, 8]}).save(path)
    assert read(path, *SIZES, trust=False).sizes.tolist() == read(good, *SIZES, trust=False).sizes.tolist()


PARTS = {
    "no data": ({"data": None}, "there is no data in it"),
    "no weights": ({"policy_pth": None}, "there is no policy.pth in it"),
    "no JSON": ({"data": b"\xff{"}, "data in it is no JSON"),
    "deep JSON": ({"data": b"[" * 10**6}, "data in it is no JSON"),
    "a list": ({"data": b"[1]"}, "data in it has no keys"),
    "no keys": ({"data": b"{}"}, "has 'nothing' for its actions"),
    "a pickle": ({"policy_pth": pickle.dumps({})}, "that torch did not save"),
    "nothing": ({"policy_pth": b""}, "that torch did not save"),
}


@pytest.mark.parametrize(("parts", "said"), PARTS.values(), ids=PARTS)
def test_parts_that_are_not_there_or_not_what_they_should_be(changed, parts, said):
    with pytest.raises(Unfit, match=said):
        read(changed(**parts), *SIZES, trust=False)


def test_paths_that_are_no_files(good, tmp_path):
    (tmp_path / "folder.zip").mkdir()
    os.mkfifo(tmp_path / "pipe.zip")
    (tmp_path / "loop.zip").symlink_to(tmp_path / "loop.zip")
    (tmp_path / "dangling.zip").symlink_to(tmp_path / "gone.zip")
    (tmp_path / "text.zip").write_text("no zip")
    for name, said in {
        "folder.zip": "is no file",
        "pipe.zip": "is no file",
        "loop.zip": "does not exist",
        "dangling.zip": "does not exist",
        "gone.zip": "does not exist",
        "text.zip": "is no whole zip file",
    }.items():
        with pytest.raises(Unfit, match=said):
            read(tmp_path / name, *SIZES, trust=True)
    (tmp_path / "link.zip").symlink_to(good)
    assert read(tmp_path / "link.zip", *SIZES, trust=False).kind.tolist() == [1]


def test_a_link_in_the_archive_is_not_followed(good, changed, tmp_path):
    path = changed(policy_pth=None)
    with zipfile.ZipFile(path, "a") as archive:
        link = zipfile.ZipInfo("policy.pth")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        archive.writestr(link, str(good))
    with pytest.raises(Unfit, match=r"policy.pth in it is a link"):
        read(path, *SIZES, trust=False)


def zeros(name, size):
    """An archive of almost nothing that unpacks to ``size`` zeros."""
    written = io.BytesIO()
    with zipfile.ZipFile(written, "w", zipfile.ZIP_DEFLATED) as archive, archive.open(name, "w") as opened:
        for _ in range(size >> 20):
            opened.write(bytes(2**20))
    return written.getvalue()


def peak(path, said):
    """Reads a file, which is refused, and returns how much memory that took."""
    tracemalloc.start()
    with pytest.raises(Unfit, match=said):
        read(path, *SIZES, trust=True)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return most


def test_bombs(changed, tmp_path):
    bomb, path = zeros("policy.pth", LARGEST["policy.pth"] + 2**20), tmp_path / "bomb.zip"
    path.write_bytes(bomb)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("data", "{}")
    assert peak(path, "has 257 MiB of policy.pth; at most 256 MiB are read") < 2**24
    assert peak(changed(policy_pth=bomb), "has 257 MiB of policy.pth") < 2**24
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data", " " * (LARGEST["data"] + 2**20))
        archive.writestr("policy.pth", "")
    assert peak(path, "has 17 MiB of data; at most 16 MiB are read") < 2**24


def test_a_bomb_that_says_it_is_small(tmp_path):
    bomb = bytearray(zeros("data", 2**26))
    directory = bomb.rindex(b"PK\x01\x02")
    bomb[directory + 24 : directory + 28] = struct.pack("<I", 1000)
    path = tmp_path / "bomb.zip"
    path.write_bytes(bomb)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("policy.pth", "")
    assert peak(path, "is no whole zip file") < 2**24
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("data", " ")
    assert peak(path, "data in it is packed in a way of its own") < 2**24


@pytest.mark.parametrize("kind", [PPO, DQN])
def test_whatever_is_broken_is_refused_in_one_line(sb3_model, tmp_path, kind):
    """Files cut off anywhere, or with a few bytes changed, are read or refused, and never anything else."""
    path, broken = tmp_path / "good.zip", tmp_path / "broken.zip"
    sb3_model(kind, policy_kwargs={"net_arch": [4]}).save(path)
    whole, rng = path.read_bytes(), np.random.default_rng(0)
    refused = 0
    for k in range(400):
        raw = bytearray(whole)
        if k % 4 == 0:
            raw = raw[: rng.integers(len(raw))]
        else:
            for at in rng.integers(0, len(raw), rng.integers(1, 20)):
                raw[at] = rng.integers(256)
        broken.write_bytes(raw)
        try:
            read(broken, *SIZES, trust=False)
        except Unfit as error:
            refused += 1
            assert str(error)
            assert "\n" not in str(error)
    assert 200 < refused < 400
