"""Reads the network in a zip file of Stable-Baselines3 by that library's own load, which may run code in the file.

That adds policies whose plain part does not tell how they act: of a class of one's own, with a features extractor or
an activation that has no name, or with other arguments. They must still act by a plain network of layers, and that is
tried: on random observations the network must do what the policy does.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Discrete
from stable_baselines3.common.save_util import load_from_zip_file

from berteam_cli.acting import DEEPEST, GREEDY, SAMPLED, Policies, networks
from berteam_cli.learner.zipped import SUPPORTED, Unfit, is_tanh, layered

TRIED = 256  # observations


def trusted_network(path: Path, observation_size: int, actions: int) -> Policies:
    """Returns one row: how the policy in the file ``path`` acts. Runs what code there is in it.

    Args:
        path: of the file.
        observation_size: O, of the game.
        actions: A.

    Raises:
        Unfit: it cannot be loaded, or does not act by a plain network, or not in this game.
    """
    try:
        policy = loaded(path)
    except Exception as error:  # any code may have run
        raise Unfit(f"cannot be loaded by Stable-Baselines3: {' '.join(str(error).split())[:200]}") from error
    if not isinstance(policy.action_space, Discrete):
        raise Unfit(f"has {policy.action_space} for its actions; only Discrete is supported")
    kind = GREEDY if hasattr(policy, "q_net") else SAMPLED
    modules = layers_of(policy, kind)
    activations = {type(module).__name__ for module in modules[1::2]}
    if not all(isinstance(module, torch.nn.Linear) for module in modules[::2]) or len(activations) > 1:
        raise Unfit(f"has a network of {', '.join(type(module).__name__ for module in modules)}; {SUPPORTED}")
    if not 1 <= len(modules) <= 2 * DEEPEST + 1:
        raise Unfit(f"has {len(modules) // 2} hidden layers; {SUPPORTED}")
    tanh = any(is_tanh(name) for name in activations)
    found = layered([(module.weight, module.bias) for module in modules[::2]], observation_size, actions)
    if not acts_alike(policy, kind, modules):
        raise Unfit("does not act as the layers of its network do alone, and only such can act here")
    return networks(kind, found, tanh=tanh)


def loaded(path: Path) -> Any:
    """Returns the policy in a file, whatever algorithm made it."""
    contents: Any = load_from_zip_file(path, device="cpu")  # whatever is None in it fails below
    data, weights, _ = contents
    policy = data["policy_class"](
        data["observation_space"], data["action_space"], lambda _: 0.0, **(data["policy_kwargs"] or {})
    )
    policy.load_state_dict(weights["policy"])
    policy.set_training_mode(False)
    return policy


def layers_of(policy: Any, kind: int) -> list[torch.nn.Module]:
    """Returns the layers and activations from observation to actions.

    Raises:
        Unfit: there are none.
    """
    try:
        return list(policy.q_net.q_net) if kind == GREEDY else [*policy.mlp_extractor.policy_net, policy.action_net]
    except (AttributeError, TypeError) as error:
        raise Unfit(f"has a policy of class {type(policy).__name__} without a plain network; {SUPPORTED}") from error


@torch.no_grad()
def acts_alike(policy: Any, kind: int, modules: list[torch.nn.Module]) -> bool:
    """Returns whether ``modules``, one after the other, do what ``policy`` does, on random observations."""
    space = policy.observation_space
    if isinstance(space, Discrete):
        given, seen = torch.arange(int(space.n)), torch.eye(int(space.n))
    else:
        drawn = np.random.default_rng(0).standard_normal((TRIED, *space.shape), dtype=np.float32)
        given, seen = torch.from_numpy(drawn), torch.from_numpy(drawn).flatten(1)
    ours = torch.nn.Sequential(*modules)(seen)
    try:
        best = policy._predict(given, deterministic=True)
        theirs = ours.softmax(dim=1) if kind == GREEDY else policy.get_distribution(given).distribution.probs
    except Exception as error:
        raise Unfit(f"has a policy that fails on an observation: {' '.join(str(error).split())[:200]}") from error
    same = theirs.shape == ours.shape and torch.allclose(theirs, ours.softmax(dim=1), atol=1e-5)
    return bool(same and torch.equal(best, ours.argmax(dim=1)))
