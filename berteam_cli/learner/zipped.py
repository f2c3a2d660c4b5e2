"""Reads the network in a zip file of Stable-Baselines3 without running anything that lies in the file.

Such a file holds pickles, which are programs. Read here are the weights, as tensors and nothing else, and of ``data``
the JSON: what that library pickled stands there a second time as text for people, and tells the activation, the spaces
and the class of the policy. So a false file can make a member that plays badly, and nothing worse, as far as torch
keeps its word to load nothing but tensors.
"""

from __future__ import annotations

import io
import json
import re
import stat
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import torch

from berteam_cli.acting import DEEPEST, GREEDY, SAMPLED, Policies, networks
from berteam_cli.learner.mlp import Singles

LARGEST = {"data": 2**24, "policy.pth": 2**28}  # bytes of each part when unpacked; usual are 10 and 50 thousand
WIDEST = 4096  # as of networks that learn here
SUPPORTED = f"supported are PPO, A2C, TRPO and DQN with 0 to {DEEPEST} hidden layers of tanh or ReLU"

ACTOR, CRITIC = r"mlp_extractor\.policy_net\.[0-9]{1,4}|action_net", r"mlp_extractor\.value_net\.[0-9]{1,4}|value_net"
PARTS = {SAMPLED: rf"({ACTOR}|{CRITIC})\.(weight|bias)", GREEDY: r"q_net(_target)?\.q_net\.[0-9]{1,4}\.(weight|bias)"}
CLASSES = {SAMPLED: "stable_baselines3.common.policies", GREEDY: "stable_baselines3.dqn.policies"}
SPACE = r"<class '(gym|gymnasium)\.spaces\.(box\.Box|discrete\.Discrete)'>"
ACTIVATION = r"<class 'torch\.nn\.modules\.activation\.(\w+)'>"
HARMLESS = {
    *("activation_fn", "net_arch", "ortho_init", "log_std_init", "optimizer_class", "optimizer_kwargs"),
    *("normalize_images", "share_features_extractor", ":type:", ":serialized:"),
}
"""Keys of policy_kwargs that change nothing in how a policy of vectors and discrete actions acts, or are read here."""
FLAT = ("features_extractor_class", "<class 'stable_baselines3.common.torch_layers.FlattenExtractor'>")  # the default
IMAGE = 3  # dimensions


class Unfit(ValueError):
    """The file holds no policy that can act here; the message goes on from the file's name."""


class Untold(Unfit):
    """The plain part of the file does not tell how the policy acts; the pickled part may."""


def network(path: Path, observation_size: int, actions: int) -> Policies:
    """Returns one row: how the policy in the file ``path`` acts.

    Args:
        path: of the file.
        observation_size: O, of the game.
        actions: A.

    Raises:
        Untold: that takes what is pickled.
        Unfit: it is no file of Stable-Baselines3, or its policy is of a kind that cannot act here or in this game.
    """
    described, weights = contents(path)
    kind = kind_of(weights)
    tanh = told_tanh(told(described, kind), kind)
    return networks(kind, layered(found(kind, weights), observation_size, actions), tanh=tanh)


def contents(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Returns the JSON in the file, and the tensors of its policy by name.

    Raises:
        Unfit: they are not there, or cannot be read.
    """
    try:
        if not path.exists():
            raise Unfit("does not exist")
        if not path.is_file():
            raise Unfit("must be a zip file of Stable-Baselines3, and is no file")
        with zipfile.ZipFile(path) as archive:
            described, weights = unpacked(archive, "data"), unpacked(archive, "policy.pth")
    except Unfit:
        raise
    except OSError as error:
        raise Unfit(f"cannot be read: {error.strerror or error}") from error
    except Exception as error:  # a made-up archive fails in any way
        raise Unfit(f"is no whole zip file of Stable-Baselines3: {' '.join(str(error).split())[:200]}") from error
    return plain(described), tensors(weights)


def unpacked(archive: zipfile.ZipFile, name: str) -> bytes:
    """Returns the part ``name`` of an archive.

    Raises:
        Unfit: it is not there, is a link, or is too large.
    """
    if name not in archive.namelist():
        raise Unfit(f"is no file of Stable-Baselines3: there is no {name} in it")
    part = archive.getinfo(name)
    if stat.S_ISLNK(part.external_attr >> 16):
        raise Unfit(f"is no file of Stable-Baselines3: {name} in it is a link")
    check_size(part.file_size, name)
    if part.compress_type not in {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}:  # python unpacks others in one go
        raise Unfit(f"is no file of Stable-Baselines3: {name} in it is packed in a way of its own")
    with archive.open(part) as opened:
        return opened.read(part.file_size)  # a number, as without one it unpacks more than the archive says there is


def check_size(size: int, name: str) -> None:
    """Checks that the part ``name`` may be unpacked to ``size`` bytes.

    Raises:
        Unfit: it is too large.
    """
    if size > LARGEST[name]:
        raise Unfit(f"has {size / 2**20:.0f} MiB of {name}; at most {LARGEST[name] >> 20} MiB are read")


def plain(text: bytes) -> dict[str, Any]:
    """Returns a JSON object.

    Raises:
        Unfit: it is none.
    """
    try:
        described = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Unfit("is no file of Stable-Baselines3: data in it is no JSON") from error
    if not isinstance(described, dict):
        raise Unfit("is no file of Stable-Baselines3: data in it has no keys")
    return described


def tensors(packed: bytes) -> dict[str, Any]:
    """Returns what torch saved, if that are tensors by name and nothing else.

    Raises:
        Unfit: it is something else.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(packed)) as archive:  # torch's own archive in the archive may be a bomb, too
            size = sum(part.file_size for part in archive.infolist())
    except Exception as error:
        raise Unfit("has a policy.pth that torch did not save, or that is not whole") from error
    check_size(size, "policy.pth")
    try:
        loaded = torch.load(io.BytesIO(packed), map_location="cpu", weights_only=True)
    except Exception as error:  # a made-up pickle fails in any way
        raise Unfit("has a policy.pth with something else than tensors, which is not read") from error
    if not isinstance(loaded, dict) or not loaded or not all(map(is_plain, loaded.values())):
        raise Unfit("has a policy.pth that holds something else than tensors by name")
    return {str(name): tensor for name, tensor in loaded.items()}


def is_plain(tensor: object) -> bool:
    """Returns whether ``tensor`` is one of ordinary numbers in memory."""
    return (
        isinstance(tensor, torch.Tensor)
        and tensor.layout == torch.strided
        and tensor.device.type == "cpu"
        and tensor.dtype in {torch.float16, torch.bfloat16, torch.float32, torch.float64}
    )


def kind_of(weights: dict[str, Any]) -> int:
    """Returns SAMPLED or GREEDY, as the names of the weights tell.

    Raises:
        Unfit: some are of another kind of network.
    """
    kind = GREEDY if any(name.startswith("q_net.") for name in weights) else SAMPLED
    for name in weights:
        if not re.fullmatch(PARTS[kind], name):
            raise Unfit(f"has weights {name[:60]!r}, and only plain networks of layers can act here; {SUPPORTED}")
    return kind


def told(described: dict[str, Any], kind: int) -> dict[str, Any]:
    """Returns the arguments of the policy, if all that decides how it acts is plain to see.

    Raises:
        Untold: it is not.
        Unfit: it acts in another kind of game.
    """
    spaces = {key: text_of(described, key, ":type:") for key in ("action_space", "observation_space")}
    if not re.fullmatch(SPACE, spaces["action_space"]) or "Discrete" not in spaces["action_space"]:
        raise Unfit(f"has {spaces['action_space']!r} for its actions; only Discrete is supported")
    if not re.fullmatch(SPACE, spaces["observation_space"]):
        raise Unfit(f"has {spaces['observation_space']!r} for its observations; only Box and Discrete are supported")
    if text_of(described, "observation_space", "dtype") == "uint8" and dimensions(described) == IMAGE:
        raise Untold("sees images, which are scaled")
    module = text_of(described, "policy_class", "__module__")
    if module != CLASSES[kind]:
        raise Untold(f"has a policy of {module[:60]!r}, not of {CLASSES[kind]}")
    arguments = described.get("policy_kwargs")
    if not isinstance(arguments, dict):
        raise Untold("does not say how its policy was made")
    for key in arguments:
        if key not in HARMLESS and (key, arguments[key]) != FLAT:
            raise Untold(f"has {key[:60]!r} in policy_kwargs, whose effect is not plain to see")
    return arguments


def text_of(described: dict[str, Any], key: str, inner: str) -> str:
    """Returns the text that says what was pickled under ``key``, "nothing" if there is none."""
    value = described.get(key)
    return str(value.get(inner, "nothing"))[:200] if isinstance(value, dict) else "nothing"


def dimensions(described: dict[str, Any]) -> int:
    """Returns how many axes an observation has, IMAGE if it does not say so."""
    shape = described["observation_space"].get("_shape")
    return len(shape) if isinstance(shape, list) else IMAGE


def told_tanh(arguments: dict[str, Any], kind: int) -> bool:
    """Returns whether the hidden layers use tanh, else ReLU; by default those of actor-critics do.

    Raises:
        Untold: their activation has no name.
        Unfit: it is another one.
    """
    if "activation_fn" not in arguments:
        return kind == SAMPLED
    name = re.fullmatch(ACTIVATION, str(arguments["activation_fn"]))
    if name is None:
        raise Untold("has an activation of its own")
    return is_tanh(name[1])


def is_tanh(activation: str) -> bool:
    """Returns whether a torch module of this name is tanh, else ReLU.

    Raises:
        Unfit: it is neither.
    """
    if activation not in {"Tanh", "ReLU"}:
        raise Unfit(f"has {activation[:60]} for its activation; {SUPPORTED}")
    return activation == "Tanh"


def found(kind: int, weights: dict[str, Any]) -> list[tuple[Any, Any]]:
    """Returns for each layer, observation first, its matrix (out, in) and bias (out,), None where there is none.

    Raises:
        Unfit: they are not those of a plain network.
    """
    prefix = "q_net.q_net." if kind == GREEDY else "mlp_extractor.policy_net."
    numbers = sorted({int(name.split(".")[2]) for name in weights if name.startswith(prefix)})
    if numbers != list(range(0, 2 * len(numbers), 2)):  # Stable-Baselines3 has an activation between any two
        raise Unfit(f"has its layers in places {numbers}, and not in every second one; {SUPPORTED}")
    names = [f"{prefix}{number}" for number in numbers] + ["action_net"] * (kind == SAMPLED)
    if not 1 <= len(names) <= DEEPEST + 1:
        raise Unfit(f"has {len(names) - 1} hidden layers; {SUPPORTED}")
    return [(weights.get(f"{name}.weight"), weights.get(f"{name}.bias")) for name in names]


def layered(pairs: list[tuple[Any, Any]], observation_size: int, actions: int) -> list[tuple[Singles, Singles]]:
    """Returns for each layer its matrix (1, in, out) and bias (1, out), as ``networks`` takes them.

    Args:
        pairs: of each layer the matrix (out, in) and the bias (out,) as torch has them.
        observation_size: O, of the game.
        actions: A.

    Raises:
        Unfit: they do not fit each other or the game, are too wide, or are not all finite.
    """
    for matrix, bias in pairs:
        if matrix is None or bias is None or matrix.ndim != 2 or bias.shape != matrix.shape[:1]:
            raise Unfit("has a layer whose weights and bias are not both there or do not fit each other")
    widths = [pairs[0][0].shape[1], *(len(bias) for _, bias in pairs)]
    if [matrix.shape[1] for matrix, _ in pairs] != widths[:-1]:
        raise Unfit("has layers that do not fit each other")
    if (widths[0], widths[-1]) != (observation_size, actions):
        raise Unfit(
            f"sees {widths[0]} numbers and has {widths[-1]} actions, but in this game "
            f"observations have {observation_size} and there are {actions} actions"
        )
    if not all(1 <= width <= WIDEST for width in widths[1:-1]):
        raise Unfit(f"has hidden layers of {widths[1:-1]} numbers; from 1 to {WIDEST} are supported")
    arrays = [[part.detach().float().numpy() for part in pair] for pair in pairs]
    if not all(np.isfinite(part).all() for pair in arrays for part in pair):
        raise Unfit("has weights that are not finite numbers")
    return [(matrix.T[np.newaxis], bias[np.newaxis]) for matrix, bias in arrays]
