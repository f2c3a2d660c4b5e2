"""Small PettingZoo environments, for test_pettingzoo.py alone; some of them are wrong on purpose."""

import fcntl
import os
import random
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from gymnasium.spaces import Box, Dict, Discrete, MultiDiscrete
from pettingzoo import AECEnv, ParallelEnv


class Contest(ParallelEnv):
    """Everybody sees four numbers and is paid the first of them times the action; a game ends by the clock.

    Args:
        team_size: members of a team.
        time: steps of a game.
        lives: for some agents, steps after which they die.
        cut: for some agents, steps after which they are cut off.
        wages: for some agents, what they are paid in each step instead.
        mark: file to which the process adds a line, and which it and its children hold a lock on.
    """

    metadata = {"name": "contest_v0", "render_modes": []}  # noqa: RUF012
    render_mode = None

    def __init__(self, team_size=1, time=6, lives=None, cut=None, wages=None, mark=None):
        self.possible_agents = [f"{team}_{i}" for team in ("left", "right") for i in range(team_size)]
        self.agents = []
        self.time, self.lives, self.cut, self.wages = time, lives or {}, cut or {}, wages or {}
        if mark:
            self.mark = Path(mark).open("a")  # noqa: SIM115 (open, and locked, until the process ends)
            self.mark.write("made\n")
            self.mark.flush()
            fcntl.flock(self.mark, fcntl.LOCK_SH)

    def observation_space(self, agent):
        return Box(0.0, 1.0, (2, 2), np.float64)

    def action_space(self, agent):
        return Discrete(3)

    def see(self):
        return {agent: self.rng.random((2, 2)) for agent in self.agents}

    def reset(self, seed=None, options=None):
        self.rng, self.now, self.agents = np.random.default_rng(seed), 0, list(self.possible_agents)
        self.seen = self.see()
        return self.seen, {agent: {} for agent in self.agents}

    def step(self, actions):
        assert set(actions) == set(self.agents)
        self.now += 1
        paid = {
            agent: self.wages[agent][self.now - 1] if agent in self.wages else action * self.seen[agent][0, 0]
            for agent, action in actions.items()
        }
        dead = {agent: self.lives.get(agent) == self.now for agent in self.agents}
        late = {agent: self.now in (self.time, self.cut.get(agent)) and not dead[agent] for agent in self.agents}
        infos = {agent: {"points": float(agent.endswith("0")) * (agent[0] == "r")} for agent in self.agents}
        self.seen = self.see()
        self.agents = [agent for agent in self.agents if not (dead[agent] or late[agent])]
        return self.seen, paid, dead, late, infos


class Guess(Contest):
    """Sees one of four things, numbered from 2, and acts by numbers from 5; the rules end the game after a step."""

    def observation_space(self, agent):
        return Discrete(4, start=2)

    def action_space(self, agent):
        return Discrete(3, start=5)

    def see(self):
        return {agent: int(self.rng.integers(2, 6)) for agent in self.possible_agents}

    def step(self, actions):
        assert all(5 <= action < 8 for action in actions.values())
        paid = {agent: float(self.seen[agent] == action) for agent, action in actions.items()}
        everybody, self.agents, self.seen = list(self.agents), [], self.see()
        over, not_late = dict.fromkeys(everybody, True), dict.fromkeys(everybody, False)
        return self.seen, paid, over, not_late, {agent: {} for agent in everybody}


class Careless(Contest):
    """Draws from the generators that all of Python and numpy share, also when it is made, and from those of spaces.

    It cannot be closed. ``pay`` has a number for a key.
    """

    def __init__(self, team_size=1, pay=None):
        super().__init__(team_size)
        assert pay is None or pay[0] == 1.5
        self.map = random.random() * np.random.random()  # noqa: NPY002
        self.spaces = {agent: (Box(0.0, 1.0, (2, 2)), Discrete(3)) for agent in self.possible_agents}

    def observation_space(self, agent):
        return self.spaces[agent][0]

    def action_space(self, agent):
        return self.spaces[agent][1]

    def see(self):
        seen = {}
        for agent, (box, actions) in self.spaces.items():
            seen[agent] = np.full((2, 2), random.random() * np.random.random())  # noqa: NPY002
            seen[agent][0] = box.sample()[0] * (1 + actions.sample()) / 3 * self.map
        return seen

    def close(self):
        self.window.close()


class Faulty(Contest):
    """Goes wrong in step 3 of some games, in the way that ``fault`` names."""

    def __init__(self, fault, **settings):
        super().__init__(**settings)
        self.fault = fault

    def step(self, actions):
        seen, paid, dead, late, infos = super().step(actions)
        someone = self.possible_agents[0]
        if self.now == 3:
            match self.fault:
                case "raise":
                    raise KeyError("the ball is gone")
                case "exit":
                    os._exit(7)
                case "sleep":
                    subprocess.run(["sleep", "1000"], pass_fds=[self.mark.fileno()], check=True)
                case "reward":
                    paid[someone] = np.nan
                case "observation":
                    seen[someone] = np.full((2, 2), np.inf)
                case "shape":
                    seen[someone] = np.zeros(3)
                case "silent":
                    del paid[someone]
                case "info":
                    infos[someone] = {"points": None}
                case "vanish":
                    self.agents.remove(someone)
        if self.now == 4 and self.fault == "vanish":
            self.agents.append(someone)
        return seen, paid, dead, late, infos


class Late(Contest):
    """One agent is not there at the beginning."""

    def reset(self, seed=None, options=None):
        seen, infos = super().reset(seed, options)
        self.agents.pop()
        return seen, infos


def spaces(seeing=None, acting=None, agents=2):
    """Returns a contest whose last agent has other spaces, or with some more agents."""
    env = Contest()
    env.possible_agents = [f"agent_{i}" for i in range(agents)]
    kinds = {
        "box": Box(0, 1, (2, 2)),
        "large": Box(0, 1, (5,)),
        "two": Discrete(2),
        "three": Discrete(3),
        "dict": Dict({"at": Discrete(2)}),
        "many": MultiDiscrete([2, 2]),
        "real": Box(-1, 1, (1,)),
    }
    env.observation_space = lambda agent: kinds[seeing if seeing and agent == env.possible_agents[-1] else "box"]
    env.action_space = lambda agent: kinds[acting if acting and agent == env.possible_agents[-1] else "three"]
    return env


class InTurn(AECEnv):
    """An environment in which agents act one after the other."""


def nothing():
    """Returns no environment."""
    return SimpleNamespace(possible_agents=["a", "b"])


number = 3
