"""What tests of a Ray cluster run in a process each, as Ray may end or stop the process that drives it.

python -m tests.ray_drivers NAME [WORD ...]
"""

import gc
import logging
import sys
import time
from logging.handlers import MemoryHandler
from pathlib import Path

import numpy as np

from berteam_cli import cluster
from berteam_cli.acting import fixed_policies
from berteam_cli.cluster import Cluster
from berteam_cli.env.pettingzoo import Pettingzoo
from berteam_cli.errors import RunError
from berteam_cli.games import Games, pairings
from tests.makers import mctf, random_networks

RESULTS = ("scores", "steps", "events", "seeds")


def plays_an_environment_of_the_users_own():
    """``own_games`` lies in the working folder alone."""
    env = Pettingzoo(1, "own_games:Contest", {}, {}, 1000, "reward")
    lineups = pairings(*np.zeros((2, 6, 1), dtype=np.int64))
    (here, seen), (there, seen_there) = (
        Games(env, mctf().workers, elsewhere).play(fixed_policies([0]), lineups, 5, record=True)
        for elsewhere in (None, Cluster())
    )
    assert np.array_equal(here.scores, there.scores)
    assert np.array_equal(seen.rewards[:, :, :6], seen_there.rewards[:, :, :6])


def plays_between(start, stop):
    """Plays the same games over and over, from when there is a file ``start`` until there is a file ``stop``."""
    cluster.AHEAD = 1  # so that most games are asked for while others are played
    games = mctf()
    acting = random_networks(12, games.env, hidden=64)
    lineups = pairings(*np.random.default_rng(0).integers(12, size=(2, 100, 2)))
    here, _ = games.play(acting, lineups, 3)
    elsewhere = Games(games.env, games.workers, Cluster())
    print("Connected.", flush=True)
    while not Path(start).exists():
        time.sleep(0.05)
    while not Path(stop).exists():
        there, _ = elsewhere.play(acting, lineups, 3)
        for name in RESULTS:
            assert np.array_equal(getattr(here, name), getattr(there, name)), name
        print("The same.", flush=True)


def fails_everywhere():
    """Ray would tell of the other tasks too, whenever Python collects what nobody asks for, or end the process."""
    kept = MemoryHandler(100)
    logging.getLogger().addHandler(kept)
    cluster.versions = lambda: {"numba": "0.1"}
    games, lineups = mctf(), pairings(*np.zeros((2, 200, 2), dtype=np.int64))
    elsewhere = Games(games.env, games.workers, Cluster())
    for k in range(50):
        try:
            elsewhere.play(fixed_policies([0]), lineups, 5)
        except RunError as error:
            assert str(error).startswith("A machine of the Ray cluster has numba ")
        else:
            raise AssertionError("the games were played")
        time.sleep(k % 10 / 50)  # in which others fail
        gc.collect()
    assert not [record for record in kept.buffer if record.levelno >= logging.WARNING]


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
