"""Looks at a training while it runs: a few of its teams play the teams of fixed policies, and nobody learns from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from berteam_cli.env.base import Env
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.sight import ALL, BEST_MEMBER, BEST_TEAM, CHOICE, Line, Sight
from berteam_cli.evaluation.truth import Chosen, Fixture, Truth, fixture, rated
from berteam_cli.games import arrangements
from berteam_cli.optimizer.base import Optimizer
from berteam_cli.outcomes import EVENTS, Bools, Floats, Ints, Outcomes
from berteam_cli.population import Population, learners, policies
from berteam_cli.rating.copies import clusters
from berteam_cli.records import team_names
from berteam_cli.training import WATCHED, Parts, Run, generator, key


@dataclass(frozen=True)
class Watching:
    """How a run is looked at.

    A look draws from a stream of its own and changes nothing, so that a run is the same whether it is looked at or not.

    Attributes:
        parts: of the run.
        every: epochs from one look to the next.
        teams: K, so many are drawn from the selector for each look.
        reference: their opponents, whose Elos are held.
    """

    parts: Parts
    every: int
    teams: int
    reference: Reference

    def due(self, epoch: int) -> bool:
        """Returns whether the run is looked at after so many epochs; if they are its last, it is in any case."""
        return epoch % self.every == 0

    def look(self, run: Run) -> Sight:
        """Returns how K drawn teams and the best member, in every place, fare against each team of the reference.

        Each plays once in every way to hold the sides: of two sides, once from either.
        """
        parts, games = self.parts, self.parts.games
        drawing, ordering, playing = generator(parts.seed, WATCHED, run.epoch).spawn(3)
        drawn = parts.selector.sample(run.selection, self.teams, drawing)
        best = np.full((1, drawn.shape[1]), best_member(parts.optimizer, run.population))
        teams = np.sort(np.concatenate([drawn, best]), axis=1)
        members = policies(parts.optimizer.islands, run.population, explore=False)
        matches = fixture(games, members, teams, self.reference, len(arrangements(games.env.sides)), ordering)
        outcomes, _ = games.play(matches.acting, matches.lineups, key(playing))
        return sight(run.epoch, Played(games.env, teams, self.reference, matches, outcomes))


def best_member(optimizer: Optimizer, population: Population) -> int:
    """Returns the fittest member, of those that learn if any do; no exploiter, as those are chosen for no team.

    Of several as fit it is the one that has played most: members that have not played have the fitness that they began
    with, and under a moving average of scores that may be the highest there is.
    """
    learning = learners(optimizer.islands) if optimizer.learns else []
    return max(learning or range(population.size), key=lambda n: (population.fitness[n], population.games[n]))


@dataclass(frozen=True)
class Played:
    """Games of K teams against J teams of fixed policies, G against each, and what came of them.

    Attributes:
        env: the game.
        teams: (K, T) members in ascending order; the same team may be there several times, each time with its games.
        reference: the opponents.
        fixture: the games.
        outcomes: of them.
    """

    env: Env
    teams: Ints
    reference: Reference
    fixture: Fixture
    outcomes: Outcomes

    def part(self, teams: slice, games: Bools) -> Played:
        """Returns only the games of some ``teams``, and of these those that ``games`` (J, G) tells, as many of each J.

        What is a copy of a game of others is none here: copies are counted within the part.
        """
        index = self.index[teams][:, games]
        return self.of(index.reshape(len(index), len(games), -1), self.teams[teams])

    @property
    def index(self) -> Ints:
        """(K, J, G) where each game stands."""
        return np.arange(len(self.fixture.lineups)).reshape(self.fixture.shape)

    def of(self, index: Ints, teams: Ints) -> Played:
        """Returns the games at ``index``, (K', J, G'), as those of K' ``teams``."""
        whole, at = self.fixture, index.ravel()
        outcomes = self.outcomes.of(at)
        alike = clusters(self.env, whole.acting, outcomes.lineups.teams)
        settled = np.zeros(index.shape[:2], dtype=np.bool_)  # so few games leave everything open
        shape = (index.shape[0], index.shape[1], index.shape[2])
        games = Fixture(whole.acting, outcomes.lineups, whole.held[at], shape, alike, settled)
        return Played(self.env, teams, self.reference, games, outcomes)

    def rated(self) -> Truth:
        """Returns the Elos of the teams, as of teams that were drawn."""
        count = len(self.teams)
        drawn = (np.full(count, math.nan), np.zeros(count, dtype=np.bool_), np.ones(count, dtype=np.int64))
        return rated(Chosen(self.teams, *drawn, listed_mass=0.0), self.reference, self.fixture, self.outcomes)

    def expected_elo(self) -> tuple[float, float]:
        """Returns the Elo of a team as these were drawn, and its 95 % half width.

        The width is what the scatter of the teams says, which may by chance be nothing, as where the same few come
        again; and not less than all the games would leave open if one player had played them.
        """
        elo, width = self.rated().expected_elo()
        as_one = self.of(self.index.swapaxes(0, 1).reshape(1, self.fixture.shape[1], -1), self.teams[:1])
        return elo, float(np.maximum(width, as_one.rated().half_widths[0]))

    def figures(self) -> tuple[Ints, Floats]:
        """Returns (K, J, G, 3) whether each game was won, drawn or lost, and (K, J, G, 8) the figures of ``Line``."""
        held, come = self.fixture.held, self.outcomes
        made, left = (np.where(ours, come.scores, 0.0).sum(axis=1) for ours in (held, ~held))
        won, lost = left == 0.0, made == 0.0
        results = np.stack([won, ~won & ~lost, lost], axis=1).astype(np.int64)
        own, others = (np.where(ours[:, :, np.newaxis], come.events, 0).sum(axis=1) for ours in (held, ~held))
        counted = np.column_stack([own, others[:, : EVENTS.index("wall_hits")], come.steps]).astype(float)
        return results.reshape(*self.fixture.shape, 3), counted.reshape(*self.fixture.shape, -1)

    def lines(self, who: str, *, each: bool, elo: float, half_width: float) -> list[Line]:
        """Returns the line against all, and before it if ``each`` one against every opponent.

        Those of several teams together name them in the last line alone.
        """
        results, counted = self.figures()
        named = " ".join(team_names(self.teams))
        lines = [
            Line(who, opponent, of.sum(axis=(0, 1)), means.mean(axis=(0, 1)), named if len(self.teams) == 1 else "")
            for opponent, of, means in zip(self.opponents, results.swapaxes(0, 1), counted.swapaxes(0, 1), strict=True)
            if each
        ]
        whole = (results.sum(axis=(0, 1, 2)), counted.mean(axis=(0, 1, 2)))
        return [*lines, Line(who, ALL, *whole, named, elo, half_width)]

    @property
    def opponents(self) -> list[str]:
        """Names of the opponents: those of their policies."""
        return [" + ".join(self.env.fixed_policies[k] for k in team) for team in self.reference.teams]


def sight(epoch: int, played: Played) -> Sight:
    """Returns what was seen in the games of teams that were drawn, and of one more: the best member's, the last.

    The best team of them all is chosen by one half of the games and rated by the other, so that it is not the luckiest.
    """
    whole = np.ones(played.fixture.shape[1:], dtype=np.bool_)
    chosen, best = played.part(slice(0, -1), whole), played.part(slice(-1, None), whole)
    expected, width = chosen.expected_elo()
    alone = best.rated()
    half = halves(*whole.shape)
    top = int(np.argmax(played.part(slice(None), half).rated().elos))
    team = played.part(slice(top, top + 1), ~half)
    fresh = team.rated()
    return Sight(
        epoch,
        [
            *chosen.lines(CHOICE, each=True, elo=expected, half_width=width),
            *best.lines(BEST_MEMBER, each=True, elo=float(alone.elos[0]), half_width=float(alone.half_widths[0])),
            *team.lines(BEST_TEAM, each=False, elo=float(fresh.elos[0]), half_width=float(fresh.half_widths[0])),
        ],
    )


def halves(opponents: int, each: int) -> Bools:
    """Returns (J, G) one half of the games: as many of every opponent as the other has, all sides in turn.

    Args:
        opponents: J.
        each: G games against each, an even number, the sides held in turn.
    """
    return (np.arange(opponents)[:, np.newaxis] + np.arange(each)) % 2 == 0
