"""Small real things for tests."""

from itertools import pairwise

import numpy as np

from berteam_cli.acting import SAMPLED, networks
from berteam_cli.env.mctf import Mctf
from berteam_cli.games import Games
from berteam_cli.workers import Workers

SHORT = {"max_time_s": 60.0}


def mctf(workers=1, team_size=2, reward="custom_rew2", **settings):
    return Games(Mctf(team_size=team_size, reward=reward, **settings), Workers(workers))


def random_networks(members, env, seed=0, hidden=8, scale=1.0):
    rng = np.random.default_rng(seed)
    widths = (env.observation_size, hidden, env.actions)
    layers = [
        (
            (scale * rng.normal(size=(members, a, b))).astype(np.float32),
            np.zeros((members, b), dtype=np.float32),
        )
        for a, b in pairwise(widths)
    ]
    return networks(SAMPLED, layers, tanh=True)
