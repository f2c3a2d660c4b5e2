"""Any PettingZoo parallel environment of two teams, at its own speed, in worker processes."""

from __future__ import annotations

import json
import logging
import os
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from berteam_cli.acting import Policies
from berteam_cli.env.base import Results
from berteam_cli.env.pettingzoo_game import INFO, REWARD, Played
from berteam_cli.env.pettingzoo_made import Facts, Game
from berteam_cli.env.pettingzoo_worker import Failed, Processes, WorkerProcess
from berteam_cli.errors import RunError
from berteam_cli.outcomes import Ints

log = logging.getLogger("berteam")

KNOWN: dict[str, Facts] = {}
"""What environments are like, by their settings: a sweep builds its environment many times."""


@dataclass(frozen=True, init=False, eq=False)
class Pettingzoo:
    """An environment that the user names, between two teams of equal size.

    No event is counted in it. Its one fixed policy takes any action with equal chance.

    Attributes:
        game: its settings.
        processes: where it is played.
    """

    team_size: int
    game: Game
    observation_size: int
    actions: int
    longest: int
    processes: Processes
    name: str = "pettingzoo"
    sides: int = 2
    fixed_policies: tuple[str, ...] = ("random",)
    standard_policies: int = 1

    def __init__(
        self,
        team_size: int,
        target: str | None,
        options: dict[str, Any],
        teams: dict[str, list[str]],
        max_steps: int,
        score: str,
    ) -> None:
        """Takes the settings of conf/env/pettingzoo.yaml, and makes the environment once to see what it is like.

        Raises:
            ValueError: a setting is not allowed, or the environment cannot be played with it.
        """
        if target is None or not re.fullmatch(r"\w+(\.\w+)*:\w+", target):
            given = "null" if target is None else target
            raise ValueError(
                f"target must be the MODULE:FUNCTION of an environment, such as mctf:parallel_env, but is {given}."
            )
        if score != REWARD and not (score.startswith(INFO) and score != INFO):
            raise ValueError(f"score must be {REWARD}, or {INFO}KEY with a key of the infos, but is {score!r}.")
        game = Game(target, options, teams, max_steps, score, os.getcwd())
        facts = inspected(game)
        size = len(facts.agents) // 2
        if size != team_size:
            raise ValueError(f"target has teams of {size}, but team_size is {team_size}; say team_size={size}.")
        object.__setattr__(self, "team_size", team_size)
        object.__setattr__(self, "game", game)
        object.__setattr__(self, "observation_size", facts.observation_size)
        object.__setattr__(self, "actions", facts.actions)
        object.__setattr__(self, "longest", max_steps)
        object.__setattr__(self, "processes", Processes(game))

    def play(
        self, games: range, players: Ints, policies: Policies, seeds: npt.NDArray[np.uint64], results: Results
    ) -> None:
        """Plays in a worker process of its own; see ``Env.play``. An array of ``policies`` must not change later.

        Raises:
            RunError: the environment failed.
        """
        b = games.start
        try:
            with self.processes.one() as worker:
                asked = slice(games.start, games.stop)
                worker.ask(policies, players[asked], seeds[asked], record=len(results.actions) > 0)
                for b in games:
                    settle(results, b, worker.answer())
        except Failed as failure:
            if failure.trace:
                log.error("%s", failure.trace)
            raise RunError(f"game {b}, of seed {seeds[b]}, cannot be played: {failure.why.rstrip('.')}") from None

    def stop(self) -> None:  # noqa: D102
        self.processes.stop()

    def fingerprint(self) -> dict[str, object]:  # noqa: D102
        settings = self.game._asdict()
        del settings["folder"]
        told: dict[str, object] = json.loads(json.dumps(settings))  # whose keys can be sorted: options may have numbers
        return {"env": self.name, **told}


def inspected(game: Game) -> Facts:
    """Returns what the environment is like. Adds to ``KNOWN``.

    Raises:
        ValueError: it cannot be made, or not be played by two equal teams.
    """
    settings = repr(game)
    if settings not in KNOWN:
        worker = WorkerProcess(game)
        try:
            KNOWN[settings] = worker.facts()
        except Failed as failure:
            raise ValueError(failure.why) from None
        finally:
            worker.close()
    return KNOWN[settings]


def settle(results: Results, b: int, played: Played) -> None:
    """Writes what came of game ``b`` to its row of ``results``."""
    results.scores[b, 0] = 1.0 if played.gap > 0 else 0.5 if played.gap == 0 else 0.0
    results.scores[b, 1] = 1.0 - results.scores[b, 0]
    results.steps[b] = played.steps
    results.terminated[b] = all(played.terminated)
    if len(results.actions) > 0:
        results.ended[b] = played.terminated
        for v, length in enumerate(played.lengths):
            results.lengths[b, v] = length
            results.observations[b, v, : length + 1] = played.observations[v]
            results.actions[b, v, :length] = played.actions[v]
            results.rewards[b, v, :length] = played.rewards[v]
