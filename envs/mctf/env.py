"""The game as a PettingZoo environment: names, spaces and checks around one game of the kernel."""

import math
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from mctf.kernel import RUNNING, TIME_OUT, finished, step
from mctf.observe import normalise, observation_size, observe
from mctf.rewards import NAMES as REWARDS
from mctf.rewards import rewards
from mctf.rules import ACTIONS, BLUE, RED, make_rules
from mctf.state import CAPTURES, EVENTS, GRABS, TAGS, empty, reset

Observations = dict[str, NDArray[np.float32]]
Infos = dict[str, dict[str, int]]


def parallel_env(reward: str = "custom_rew2", **rules: Any) -> "MctfEnv":
    """Returns one game; ``reward`` is one of ``rewards.NAMES`` and ``rules`` are arguments of ``make_rules``."""
    return MctfEnv(reward, **rules)


class MctfEnv(ParallelEnv[str, NDArray[np.float32], int]):
    """One game of Capture-the-Flag. Agents are blue_0.. on the right and red_0.. on the left.

    An observation is ``observe.normalise``'s vector; its numbers are in [-1, 1] but for a vehicle that has
    just run out of bounds, so the space has no bounds. ``infos`` counts the events of the game so far.
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "mctf_v0", "render_modes": [], "is_parallelizable": True}
    render_mode = None

    def __init__(self, reward: str = "custom_rew2", **rules: Any) -> None:
        """Makes a game that ``reset`` starts; arguments as of ``parallel_env``."""
        if reward not in REWARDS:
            raise ValueError(f"reward must be one of {REWARDS}, but is {reward!r}.")
        self.rules = make_rules(**rules)
        n = self.rules.team_size
        self.possible_agents = [f"{team}_{i}" for team in ("blue", "red") for i in range(n)]
        self.agents: list[str] = []
        size = observation_size(n)
        self.observation_spaces = {a: Box(-np.inf, np.inf, (size,), np.float32) for a in self.possible_agents}
        self.action_spaces = {a: Discrete(ACTIONS) for a in self.possible_agents}
        self._reward = REWARDS.index(reward)
        self._state = empty(1, n)
        self._raw = np.zeros(size)

    def observation_space(self, agent: str) -> Box:
        """Returns the space of the agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Discrete:
        """Returns the space of the agent's actions, always the same object, as its seed is kept in it."""
        return self.action_spaces[agent]

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observations, Infos]:
        """Starts a game and returns first observations and infos.

        Args:
            seed: has no effect, as the start is always the same and nothing in a game is random.
            options: have no effect either.
        """
        reset(self._state, 0, self.rules)
        self.agents = list(self.possible_agents)
        return self._observations(), self._infos()

    def step(
        self, actions: dict[str, int]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Plays one step; returns observations, rewards, terminations (a capture), truncations (time) and infos.

        Args:
            actions: 0..16 for each agent.

        Raises:
            RuntimeError: there is no game, or it is over.
            ValueError: an agent or its action is not allowed.
        """
        if not self.agents:
            raise RuntimeError("step must come after reset and before the end of the game, but there is no game now.")
        step(self._state, 0, self._numbers(actions), self.rules)
        end = finished(self._state, 0, self.rules)
        earned = np.zeros(len(self.possible_agents))
        rewards(self._reward, self._state, 0, self.rules, earned)
        agents = self.agents
        if end != RUNNING:
            self.agents = []
        return (
            self._observations(),
            dict(zip(agents, earned.tolist(), strict=True)),
            dict.fromkeys(agents, end not in (RUNNING, TIME_OUT)),
            dict.fromkeys(agents, end == TIME_OUT),
            self._infos(),
        )

    def _numbers(self, actions: dict[str, int]) -> NDArray[np.int64]:
        missing = [a for a in self.agents if a not in actions]
        unknown = [a for a in actions if a not in self.agents]
        if missing or unknown:
            raise ValueError(
                f"actions must have one entry for each of {self.agents}, but lacks {missing} and has {unknown} besides."
            )
        for agent, action in actions.items():
            number = np.asarray(action)
            whole = (
                number.shape == () and number.dtype.kind in "iuf" and math.isfinite(number) and number == int(number)
            )
            if not whole or not 0 <= number < ACTIONS:
                raise ValueError(f"actions[{agent!r}] must be a whole number 0..{ACTIONS - 1}, but is {action!r}.")
        return np.array([int(actions[a]) for a in self.agents], np.int64)

    def _observations(self) -> Observations:
        seen = np.zeros((len(self.possible_agents), len(self._raw)), np.float32)
        for v in range(len(seen)):
            observe(self._state, 0, v, self.rules, self._raw)
            normalise(self._raw, self.rules, seen[v])
        return dict(zip(self.possible_agents, seen, strict=True))

    def _infos(self) -> Infos:
        infos = {}
        for v, agent in enumerate(self.possible_agents):
            info = dict(zip(EVENTS, self._state.events[0, v].tolist(), strict=True))
            score = self._state.score[0, BLUE if v < self.rules.team_size else RED]
            info |= {"team_captures": int(score[CAPTURES]), "team_tags": int(score[TAGS])}
            infos[agent] = info | {"team_grabs": int(score[GRABS])}
        return infos
