"""Plays one game of a PettingZoo environment; everybody draws from the stream of the game, as in compiled games."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import fsum, isfinite
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from gymnasium.spaces import Discrete, Space
from pettingzoo import ParallelEnv

from berteam_cli.acting import FIXED, Policies, act
from berteam_cli.env.pettingzoo_made import Facts, Game, Unfit
from mctf.draws import next_uniform

REWARD, INFO = "reward", "info:"  # what decides a game: the rewards, or an entry of the infos
LARGEST = float(np.finfo(np.float32).max)  # of a reward, as learners keep them
ROUNDING = 1e-6  # of all that was paid: fractions that differ by less are alike, as float32 keeps seven digits


@dataclass
class Player:
    """An agent in one game, and what it saw, did and was paid for until it left.

    Attributes:
        name: of the agent.
        seeing: its observation space.
        size: O.
        first_action: what the environment calls action 0.
        observations: of them each (O,); without a record only the last one.
        playing: whether it is still in the game.
        terminated: whether the rules ended the game for it; else time ran out.
        info: what the environment last told of it.
    """

    name: str
    seeing: Space[Any]
    size: int
    first_action: int
    observations: list[npt.NDArray[np.float32]] = field(default_factory=list)
    actions: list[int] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    playing: bool = True
    terminated: bool = False
    info: Mapping[str, Any] = field(default_factory=dict)


class Played(NamedTuple):
    """What came of one game.

    Attributes:
        gap: what blue has more than red of what decides the game.
        steps: until everybody had left, or time ran out.
        lengths: (V,) steps of each player.
        terminated: (V,) whether the rules ended the game for it.
        observations: of each player (lengths[v] + 1, O) float32; nothing if no record is wanted, as below.
        actions: of each player (lengths[v],).
        rewards: of each player (lengths[v],).
    """

    gap: float
    steps: int
    lengths: list[int]
    terminated: list[bool]
    observations: list[npt.NDArray[np.float32]]
    actions: list[list[int]]
    rewards: list[list[float]]


def played(
    env: ParallelEnv[str, Any, Any],
    game: Game,
    facts: Facts,
    policies: Policies,
    rows: npt.NDArray[np.int64],
    seed: int,
    *,
    record: bool,
) -> Played:
    """Returns what came of one game.

    Args:
        env: the environment.
        game: its settings.
        facts: what it is like.
        policies: how everybody acts.
        rows: (V,) row in ``policies`` of each player.
        seed: in [0, 2**64), of the stream that the policies draw from; its upper 31 bits seed the environment.
        record: whether anyone will learn from the game.
    """
    random.seed(seed >> 33)  # some environments draw from these two, whatever reset is given
    np.random.seed(seed >> 33)  # noqa: NPY002
    stream = np.array([seed], dtype=np.uint64)
    work = np.zeros(2 * max(int(policies.sizes.max()), 1), dtype=np.float32)
    players = begun(env, facts, seed >> 33)
    steps = 0
    while steps < game.max_steps and any(player.playing for player in players):
        chosen = {}
        for player, k in zip(players, rows, strict=True):
            if player.playing:
                action = action_of(policies, k, player.observations[-1], facts.actions, work, stream)
                player.actions.append(action)
                chosen[player.name] = player.first_action + action
        note(players, env.step(chosen), set(env.agents), record=record)
        steps += 1
    return Played(
        gap_of(players, game.score),
        steps,
        [len(player.rewards) for player in players],
        [player.terminated for player in players],
        [np.stack(player.observations) for player in players] if record else [],
        [player.actions for player in players] if record else [],
        [player.rewards for player in players] if record else [],
    )


def begun(env: ParallelEnv[str, Any, Any], facts: Facts, seed: int) -> list[Player]:
    """Returns the players at the start of a game.

    Raises:
        Unfit: an agent is not there.
    """
    for i, name in enumerate(facts.agents):  # spaces draw from generators of their own, which no reset seeds
        for space in (env.action_space(name), env.observation_space(name)):
            space.seed(seed + i)
    observations, infos = env.reset(seed=seed)
    players = []
    for name in facts.agents:
        if name not in env.agents:
            raise Unfit(f"agent {name} is not in the game after reset; every agent must be")
        actions: Any = env.action_space(name)  # Discrete, as facts_of saw to
        player = Player(name, env.observation_space(name), facts.observation_size, int(actions.start))
        player.observations.append(vector(player, entry(observations, player, "observations")))
        player.info = infos.get(name, {})
        players.append(player)
    return players


def action_of(
    policies: Policies,
    k: int,
    seen: npt.NDArray[np.float32],
    actions: int,
    work: npt.NDArray[np.float32],
    stream: npt.NDArray[np.uint64],
) -> int:
    """Returns the action of policy ``k``; a network draws two numbers from ``stream``, the random policy one."""
    if policies.kind[k] == FIXED:
        return min(int(next_uniform(stream, 0) * actions), actions - 1)
    chance, choice = next_uniform(stream, 0), next_uniform(stream, 0)
    return int(act(policies, k, seen, work, chance, choice))


def note(players: list[Player], stepped: tuple[Any, ...], there: set[str], *, record: bool) -> None:
    """Writes down what a step did to those who were playing, and who left with it. Changes ``players``.

    Raises:
        Unfit: the environment does not say what it must, or somebody is back who had left.
    """
    observations, rewards, terminations, truncations, infos = stepped
    for player in players:
        if not player.playing:
            if player.name in there:
                raise Unfit(f"agent {player.name} is in the game again after it had left, which is not supported")
            continue
        reward = float(entry(rewards, player, "rewards"))
        if not abs(reward) <= LARGEST:
            raise Unfit(f"the reward of agent {player.name} must be a finite number of 32 bits, but is {reward}")
        player.rewards.append(reward)
        player.terminated = bool(entry(terminations, player, "terminations"))
        gone = player.terminated or bool(entry(truncations, player, "truncations")) or player.name not in there
        player.playing = not gone
        player.info = infos.get(player.name, player.info)
        if gone and player.name not in observations:  # it saw no more: what it saw last stands for it
            seen = player.observations[-1]
        else:
            seen = vector(player, entry(observations, player, "observations"))
        if record:
            player.observations.append(seen)
        else:
            player.observations = [seen]


def entry(given: Mapping[str, Any], player: Player, what: str) -> Any:
    """Returns the player's entry.

    Raises:
        Unfit: there is none.
    """
    if player.name not in given:
        raise Unfit(f"{what} must have an entry for agent {player.name}, but has only {list(given)}")
    return given[player.name]


def vector(player: Player, observation: Any) -> npt.NDArray[np.float32]:
    """Returns (O,) an observation as networks see it: a box flattened, one of n as n numbers.

    Raises:
        Unfit: it is not of the agent's space.
    """
    space = player.seeing
    if isinstance(space, Discrete):
        index = int(observation) - int(space.start)
        if not 0 <= index < space.n:
            raise Unfit(f"the observation of agent {player.name} must be in {space}, but is {observation}")
        return np.eye(1, int(space.n), index, dtype=np.float32)[0]
    seen = np.array(observation, dtype=np.float32).reshape(-1)  # a copy: the environment may change its own
    if len(seen) != player.size or not np.isfinite(seen).all():
        raise Unfit(f"the observation of agent {player.name} must be finite and in {space}, but is {observation}")
    return seen


def gap_of(players: list[Player], score: str) -> float:
    """Returns what blue has more than red: of the rewards of the game, or of an entry of the agents' last infos.

    What rounding may leave of equal fractions is 0; whole numbers are exact.

    Raises:
        Unfit: an agent has no such number.
    """
    parts: list[list[float]] = []
    for team in (players[: len(players) // 2], players[len(players) // 2 :]):
        if score == REWARD:
            parts.append([reward for player in team for reward in player.rewards])
        else:
            parts.append([told(player, score.removeprefix(INFO)) for player in team])
    blue, red = parts
    gap = fsum(blue) - fsum(red)  # equal whatever the order
    whole = all(float(part).is_integer() for part in blue + red)
    return gap if whole or abs(gap) > ROUNDING * fsum(map(abs, blue + red)) else 0.0


def told(player: Player, key: str) -> float:
    """Returns entry ``key`` of the player's last info.

    Raises:
        Unfit: there is none, or it is no finite number.
    """
    if key not in player.info:
        raise Unfit(f"env.score={INFO}{key}: the last info of agent {player.name} has only {list(player.info)}")
    value = float(player.info[key])
    if not isfinite(value):
        raise Unfit(f"env.score={INFO}{key}: agent {player.name} must have a finite number, but has {value}")
    return value
