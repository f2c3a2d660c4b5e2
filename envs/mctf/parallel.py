"""The game as a PettingZoo environment in which all act at once: names, spaces and checks around one lane."""

from collections.abc import Mapping
from typing import Any, ClassVar, cast

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from mctf import render, snapshot, spaces
from mctf.batch import checked_count
from mctf.kernel import RUNNING, finished
from mctf.lanes import direct, empty_lanes, empty_scratch, look, start_lanes, step_lanes
from mctf.rewards import is_over, make_reward
from mctf.rules import Rules, make_rules
from mctf.state import CAPTURES, EVENTS, GRABS, TAGS
from mctf.view import allowed_action, is_allowed, make_view
from mctf.words import check_word

Observations = dict[str, NDArray[np.float32]]
Infos = dict[str, dict[str, int]]


def parallel_env(reward: Any = "custom_rew2", **given: Any) -> "MctfEnv":
    """Returns one game; arguments as of ``MctfEnv``."""
    return MctfEnv(reward, **given)


class MctfEnv(ParallelEnv[str, Any, Any]):
    """One game of Capture-the-Flag. Agents are blue_0.. and red_0..; all act in every step.

    Actions are for ``"discrete"`` 0..7 full speed, 8..15 half speed, both with the turns 180, 135, .. -135 deg, and 16
    stops; for ``"continuous"`` a speed in m/s and a turn in deg, clockwise; for ``"field_points"`` 0..44 drive to that
    point of ``commands.FIELD_POINTS``.

    Observations are ``observe``'s vectors as float32: ``observations="normalised"`` scales every number by its range
    to [-1, 1], and the space is that if the rules cut what is outside; else it has no bounds, as some numbers leave
    their range. ``"raw"`` is in degrees, metres, m/s and seconds.

    Infos count the events of the game so far: ``state.EVENTS`` of the vehicle; captures, tags and grabs of its team.

    Attributes:
        rules: the game's constants.
        possible_agents: all of them.
        agents: the same during a game, else none.
        state_space: of ``state``.
        render_mode: as given.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]  # PettingZoo means the class's, too
        "name": "mctf_v0",
        "render_modes": ["human", "rgb_array", "ansi"],
        "is_parallelizable": True,
        "render_fps": render.FRAMES_PER_SECOND,
    }

    def __init__(
        self,
        reward: Any = "custom_rew2",
        reward_weights: Mapping[str, float] | None = None,
        actions: str = "discrete",
        observations: str = "normalised",
        render_mode: str | None = None,
        max_cycles: int | None = None,
        shaping: Mapping[str, float] | None = None,
        **rules: Any,
    ) -> None:
        """Makes a game that ``reset`` starts.

        Args:
            reward: a name of ``rewards.WEIGHTS``, a function, or ``module:function``; as of ``rewards.make_reward``.
            reward_weights: as of ``rewards.make_reward``.
            actions: "discrete", "continuous" or "field_points".
            observations: "normalised" or "raw".
            render_mode: "human", "rgb_array", "ansi" or None.
            max_cycles: steps after which the game is over, as PettingZoo calls them; None for ``max_time_s``.
            shaping: as of ``rewards.make_reward``.
            **rules: arguments of ``rules.make_rules``.

        Raises:
            ValueError: an argument is not allowed; the message names it, what is allowed and what was given.
            ImportError: "human" needs pygame, which is not there.
        """
        if render_mode is not None:
            check_word("render_mode", render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.rules = _timed(make_rules(**rules), max_cycles, rules)
        self._paid_for = reward, reward_weights, shaping
        self._view = make_view(actions, observations, self.rules)
        self._lanes, self._scratch = empty_lanes(1, self.rules), empty_scratch(self.rules)
        self._seeded = False
        blue, red = range(self.rules.blue_size), range(self.rules.red_size)
        self.possible_agents = [*(f"blue_{i}" for i in blue), *(f"red_{i}" for i in red)]
        self.agents: list[str] = []
        about = self._view, self.rules
        self.observation_spaces = {agent: spaces.observation_space(*about) for agent in self.possible_agents}
        self.action_spaces = {agent: spaces.action_space(*about) for agent in self.possible_agents}
        self.state_space = spaces.state_space(*about)
        self._compile()

    def _compile(self) -> None:
        """Makes what cannot be copied or pickled."""
        self._reward = make_reward(*self._paid_for)
        lanes, view, rules = self._lanes, self._view, self.rules
        self._step = direct(step_lanes, lanes, 0, 1, view, rules, self._reward, self._scratch)
        self._start = direct(start_lanes, lanes, np.zeros(1, np.int64), np.zeros(1, np.uint64), 0, view, rules)
        self._window = render.Window(rules) if self.render_mode == "human" else None

    def __getstate__(self) -> dict[str, Any]:
        """Returns all but what is compiled or on the screen, so that copies of a game go on as it does."""
        left_out = ("_reward", "_step", "_start", "_window")
        return {name: value for name, value in self.__dict__.items() if name not in left_out}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        self.__dict__.update(kept)
        self._compile()

    def observation_space(self, agent: str) -> Box:
        """Returns the space of the agent's observations, always the same object."""
        return cast("Box", self.observation_spaces[agent])

    def action_space(self, agent: str) -> Box | Discrete:
        """Returns the space of the agent's actions, always the same object, as its seed is kept in it."""
        return cast("Box | Discrete", self.action_spaces[agent])

    def reset(self, seed: int | None = None, options: Mapping[str, Any] | None = None) -> tuple[Observations, Infos]:
        """Starts a game and returns first observations and infos.

        Args:
            seed: in [0, 2**64); where random starts are drawn from. None draws on; the first time from anywhere.
            options: {"state": snapshot} starts from what ``save`` returned; it draws on from there if there is no seed.

        Raises:
            ValueError: seed or options are not allowed.
        """
        stream = None if seed is None else _checked_seed(seed)
        options = dict(options or {})
        start = options.pop("state", None)
        # PettingZoo's own tests hand in {"options": 1} to see whether there are options
        unknown = [name for name in options if (name, options[name]) != ("options", 1)]
        if unknown:
            raise ValueError(f"options may have 'state' only, but has {unknown[0]!r}.")
        if start is not None:
            before = snapshot.saved(self._lanes.state, 0, self.rules) if self._seeded else None
            self.restore(start)
            if not self.agents:
                if before is not None:
                    self.restore(before)
                raise ValueError("options['state'] must be of a game that goes on, but is of one that is over.")
            if stream is not None:
                self._lanes.state.stream[0] = stream
            return self._shown()
        self._begin(stream)
        return self._shown()

    def _begin(self, stream: int | None) -> None:
        state = self._lanes.state
        if stream is None and not self._seeded:
            stream = int(np.random.default_rng().integers(2**64, dtype=np.uint64))
        seeds = state.stream.copy() if stream is None else np.array([stream], np.uint64)
        memory = state.heading_error_prev.copy(), state.heading_error_known.copy()
        self._start(self._lanes, np.zeros(1, np.int64), seeds, 0, self._view, self.rules)
        if not self.rules.pid_reset:
            state.heading_error_prev[:], state.heading_error_known[:] = memory
        self.agents, self._seeded = list(self.possible_agents), True

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Plays one step; returns observations, rewards, terminations, truncations and infos.

        A game that is decided is terminated, one whose time is up is truncated, or terminated if the reward pays the
        result (``rewards.Reward.ends_on_time``); then all agents leave.

        Args:
            actions: one of each agent's action space.

        Raises:
            RuntimeError: there is no game, or it is over, or the reward function failed.
            ValueError: an agent or its action is not allowed; no step is played.
        """
        if not self.agents:
            raise RuntimeError("step must come after reset and before the end of the game, but there is no game now.")
        self._take(actions)
        self._step(self._lanes, 0, 1, self._view, self.rules, self._reward, self._scratch)
        if not np.isfinite(self._lanes.paid).all():
            raise RuntimeError(
                f"reward must be finite, but the function failed or gave {self._lanes.paid[0].tolist()}."
            )
        end, agents = self._lanes.end[0], self.agents
        if end != RUNNING:
            self.agents = []
        terminated = bool(is_over.py_func(end, self._reward))
        observations, infos = self._shown()
        return (
            observations,
            dict(zip(agents, self._lanes.paid[0].tolist(), strict=True)),
            dict.fromkeys(agents, terminated),
            dict.fromkeys(agents, bool(end != RUNNING and not terminated)),
            infos,
        )

    def _take(self, actions: Mapping[str, Any]) -> None:
        """Copies actions to the lane if all are allowed."""
        given = set(actions) if isinstance(actions, Mapping) else {repr(actions)}
        if given != set(self.agents):
            missing = [agent for agent in self.agents if agent not in given]
            unknown = sorted(given - set(self.agents), key=str)
            raise ValueError(
                f"actions must have one entry for each of {self.agents}, but lacks {missing} and has {unknown} besides."
            )
        for agent in self.agents:
            self.check_action(agent, actions[agent])
        for v, agent in enumerate(self.agents):
            if self._view.continuous:
                self._lanes.commands[0, v] = actions[agent]
            else:
                self._lanes.actions[0, v] = self._view.first_action + int(actions[agent])

    def check_action(self, agent: str, action: Any) -> None:
        """Raises a ValueError unless ``action`` may be the agent's."""
        if not is_allowed(action, self._view, self.rules):
            allowed = allowed_action(self._view, self.rules)
            raise ValueError(f"actions[{agent!r}] must be {allowed}, but is {action!r}.")

    def state(self) -> NDArray[np.float32]:
        """Returns all of the field in one vector, as of ``spaces.seen_from_above``.

        Raises:
            RuntimeError: there was no game yet.
        """
        self._check_started("state")
        return spaces.seen_from_above(self._lanes.state, 0, self._view, self.rules)

    def save(self) -> dict[str, NDArray[Any]]:
        """Returns the whole game as named arrays: what ``restore`` takes, and ``reset`` as option ``state``.

        Raises:
            RuntimeError: there was no game yet.
        """
        self._check_started("save")
        return snapshot.saved(self._lanes.state, 0, self.rules)

    def restore(self, saved: Mapping[str, Any]) -> tuple[Observations, Infos]:
        """Takes up a game where it was saved, and returns the observations and infos of then.

        Raises:
            ValueError: ``saved`` is not of ``save``, or of a game of another shape or other rules; nothing changes.
        """
        lanes = self._lanes
        snapshot.restore(saved, lanes.state, 0, self.rules)
        lanes.game[0], self._seeded = 0, True
        lanes.end[0] = finished(lanes.state, 0, self.rules)
        look(lanes, 0, self._view, self.rules)
        self.agents = list(self.possible_agents) if lanes.end[0] == RUNNING else []
        return self._shown()

    def render(self) -> NDArray[np.uint8] | str | None:
        """Returns a picture, (H, W, 3) RGB or text; for "human" shows it in a window, which each step does as well.

        Raises:
            RuntimeError: there was no game yet, or no ``render_mode``.
        """
        self._check_started("render")
        if self.render_mode is None:
            modes = self.metadata["render_modes"]
            raise RuntimeError(f"render needs a render_mode when the environment is made, one of {modes}.")
        if self.render_mode == "rgb_array":
            return render.frame(self._lanes.state, 0, self.rules)
        if self.render_mode == "ansi":
            return render.text(self._lanes.state, 0, self.rules)
        if self._window is not None:  # it is there in the one mode that is left, "human"
            self._window.show(self._lanes.state, 0)
        return None

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _check_started(self, name: str) -> None:
        if not self._seeded:
            raise RuntimeError(f"{name} must come after reset, but there was no game yet.")

    def _shown(self) -> tuple[Observations, Infos]:
        """Returns observations and infos of now; shows it to people."""
        if self.render_mode == "human":
            self.render()
        state, infos = self._lanes.state, {}
        for v, agent in enumerate(self.possible_agents):
            score = state.score[0, 0 if v < self.rules.blue_size else 1].tolist()
            team = {"team_captures": score[CAPTURES], "team_tags": score[TAGS], "team_grabs": score[GRABS]}
            infos[agent] = dict(zip(EVENTS, state.events[0, v].tolist(), strict=True)) | team
        return dict(zip(self.possible_agents, self._lanes.seen[0].copy(), strict=True)), infos


def _timed(rules: Rules, max_cycles: int | None, given: Mapping[str, Any]) -> Rules:
    """Returns rules under which the game is over after ``max_cycles`` steps, if that is given."""
    if max_cycles is None:
        return rules
    if given.get("max_time_s") is not None:
        raise ValueError("max_cycles and max_time_s say the same, in steps and in s; give one of them.")
    steps = checked_count("max_cycles", max_cycles)
    # A little less than the time of so many steps, which is a sum of rounded numbers and may fall short of it. Where
    # the clock does not overrun, a game is over near its time, and of many steps the last ones are near.
    time_s = steps * rules.substeps * rules.tau_s * (1.0 - 1e-9)
    return make_rules(**dict(given) | {"max_time_s": time_s, "clock_overruns": True})


def _checked_seed(seed: Any) -> int:
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or not 0 <= seed < 2**64:
        raise ValueError(f"seed must be a whole number in [0, 2**64), but is {seed!r}.")
    return int(seed)
