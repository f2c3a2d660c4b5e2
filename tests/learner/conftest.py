import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3.common.logger import configure

from berteam_cli.learner.mlp import layers
from berteam_cli.outcomes import Experience

torch.set_num_threads(1)

OBSERVATION, ACTIONS = 9, 5


@pytest.fixture
def random_games():
    """A function that makes up games, one for each of ``lengths``."""

    def made(members, lengths, terminated, seed=0):
        rng = np.random.default_rng(seed)
        shape = np.shape(members)
        longest = max(lengths)
        return Experience(
            members=np.array(members),
            observations=rng.standard_normal((*shape, longest + 1, OBSERVATION), dtype=np.float32),
            actions=rng.integers(0, ACTIONS, (*shape, longest)).astype(np.int16),
            rewards=rng.standard_normal((*shape, longest), dtype=np.float32),
            lengths=np.array(lengths),
            terminated=np.array(terminated),
        )

    return made


class NeverPlayed(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (OBSERVATION,), dtype=np.float32)
    action_space = gymnasium.spaces.Discrete(ACTIONS)


@pytest.fixture
def sb3_model():
    """A function that builds a model of Stable-Baselines3 that logs nowhere."""

    def built(kind, **settings):
        model = kind("MlpPolicy", NeverPlayed(), device="cpu", **settings)
        model.set_logger(configure(None, []))
        return model

    return built


def linears(*modules):
    return [each for module in modules for each in module.modules() if isinstance(each, torch.nn.Linear)]


@pytest.fixture
def load():
    """A function that writes one member's flat weights into a network of torch."""

    def loaded(weights, sizes, *modules):
        with torch.no_grad():
            for linear, (matrix, bias) in zip(linears(*modules), layers(weights[np.newaxis], sizes), strict=True):
                linear.weight.copy_(torch.tensor(matrix[0].T))
                linear.bias.copy_(torch.tensor(bias[0]))

    return loaded


@pytest.fixture
def flat():
    """A function that returns a network of torch as flat weights."""

    def flattened(*modules):
        parts = [part for linear in linears(*modules) for part in (linear.weight.T.flatten(), linear.bias)]
        return torch.cat(parts).detach().numpy()

    return flattened
