"""Marine Capture-the-Flag: the game of package mctf as training and evaluation play it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.env.base import Results
from berteam_cli.env.mctf_game import Scratch, play_games
from berteam_cli.errors import RunError
from berteam_cli.outcomes import HABITS, Ints
from mctf.observe import ranges
from mctf.practice import BY_THE_RULES, Starts
from mctf.rewards import TERMS, Reward, make_reward
from mctf.rules import ACTIONS, Rules, make_rules
from mctf.scripted import NAMES as FIXED_POLICIES
from mctf.scripted import PAPER
from mctf.shaping import BOUNDS
from mctf.state import empty


@dataclass(frozen=True, init=False, eq=False)
class Mctf:
    """The game of package mctf between two teams of equal size.

    Attributes:
        rules: of the game.
        reward: what learners are paid for.
        scale: (2, O / k) ranges of what players see in a step.
        last_steps: k, how many steps' observations networks see in one, the newest first.
        given: the settings it was made from, besides team_size.
        starts: how games start; other than as the rules say only in ``practice``.
    """

    team_size: int
    rules: Rules
    reward: Reward
    scale: npt.NDArray[np.float32]
    observation_size: int
    last_steps: int
    longest: int
    given: Mapping[str, Any]
    name: str = "mctf"
    sides: int = 2
    actions: int = ACTIONS
    fixed_policies: tuple[str, ...] = field(default=FIXED_POLICIES)
    standard_policies: int = len(PAPER)
    starts: Starts = BY_THE_RULES
    habits: tuple[str, ...] = HABITS

    def __init__(
        self,
        team_size: int,
        reward: str,
        reward_weights: Mapping[str, float | None] | None = None,
        last_steps: int = 1,
        **settings: Any,
    ) -> None:
        """Takes the settings of mctf.rules.make_rules, mctf.rewards.make_reward and mctf.shaping.make_shaping.

        Raises:
            ValueError: a setting is not allowed, or games would be too long to record.
        """
        given = {"reward": reward, "reward_weights": reward_weights, "last_steps": last_steps, **settings}
        shaping = {name: settings.pop(name) for name in BOUNDS if name in settings}
        rules = make_rules(team_size=team_size, **settings)
        if not 1 <= last_steps <= 16:  # rollouts and buffers hold each step so many times
            raise ValueError(f"last_steps must be a whole number from 1 to 16, but is {last_steps!r}.")
        longest = math.ceil(rules.max_time_s / (rules.substeps * rules.tau_s)) + 1  # the clock adds up with rounding
        if longest > 1_000_000:
            raise ValueError(f"max_time_s gives games of {longest} steps; at most 1000000 are allowed.")
        object.__setattr__(self, "team_size", team_size)
        object.__setattr__(self, "rules", rules)
        object.__setattr__(self, "reward", make_reward(reward, reward_weights, shaping))
        object.__setattr__(self, "scale", ranges(rules))
        object.__setattr__(self, "last_steps", last_steps)
        object.__setattr__(self, "observation_size", last_steps * self.scale.shape[1])
        object.__setattr__(self, "longest", longest)
        object.__setattr__(self, "given", given)

    def __reduce__(self) -> tuple[Any, ...]:
        """Returns how it is made again elsewhere: a compiled reward cannot travel, but its name can."""
        return partial(Mctf, self.team_size, **self.given), (), {"starts": self.starts}

    def practice(self, starts: Starts) -> Mctf:
        """Returns the game as it is played for practice, with other starts than the rules'."""
        other = object.__new__(Mctf)
        other.__dict__.update(self.__dict__, starts=starts)
        return other

    def play(  # noqa: D102
        self, games: range, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        span, scratch = (games.start, games.stop), blank_scratch(self, policies)
        reward = self.reward._replace(factors=scratch.factors)
        play_games(*span, players, policies, seeds, results, self.rules, reward, self.scale, self.starts, scratch)
        if self.reward.has_own and len(results.rewards):
            check_paid(games, seeds, results)

    @property
    def reward_weights(self) -> dict[str, float]:
        """The weight of each term of the reward, besides what a function pays."""
        return dict(zip(TERMS, self.reward.weights.tolist(), strict=True))

    def fingerprint(self) -> dict[str, object]:  # noqa: D102
        return {"env": "mctf", **self.rules._asdict()}


def check_paid(games: range, seeds: npt.NDArray[np.uint64], results: Results) -> None:
    """Checks what a function of the user's paid in ``games``.

    Raises:
        RunError: it failed, or gave something else than a finite number.
    """
    for b in games:
        if not np.isfinite(results.rewards[b, :, : results.steps[b]]).all():
            raise RunError(
                f"env.reward must give finite numbers, but failed or did not in game {b}, of seed {seeds[b]}."
            )


def blank_scratch(env: Mctf, policies: Policies) -> Scratch:
    """Returns room for the games of ``env``, played by ``policies``."""
    vehicles, numbers = 2 * env.team_size, env.scale.shape[1]
    return Scratch(
        state=empty(1, env.rules),
        raw=np.zeros((vehicles, numbers)),
        before=np.zeros((vehicles, numbers)),
        seen=np.zeros((vehicles, env.observation_size), dtype=np.float32),
        actions=np.zeros(vehicles, dtype=np.int64),
        paid=np.zeros(vehicles),
        terms=np.zeros(len(TERMS)),
        work=np.zeros(2 * (policies.sizes.max() + 1), dtype=np.float32),
        factors=np.ones((vehicles, policies.pay.shape[1])),
    )
