"""How strong the teams of a population truly are: games against the teams of fixed policies, whose Elos are held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies, joined
from berteam_cli.evaluation.reference import Reference
from berteam_cli.games import Games, as_side_0, both_sides
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.rating.bradley_terry import Z_95, held_ratings
from berteam_cli.rating.elo import points
from berteam_cli.selector.base import TeamDistribution


@dataclass(frozen=True)
class Truth:
    """Elos of K teams.

    Attributes:
        teams: (K, T) members in ascending order.
        probability: (K,) of the selector to choose them.
        listed: (K,) whether a team is among the most probable ones; the others are a random sample of the rest.
        elos: (K,).
        half_widths: (K,) of their 95 % intervals.
        wins, draws, losses: (K,) games.
        steps: of all games.
    """

    teams: Ints
    probability: Floats
    listed: np.ndarray
    elos: Floats
    half_widths: Floats
    wins: Ints
    draws: Ints
    losses: Ints
    steps: int

    def expected_elo(self) -> tuple[float, float]:
        """Returns the Elo of a team that the selector chooses, and its 95 % half width.

        Sum of P(team) Elo(team) over unordered teams. Where the rest is a sample, its mean, weighted by probability,
        stands for all of it, and its scatter is in the width.
        """
        if not self.probability[self.listed].sum() > 0 and not (~self.listed).any():
            return float("nan"), float("nan")
        weights = self.probability.copy()
        spread = np.zeros(len(weights))
        rest = ~self.listed
        if rest.any() and self.probability[rest].sum() > 0:
            left = max(0.0, 1.0 - float(self.probability[self.listed].sum()))
            share = self.probability[rest] / self.probability[rest].sum()
            weights[rest] = left * share
            spread[rest] = weights[rest] * (self.elos[rest] - share @ self.elos[rest])
        else:
            weights /= weights.sum()
        variance = (spread**2).sum() + ((weights * self.half_widths / Z_95) ** 2).sum()
        return float(weights @ self.elos), float(Z_95 * np.sqrt(variance))

    def predicted_elos(self) -> Floats:
        """Returns (K,) the Elos that the selector's probabilities speak of: 1000 + 400 log10 of P over its mean.

        The mean is geometric; a team that is never chosen has minus infinity, and no part in the mean.
        """
        with np.errstate(divide="ignore"):
            logs = np.log(self.probability)
        finite = np.isfinite(logs)
        return points(logs - logs[finite].mean()) if finite.any() else np.full(len(logs), np.nan)


def choose_teams(
    distribution: TeamDistribution, games_per_team: int, games: int, rng: Generator
) -> tuple[Ints, Floats, np.ndarray]:
    """Returns the teams to rate, their probabilities, and which are there for being probable.

    All teams if ``games`` suffice for them; else half of those they suffice for are the most probable ones and the
    others are drawn, each alike, from the rest.
    """
    afforded = games // games_per_team
    everyone = len(distribution.teams)
    by_chance = np.argsort(-distribution.probability, kind="stable")
    if afforded >= everyone:
        chosen, likely = np.arange(everyone), everyone
    else:
        likely = -(-afforded // 2)
        others = rng.choice(by_chance[likely:], size=afforded - likely, replace=False)
        chosen = np.concatenate([by_chance[:likely], np.sort(others)])
    return distribution.teams[chosen], distribution.probability[chosen], np.arange(len(chosen)) < likely


def truth(
    games: Games,
    members: Policies,
    chosen: tuple[Ints, Floats, np.ndarray],
    reference: Reference,
    games_per_pair: int,
    rng: Generator,
) -> Truth:
    """Returns the Elos of the ``chosen`` teams.

    Every team plays every team of ``reference``, one game after the other from either side, the members of both in
    random order.

    Args:
        games: the game and its threads.
        members: how the members act in evaluation.
        chosen: as of ``choose_teams``.
        reference: the opponents and their Elos.
        games_per_pair: games against each of them.
        rng: orders the members and seeds the games.
    """
    teams, probability, listed = chosen
    acting = joined([members, fixed_policies(range(len(games.env.fixed_policies)))])
    anchors = len(reference.teams)
    ours = np.repeat(teams, anchors * games_per_pair, axis=0)
    theirs = np.tile(np.repeat(reference.teams + len(members.kind), games_per_pair, axis=0), (len(teams), 1))
    lineups = both_sides(rng.permuted(ours, axis=1), rng.permuted(theirs, axis=1))
    outcomes, _ = games.play(acting, lineups, int(rng.integers(2**63)))
    scores = as_side_0(outcomes).scores[:, 0].reshape(len(teams), anchors, games_per_pair)
    elos, half_widths = held_ratings(scores.sum(axis=2), np.full(scores.shape[:2], games_per_pair), reference.elos)
    counts = [(scores == result).sum(axis=(1, 2)) for result in (1.0, 0.5, 0.0)]
    return Truth(teams, probability, listed, elos, half_widths, *counts, int(outcomes.steps.sum()))
