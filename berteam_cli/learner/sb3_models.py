"""Models of Stable-Baselines3: which of them a member can be, what may be said of them, and how one is built."""

from __future__ import annotations

import importlib
import inspect
import math
from collections.abc import Mapping
from typing import Any, get_args

import gymnasium
import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from torch import nn

from berteam_cli.errors import did_you_mean

ALGORITHMS = {
    "A2C": "stable_baselines3",
    "DQN": "stable_baselines3",
    "PPO": "stable_baselines3",
    "QRDQN": "sb3_contrib",
    "TRPO": "sb3_contrib",
}
"""Each algorithm's package."""

UNFIT = {
    **dict.fromkeys(("SAC", "TD3", "DDPG", "TQC", "CrossQ"), "its actions are continuous, those of the games discrete"),
    "RecurrentPPO": "its networks remember what they saw, and those of members act without memory",
    "MaskablePPO": "it must be told which actions are allowed, and the games do not tell",
    "ARS": "it plays games of its own with every small change of its weights, and here the selector says who plays",
    "HerReplayBuffer": "it is a memory for tasks with goals, and no algorithm",
}

NETWORKS, TABLES = "network and activation say what the networks are", "learning.csv tells what happens"
CONTINUOUS, BUFFERS = "it is for continuous actions", "the buffers are Stable-Baselines3's own, which a run can save"
DECIDED = {
    "policy": NETWORKS,
    "policy_kwargs": NETWORKS,
    "env": "members play the game of the run, env=NAME",
    "seed": "every random number comes from the seed of the run, seed=N",
    "device": "members learn on the processor",
    "verbose": TABLES,
    "tensorboard_log": TABLES,
    "stats_window_size": TABLES,
    "use_sde": CONTINUOUS,
    "sde_sample_freq": CONTINUOUS,
    "rollout_buffer_class": BUFFERS,
    "rollout_buffer_kwargs": BUFFERS,
    "replay_buffer_class": BUFFERS,
    "replay_buffer_kwargs": BUFFERS,
    "optimize_memory_usage": BUFFERS,
    "_init_setup_model": "a member needs its networks",
}
"""Why some keywords of the constructors cannot be set."""

NoneType = type(None)
KINDS = {bool: "true or false", int: "a whole number", float: "a number", NoneType: "null"}
LEAST = {"learning_starts": 0, "gradient_steps": -1}  # other whole numbers: 1
MAY_BE_0 = {"gamma", "gae_lambda", "tau", "ent_coef", "vf_coef", "cg_damping"}
MAY_BE_0 |= {"exploration_initial_eps", "exploration_final_eps"}
AT_MOST_1 = {"gamma", "gae_lambda", "tau", "line_search_shrinking_factor"}
AT_MOST_1 |= {"exploration_fraction", "exploration_initial_eps", "exploration_final_eps"}

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU}


class Spaces(gymnasium.Env[Any, Any]):
    """What a member sees and may do; it is never played, as games run elsewhere."""

    def __init__(self, observation_size: int, actions: int) -> None:
        """Takes O and A."""
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (observation_size,), dtype=np.float32)
        self.action_space = gymnasium.spaces.Discrete(actions)


def built(
    kind: type[BaseAlgorithm],
    observation_size: int,
    actions: int,
    network: tuple[int, ...],
    activation: str | None,
    options: Mapping[str, Any],
) -> BaseAlgorithm:
    """Returns a model that logs nowhere; its weights are drawn from torch's global generator.

    Args:
        kind: class of the algorithm.
        observation_size: O.
        actions: A.
        network: widths of the hidden layers, of actor and critic apart.
        activation: one of ACTIVATIONS; None is the algorithm's own.
        options: other keywords of the constructor.
    """
    architecture: dict[str, Any] = {"net_arch": list(network)}
    if activation is not None:
        architecture["activation_fn"] = ACTIVATIONS[activation]
    spaces = Spaces(observation_size, actions)
    model = kind("MlpPolicy", spaces, policy_kwargs=architecture, device="cpu", **options)
    model.set_logger(Logger(None, []))  # `configure` would make a folder
    return model


def algorithm_class(name: str) -> type[BaseAlgorithm]:
    """Returns the class of the algorithm.

    Raises:
        ValueError: it is none that members can learn by, or its package is not installed.
    """
    unfit = {each.lower(): (each, reason) for each, reason in UNFIT.items()}.get(name.lower())
    names = ", ".join(ALGORITHMS)
    if unfit:
        raise ValueError(f"algorithm cannot be {unfit[0]}: {unfit[1]}; it must be one of {names}.")
    if name not in ALGORITHMS:
        raise ValueError(f"algorithm must be one of {names}, but is {name!r}.{did_you_mean(name, ALGORITHMS)}")
    try:
        return getattr(importlib.import_module(ALGORITHMS[name]), name)
    except ImportError as error:
        raise ValueError(f"algorithm={name} needs sb3-contrib: pip install sb3-contrib.") from error


def check_options(kind: type[BaseAlgorithm], options: Mapping[str, Any]) -> None:
    """Checks that ``options`` are keywords of the constructor with values that it understands.

    Raises:
        ValueError: with what is allowed and what was given.
    """
    if not isinstance(options, Mapping):
        raise ValueError(f"options must be keywords with values, such as options.gamma=0.99, but is {options}.")
    keywords = inspect.signature(kind, eval_str=True).parameters
    for name, value in options.items():
        if name not in keywords:
            near = did_you_mean(name, [each for each in keywords if each not in DECIDED])
            raise ValueError(f"options.{name} is no option of {kind.__name__}.{near}")
        if name in DECIDED:
            raise ValueError(f"options.{name} cannot be set: {DECIDED[name]}.")
        check_value(name, value, keywords[name].annotation)
    if issubclass(kind, OnPolicyAlgorithm):
        check_rollout({name: each.default for name, each in keywords.items()} | dict(options))


def check_value(name: str, value: Any, hint: Any) -> None:
    """Checks the value of one option against the type that the constructor declares, and against its bounds.

    Raises:
        ValueError: with what is allowed and what was given.
    """
    allowed = [each for each in KINDS if each in (get_args(hint) or (hint,))]
    fits = type(value) in allowed or (type(value) is int and float in allowed)
    if not fits:
        raise ValueError(f"options.{name} must be {' or '.join(KINDS[x] for x in allowed)}, but is {value!r}.")
    if value is None or isinstance(value, bool):
        return
    if int in allowed:
        low, positive = LEAST.get(name, 1), False
    else:
        low, positive = 0, name not in MAY_BE_0
    high = 1.0 if name in AT_MOST_1 else math.inf
    if not (low < value if positive else low <= value) or not value <= high or not math.isfinite(value):
        above, below = f"{'>' if positive else '>='} {low}", " and <= 1" if high == 1.0 else ""
        raise ValueError(f"options.{name} must be {above}{below}, but is {value}.")
    if name == "gradient_steps" and value == 0:
        raise ValueError("options.gradient_steps must be >= 1, or -1 for as many as transitions, but is 0.")


def check_rollout(settings: Mapping[str, Any]) -> None:
    """Checks that the steps of an update make whole minibatches, and are enough to be scaled by their deviation.

    Raises:
        ValueError: with the nearest numbers that do.
    """
    steps = settings["n_steps"]
    if settings["normalize_advantage"] and steps < 2:
        raise ValueError(f"options.n_steps must be >= 2 with options.normalize_advantage=true, but is {steps}.")
    batch = settings.get("batch_size", steps)
    if steps % batch:
        below = steps // batch * batch
        whole = " or ".join(str(each) for each in (below, below + batch) if each)
        pairs = [(each, steps // each) for each in range(1, math.isqrt(steps) + 1) if steps % each == 0]
        least = 2 if settings["normalize_advantage"] else 1
        divisors = sorted(each for pair in pairs for each in pair if each >= least)
        divisor = min(divisors, key=lambda each: abs(each - batch))
        raise ValueError(
            f"options.n_steps must be a multiple of options.batch_size, but they are {steps} and {batch}; "
            f"use options.n_steps={whole}, or options.batch_size={divisor}."
        )
