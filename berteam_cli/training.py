"""The training loop: the paper's Algorithm 1, with the selector that learns beside it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import fixed_policies, joined
from berteam_cli.curriculum import Curriculum
from berteam_cli.env.base import Trajectories
from berteam_cli.games import Games, as_side_0, both_sides
from berteam_cli.learner.base import Learning
from berteam_cli.opponents.base import Met, Opponents
from berteam_cli.optimizer.base import Optimizer, Replacement
from berteam_cli.outcomes import Ints, Lineups, Outcomes
from berteam_cli.population import Population, founded, policies
from berteam_cli.selector.base import Answering, Selecting, Selector

FOUNDING, EPOCHS, RECORDS, EVALUATION, PAYOFFS, WATCHED, ARCHIVE = range(7)  # what a stream of random numbers is for


@dataclass(frozen=True)
class Parts:
    """What does not change in a run.

    Attributes:
        seed: of all chance.
        games_per_epoch: B, those against other opponents included.
        games: what is played.
        selector: who chooses teams.
        optimizer: what makes members better.
        room: where the trajectories of an epoch's games go, the same in every epoch; None where nobody looks.
        curriculum: how the games start from which members learn.
        opponents: who brings other opponents than the population's teams.
    """

    seed: int
    games_per_epoch: int
    games: Games
    selector: Selector[Any]
    optimizer: Optimizer
    room: Trajectories | None
    curriculum: Curriculum
    opponents: Opponents


@dataclass(frozen=True)
class Run:
    """What changes: all that the next epoch depends on.

    Attributes:
        epoch: how many are done.
        population: the members.
        selection: what the selector has learnt.
        played: games of all epochs.
        steps: of those games and of the probing games.
        league: the state of who brings other opponents.
    """

    epoch: int
    population: Population
    selection: Any
    played: int = 0
    steps: int = 0
    league: Any = None


@dataclass
class Report:
    """What happened in one epoch, for the tables; ``outcomes`` are those of games among the population's teams."""

    outcomes: Outcomes
    met: Met
    learnt: list[tuple[int, Learning]] = field(default_factory=list)
    replaced: list[Replacement] = field(default_factory=list)
    selecting: Selecting = field(default_factory=Selecting)
    env_steps: int = 0
    seconds: dict[str, float] = field(default_factory=dict)


def generator(seed: int, purpose: int, epoch: int = 0) -> Generator:
    """Returns the source of chance for one purpose in one epoch; nothing else draws from it."""
    return np.random.default_rng([seed, purpose, epoch])


def begin(parts: Parts) -> Run:
    """Returns the run before its first epoch."""
    people, selection = generator(parts.seed, FOUNDING).spawn(2)
    population = founded(parts.optimizer.islands, parts.optimizer.fitness.initial, people, len(parts.optimizer.terms))
    return Run(0, population, parts.selector.init(selection), league=parts.opponents.begun(population))


def epoch(run: Run, parts: Parts) -> tuple[Run, Report]:
    """Selects teams, plays, rates, learns, renews, and learns to select (paper, Algorithm 1)."""
    select, play, learn, probe, renew, study, meet = generator(parts.seed, EPOCHS, run.epoch).spawn(7)
    selector, optimizer, opponents, population = parts.selector, parts.optimizer, parts.opponents, run.population
    clock = Clock()

    def choose(games: int, rng: Generator) -> Lineups:
        return selector.select(run.selection, games, population.age, rng)

    lineups = choose((parts.games_per_epoch - opponents.games) // rounds(selector), select)
    guests = opponents.invited(run.league, population.size, choose, meet)
    clock.lap("select_s")
    members = policies(optimizer.islands, population, explore=True)._replace(pay=population.pay)
    acting = joined([members, guests.policies])
    practice, all_games = parts.curriculum.practice(parts.games, run.epoch), lineups.followed_by(guests.lineups)
    played, lived = practice.play(acting, all_games, key(play), record=watched(parts), room=parts.room)
    outcomes, met = played.of(slice(len(lineups))), Met(guests.teams, played.of(slice(len(lineups), None)))
    seen = lived.of_first(len(lineups), len(all_games))
    if selector.answers:  # each opponent once more, with teams chosen on what was seen of it
        lineups = cast("Answering[Any]", selector).answer(run.selection, lineups, seen, population.age, select)
        again = practice.play(acting, lineups, key(play), record=True)
        outcomes, seen = outcomes.followed_by(again[0]), seen.followed_by(again[1])
        lived = lived.followed_by(again[1])
    population = optimizer.rate(population, outcomes)
    clock.lap("play_s")
    population, learnt, healed = optimizer.train(population, lived, learn)
    clock.lap("learn_s")
    probes = Probes(parts, key(probe))
    population = optimizer.project(population, run.epoch + 1, probes.play)
    clock.lap("probe_s")
    population, replaced = optimizer.renew(population, renew)
    population, league = opponents.renewed(run.league, met, population, run.epoch + 1, meet)
    clock.lap("renew_s")
    selection, selecting = selector.learn(run.selection, outcomes, seen, population.fitness, study)
    clock.lap("selector_s")

    games = len(outcomes.scores) + len(met.teams)
    steps = int(outcomes.steps.sum()) + int(met.outcomes.steps.sum()) + probes.steps
    after = Run(run.epoch + 1, population, selection, run.played + games, run.steps + steps, league)
    return after, Report(outcomes, met, learnt, healed + replaced, selecting, steps, clock.laps)


def rounds(selector: Selector[Any]) -> int:
    """Returns how often an opponent is met before another comes."""
    return 2 if selector.answers else 1


def watched(parts: Parts) -> bool:
    """Returns whether anybody wants to know what the players saw."""
    return parts.optimizer.learns or parts.selector.observes


def key(rng: Generator) -> int:
    """Returns the key from which the games of one batch make their own streams."""
    return int(rng.integers(2**63))


@dataclass
class Probes:
    """Games that measure how members behave; nobody learns from them and no table lists them."""

    parts: Parts
    key: int
    steps: int = 0

    def play(self, population: Population, teams: Ints, opponents: Ints, each: int) -> Outcomes:
        """Returns the outcomes with ``teams`` as side 0; see ``optimizer.base.Probe``."""
        env = self.parts.games.env
        members = policies(self.parts.optimizer.islands, population, explore=False)
        acting = joined([members, fixed_policies(range(len(env.fixed_policies)))])
        lineups = both_sides(teams, opponents + population.size, each, env.sides)
        outcomes, _ = self.parts.games.play(acting, lineups, self.key)
        self.steps += int(outcomes.steps.sum())
        return as_side_0(outcomes, each)


class Clock:
    """Tells how long each part of an epoch took, in seconds."""

    def __init__(self) -> None:
        """Starts."""
        self.laps: dict[str, float] = {}
        self.last = time.perf_counter()

    def lap(self, name: str) -> None:
        """Ends part ``name``, which began when the one before ended."""
        now = time.perf_counter()
        self.laps[name] = now - self.last
        self.last = now
