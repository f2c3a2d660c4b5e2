"""What one vehicle sees, set by hand, for tests of the fixed policies. Bearings in deg, distances in m."""

import numpy as np

from mctf.draws import GAMMA, next_uniform
from mctf.observe import OTHER, OWN, observation_size
from mctf.rules import make_rules
from mctf.scripted import act
from mctf.start import reset
from mctf.state import empty

PROFILE = {"2024": "pyquaticus-2024-06", "repaired": "clean", "2025": "pyquaticus-2025-11"}
VERSIONS = tuple(PROFILE)
AHEAD, RIGHT, LEFT = 4, 2, 6
SLOW = 8  # added to them


class Sight:
    """Blue's first vehicle: opponents' flag 80 m ahead, own flag as far behind, walls and all others far off."""

    def __init__(self, version="2024", mates=0, enemies=1, **rules):
        self.rules = make_rules(PROFILE[version], (1 + mates, enemies), **rules)
        self.state = empty(1, self.rules)
        reset(self.state, 0, self.rules)
        self.raw = np.zeros(observation_size(self.rules))
        self.raw[4:12] = np.ravel([(0.0, 50.0), (90.0, 50.0), (180.0, 50.0), (-90.0, 50.0)])
        self.first_enemy = mates
        self.see(goal=(0.0, 80.0), home=(180.0, 80.0))
        for i in range(mates + enemies):
            self.other(i, 180.0, 400.0)

    def see(self, goal=None, home=None, walls=None, **flags):
        for at, pair in ((0, goal), (2, home)):
            if pair is not None:
                self.raw[at : at + 2] = pair
        for wall, pair in (walls or {}).items():
            self.raw[4 + 2 * wall : 6 + 2 * wall] = pair
        for name, value in flags.items():
            self.raw[{"has_flag": 15, "on_own_side": 16, "is_tagged": 18}[name]] = value
        return self

    def other(self, i, bearing, distance, has_flag=False, on_own_side=False, is_tagged=False):
        at = OWN + OTHER * i
        self.raw[at : at + 2] = bearing, distance
        self.raw[at + 4 : at + 8] = has_flag, on_own_side, 0.0, is_tagged
        return self

    def mate(self, *where, **flags):
        return self.other(0, *where, **flags)

    def enemy(self, *where, place=0, **flags):
        return self.other(self.first_enemy + place, *where, **flags)

    def act(self, policy, seed=None):
        if seed is not None:
            self.state.stream[0] = seed
        return act(policy, self.state, 0, 0, self.raw, self.rules)

    def drawn(self, policy, seed):
        """Returns the action and how many numbers it drew."""
        action, last = self.act(policy, seed), int(self.state.stream[0])
        return action, next(i for i in range(9) if last == (seed + i * int(GAMMA)) % 2**64)


def uniforms(seed, count):
    """Returns the first numbers of a stream."""
    stream = np.array([seed], np.uint64)
    return [next_uniform(stream, 0) for _ in range(count)]


def seed_with(wanted):
    """Returns a seed whose first three numbers are as wanted."""
    return next(seed for seed in range(10_000) if wanted(*uniforms(seed, 3)))
