"""BERTeam: a transformer that learns from winning teams which members to put together; paper, Section 3."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.random import Generator

from berteam_cli.outcomes import OPEN, Experience, Floats, Ints, Lineups
from berteam_cli.selector import beam
from berteam_cli.selector.base import TeamDistribution, exactly, most_probable, unordered_teams
from berteam_cli.selector.berteam_learning import BerteamLearning
from berteam_cli.selector.berteam_state import BerteamState
from berteam_cli.selector.captains import captains, opening
from berteam_cli.selector.chances import (
    LARGEST_SUMMED,
    ORDERS,
    estimated_log_chances,
    log_chances,
    total_distribution,
)
from berteam_cli.selector.filling import Odds, drawn, filled, noise, proposal, sharpened
from berteam_cli.selector.network import by_owner, odds_of
from berteam_cli.selector.observations import Seen


@dataclass(frozen=True, eq=False)
class Berteam(BerteamLearning):
    """How BERTeam chooses, with what it learnt; its settings are those of BerteamLearning."""

    def select(self, state: BerteamState, games: int, ages: Ints, rng: Generator) -> Lineups:
        """Returns captains by the scheme, and around each a team that the network completes, with noise.

        Args:
            state: what was learnt so far.
            games: B.
            ages: (N,) epochs since each member was last replaced.
            rng: the only source of chance.
        """
        sides = self._sides(None)
        known = np.broadcast_to(np.arange(self.field.sides) % len(sides), (games, self.field.sides))
        return self._chosen(self._odds(state, sides), known, ages, rng)

    def select_for(self, state: BerteamState, sides: Ints, ages: Ints, rng: Generator) -> Lineups:
        """Returns line-ups of one team each, (B, 1), as ``select`` makes them, for ``sides``, (B,)."""
        owners = self._sides(None)
        return self._chosen(self._odds(state, owners), (sides % len(owners))[:, np.newaxis], ages, rng)

    def answer(self, state: BerteamState, lineups: Lineups, seen: Experience, ages: Ints, rng: Generator) -> Lineups:
        """Returns a second game for each of ``lineups``: side b % S of game b chooses anew, on what its members saw.

        The captain of the new team is drawn by the scheme too.
        """
        games = np.arange(len(lineups))
        chooser = games % self.field.sides
        looked = self._seen(seen, len(lineups))[games, chooser]
        side = chooser if self.by_side else np.zeros_like(chooser)
        new = self._chosen(self._odds(state, side, looked), games[:, np.newaxis], ages, rng)
        teams, leaders = lineups.teams.copy(), lineups.captains.copy()
        chances = np.full(leaders.shape, np.nan)
        teams[games, chooser], leaders[games, chooser] = new.teams[:, 0], new.captains[:, 0]
        chances[games, chooser] = new.log_chances[:, 0]
        return Lineups(teams, leaders, chances)

    def sample(
        self,
        state: BerteamState,
        count: int,
        rng: Generator,
        side: int | None = None,
        seen: Seen | None = None,
        sharpening: float = 1.0,
    ) -> Ints:
        """Returns (count, T) teams filled from nobody, without noise.

        Args:
            state: what was learnt so far.
            count: how many.
            rng: the only source of chance.
            side: for which; None for each side in turn, side k % S for the k-th team.
            seen: (count,) what the members of each saw of the opponent; None for nothing.
            sharpening: power of the conditionals; above 1 the likelier teams come even more often.
        """
        sides = self._sides(side)
        if seen is None:
            known = np.arange(count) % len(sides)
            odds = self._odds(state, sides)
        else:
            known = np.arange(count)
            odds = self._odds(state, sides[known % len(sides)], seen)
        return filled(sharpened(self._own(odds), sharpening), self._open(count), known, rng)

    def distribution(self, state: BerteamState, side: int | None = None) -> TeamDistribution:
        """Returns the total distribution (paper, Section 5) over unordered teams; N^(T-1) grows fast.

        Args:
            state: what was learnt so far.
            side: for which; None for the mean over sides.
        """
        sides = self._sides(side)
        odds = self._own(self._odds(state, sides))
        chances = sum(
            (total_distribution(odds, self.field, k, exchangeable=self._exchangeable) for k in range(len(sides))),
            start=np.zeros(1),
        )
        teams = unordered_teams(self.field.members, self.field.team_size)
        possible = chances > 0
        return TeamDistribution(teams[possible], chances[possible] / chances.sum())  # rounding

    def likeliest(self, state: BerteamState, count: int, rng: Generator) -> TeamDistribution:
        """Returns the ``count`` most probable unordered teams; by a beam search where they cannot all be listed.

        Where sides are told apart, the search is made for each; what it finds weighs the mean over sides.
        """
        if exactly(self.field):
            return most_probable(self.distribution(state), count)
        sides = self._sides(None)
        odds = self._own(self._odds(state, sides))
        return beam.likeliest(odds, self.field, count, rng, exchangeable=self._exchangeable, sources=len(sides))

    def captains(self, state: BerteamState) -> Floats:
        """Returns (N,) the mean over places of the network's first choice, without noise (paper, Section 5)."""
        sides = self._sides(None)
        return self._own(self._odds(state, sides))(self._open(len(sides)), np.arange(len(sides))).mean(axis=(0, 1))

    def remarks(self) -> list[str]:
        """Returns what is estimated."""
        size = self.field.team_size
        if not self.weighting or size <= LARGEST_SUMMED:
            return []
        return [
            f"selector.weighting: teams of {size} can be filled in too many orders to sum over; "
            f"the chance of each is estimated from {ORDERS} random ones."
        ]

    def embeddings(self, state: BerteamState) -> Floats:
        """Returns (N, width) the token of each member; the mean over networks where each side has its own."""
        tokens = [learnt.used["writer.tokens.weight"][: self.field.members] for learnt in state.learnt]
        return torch.stack(tokens).mean(dim=0).double().cpu().numpy()

    @property
    def _exchangeable(self) -> bool:
        """Whether nothing tells the places of a team apart."""
        return self.position == "none" and self.field.alike

    def _sides(self, side: int | None) -> Ints:
        """Returns which sides are to be told apart: ``side``, or all."""
        return np.arange(self.field.sides if self.by_side else 1) if side is None else np.array([side])

    def _odds(self, state: BerteamState, sides: Ints, seen: Seen | None = None) -> Odds:
        """Returns the conditionals of the network, or of those of the sides.

        Args:
            state: what was learnt.
            sides: (U,) for which side each known thing is; 0 where sides are alike.
            seen: (U,) what the members saw; None for nothing.
        """
        if self.side != "separate":
            return odds_of(self._network, state.learnt[0].used, sides, seen)
        own = [odds_of(self._network, x.used, np.zeros_like(sides), seen) for x in state.learnt]
        return by_owner(own, sides)

    def _own(self, odds: Odds) -> Odds:
        """Returns what teams are drawn from without noise."""
        return proposal(odds, np.zeros(self.field.members), self.field.allowed)

    def _chosen(self, odds: Odds, known: Ints, ages: Ints, rng: Generator) -> Lineups:
        """Returns line-ups with (B, S') teams drawn with captains and noise; ``known``, (B, S'), as of Odds."""
        field, doubt = self.field, noise(ages, self.noise_half_life)
        sources = int(known.max()) + 1
        begun = opening(self.captain, odds(self._open(sources), np.arange(sources)), doubt, field.allowed)
        leaders = captains(self.captain, begun.sum(axis=1)[known], rng)  # (B, S')

        flat, who = known.ravel(), leaders.ravel()
        teams = self._open(len(flat))
        teams[np.arange(len(flat)), drawn(begun[flat, :, who], rng)] = who
        doubted = proposal(odds, doubt, field.allowed)
        teams = filled(doubted, teams, flat, rng)

        chances = np.full(len(teams), np.nan)
        if self.weighting and field.team_size <= LARGEST_SUMMED:
            chances = log_chances(doubted, teams, flat, begun)
        elif self.weighting:
            chances = estimated_log_chances(doubted, teams, flat, begun, rng)
        return Lineups(teams.reshape(*leaders.shape, -1), leaders, chances.reshape(leaders.shape))

    def _open(self, count: int) -> Ints:
        """Returns (count, T) teams that nobody stands in yet."""
        return np.full((count, self.field.team_size), OPEN)
