"""How strong a run's teams are and how they behave, from all their games against the teams of fixed policies."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies
from berteam_cli.env.mctf import Mctf
from berteam_cli.evaluation.manners import Manners, manners
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.truth import Chosen, Fixture, Truth, elo_samples, fixture, rated, replay_variance
from berteam_cli.games import Games, as_side_0
from berteam_cli.outcomes import Floats, Outcomes
from berteam_cli.rating.bradley_terry import Z_95
from berteam_cli.training import key


@dataclass(frozen=True)
class Strength:
    """Elos of K teams and how sure they are.

    Attributes:
        truth: the Elos; the half widths are those of a normal distribution that scatters as ``samples`` do.
        samples: (R, K) Elos after drawing the games anew.
        noise: (K,) variance of each Elo over repetitions of the same games; among more than two sides, and where pairs
            met only once, that of ``samples``, which is larger.
        manners: how the teams behaved; None in games that count no events.
    """

    truth: Truth
    samples: Floats
    noise: Floats
    manners: Manners | None


@dataclass(frozen=True)
class Match:
    """Where and against whom teams are measured.

    Attributes:
        games: the game and its threads.
        members: how the members of teams act in evaluation.
        reference: the teams of fixed policies, whose Elos are held.
    """

    games: Games
    members: Policies
    reference: Reference

    @property
    def counts_events(self) -> bool:
        """Whether the game counts what aggression is made of."""
        return isinstance(self.games.env, Mctf)

    def strength(self, chosen: Chosen, games_per_pair: int, rng: Generator, title: str, sheet: Path) -> Strength:
        """Returns how strong the ``chosen`` teams are.

        Args:
            chosen: the teams.
            games_per_pair: of each of them against each of the reference.
            rng: the only source of chance.
            title: what the games are for, as it is told.
            sheet: where what is played is kept; see ``play_all``.
        """
        ordering, playing, drawing = rng.spawn(3)
        matches = fixture(self.games, self.members, chosen.teams, self.reference, games_per_pair, ordering)
        outcomes = play_all(self.games, matches.acting, matches.lineups, key(playing), title, sheet)
        found = rated(chosen, self.reference, matches, outcomes)
        samples = elo_samples(found, self.reference, self.games.env.sides, drawing)
        behaved = self.observed(matches, outcomes) if self.counts_events else None
        noise = samples.var(axis=0)
        if self.games.env.sides == 2 and games_per_pair > 1:
            noise = replay_variance(found, self.reference)
        return Strength(replace(found, half_widths=Z_95 * samples.std(axis=0)), samples, noise, behaved)

    def of_members(self, games_per_pair: int, rng: Generator, sheet: Path) -> Manners:
        """Returns how each member behaves, as a team made only of it; the game counts events."""
        size = len(self.members.kind)
        copies = np.arange(size)[:, np.newaxis].repeat(self.games.env.team_size, axis=1)
        matches = fixture(self.games, self.members, copies, self.reference, games_per_pair, rng)
        title = f"Measuring the aggression of {size} members"
        outcomes = play_all(self.games, matches.acting, matches.lineups, key(rng), title, sheet)
        return self.observed(matches, outcomes)

    def observed(self, matches: Fixture, outcomes: Outcomes) -> Manners:
        """Returns how our teams behaved in ``matches``, of two sides."""
        _, anchors, each = matches.shape
        return manners(as_side_0(outcomes, anchors * each), matches.copies)
