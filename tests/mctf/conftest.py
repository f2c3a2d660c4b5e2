"""Small set-up states: vehicles at rest where a test wants them."""

import numpy as np
import pytest

from mctf.kernel import step
from mctf.rules import make_rules
from mctf.start import reset
from mctf.state import empty


class Scene:
    """One 2v2 game in which everybody stays where it is put, far from everything at first."""

    CORNERS = ((190.0, 90.0), (190.0, 10.0), (10.0, 10.0), (10.0, 90.0))

    def __init__(self, **rules):
        self.rules = make_rules(**rules)
        self.state = empty(1, self.rules)
        reset(self.state, 0, self.rules)
        for v, corner in enumerate(self.CORNERS):
            self.put(v, *corner)

    def put(self, v, x, y, came_from=None, **fields):
        self.state.pos[0, v] = x, y
        self.state.prev_pos[0, v] = (x, y) if came_from is None else came_from
        for name, value in fields.items():
            getattr(self.state, name)[0, v] = value

    def give_flag(self, v):
        team = v // 2
        self.state.has_flag[0, v] = self.state.flag_taken[0, 1 - team] = self.state.pickup[0, team] = True
        self.state.flag_pos[0, 1 - team] = self.state.pos[0, v]

    def step(self, *actions, times=1):
        for _ in range(times):
            step(self.state, 0, np.array(actions or (16, 16, 16, 16)), self.rules)
        return self

    def __getattr__(self, name):  # scene.is_tagged is the row of this game
        return getattr(self.state, name)[0]


@pytest.fixture
def scene():
    return Scene
