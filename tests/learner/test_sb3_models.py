"""Which settings a model of Stable-Baselines3 may have."""

import sys

import numpy as np
import pytest

from berteam_cli.learner.sb3 import Sb3
from tests.learner.conftest import ACTIONS, OBSERVATION

WRONG = [
    ("a2c", {}, "algorithm must be one of A2C, DQN, PPO, QRDQN, TRPO, but is 'a2c'. Did you mean A2C?"),
    ("sac", {}, "algorithm cannot be SAC: its actions are continuous"),
    ("ARS", {}, "algorithm cannot be ARS: it plays games of its own"),
    ("PPO", {"n_step": 64}, "options.n_step is no option of PPO. Did you mean n_steps?"),
    ("A2C", {"policy_kwargs": {}}, "options.policy_kwargs cannot be set: network and activation"),
    ("A2C", {"gamma": "much"}, "options.gamma must be a number, but is 'much'"),
    ("A2C", {"gamma": 1.5}, "options.gamma must be >= 0 and <= 1, but is 1.5"),
    ("A2C", {"learning_rate": 0}, "options.learning_rate must be > 0, but is 0"),
    ("A2C", {"learning_rate": float("nan")}, "options.learning_rate must be > 0, but is nan"),
    ("A2C", {"n_steps": 0}, "options.n_steps must be >= 1, but is 0"),
    ("A2C", {"n_steps": True}, "options.n_steps must be a whole number, but is True"),
    ("A2C", {"use_rms_prop": 1}, "options.use_rms_prop must be true or false, but is 1"),
    ("PPO", {"target_kl": "x"}, "options.target_kl must be a number or null, but is 'x'"),
    ("PPO", {"n_steps": 100}, "are 100 and 64; use options.n_steps=64 or 128, or options.batch_size=50"),
    ("PPO", {"n_steps": 37}, "are 37 and 64; use options.n_steps=64, or options.batch_size=37"),
    ("PPO", {"n_steps": 1, "normalize_advantage": False}, "use options.n_steps=64, or options.batch_size=1"),
    ("PPO", {"n_steps": 10**9 + 7}, "or options.batch_size=1000000007"),
    ("A2C", None, "options must be keywords with values, such as options.gamma=0.99, but is None"),
    ("PPO", {"batch_size": 1}, "options cannot be used, as PPO says: `batch_size` must be greater than 1"),
    ("TRPO", {"n_steps": 1}, "options.n_steps must be >= 2 with options.normalize_advantage=true, but is 1"),
    ("DQN", {"train_freq": [4, "step"]}, "options.train_freq must be a whole number, but is [4, 'step']"),
    ("DQN", {"gradient_steps": -2}, "options.gradient_steps must be >= -1, but is -2"),
    ("DQN", {"gradient_steps": 0}, "options.gradient_steps must be >= 1, or -1 for as many as transitions, but is 0."),
    ("DQN", {"exploration_fraction": 0}, "options.exploration_fraction must be > 0 and <= 1, but is 0"),
    ("DQN", {"buffer_size": 10**15}, "options cannot be used, as DQN says: Unable to allocate"),
]


@pytest.mark.parametrize(("algorithm", "options", "said"), WRONG)
def test_wrong_settings(algorithm, options, said):
    with pytest.raises(ValueError) as caught:
        Sb3(OBSERVATION, ACTIONS, (16, 12), algorithm, None, 400, options)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("algorithm", "options"),
    [
        ("PPO", {"target_kl": None, "clip_range_vf": 1}),
        ("PPO", {"gamma": 0, "gae_lambda": 1, "learning_rate": 1}),
        ("A2C", {"n_steps": 1}),
        ("QRDQN", {"max_grad_norm": None, "learning_starts": 0}),
    ],
)
def test_right_settings_reach_the_models(algorithm, options):
    (model,) = Sb3(OBSERVATION, ACTIONS, (16, 12), algorithm, None, 400, options).init(1, np.random.default_rng(0))
    for name, value in options.items():
        kept = getattr(model, name)
        assert (kept(1.0) if callable(kept) else kept) == value  # schedules are functions of the progress


def test_without_sb3_contrib(monkeypatch):
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)
    with pytest.raises(ValueError, match=r"^algorithm=TRPO needs sb3-contrib: pip install sb3-contrib\.$"):
        Sb3(OBSERVATION, ACTIONS, (16, 12), "TRPO", None, 400, {})
