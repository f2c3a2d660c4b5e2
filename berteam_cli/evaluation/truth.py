"""How strong the teams of a population truly are: games against the teams of fixed policies, whose Elos are held."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.special import stdtrit

from berteam_cli.acting import Policies, fixed_policies, joined
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.tournament import plays_every_order, schedule
from berteam_cli.games import Games, arrangements, placed
from berteam_cli.outcomes import Bools, Floats, Ints, Lineups, Outcomes
from berteam_cli.rating.bootstrap import RESAMPLES, held_samples
from berteam_cli.rating.bradley_terry import PRIOR_DRAWS, Z_95, expected, held_ratings
from berteam_cli.rating.copies import chancy_teams, clusters
from berteam_cli.rating.counts import POINTS, Counts, counts
from berteam_cli.rating.elo import POINTS_PER_NAT, nats, points
from berteam_cli.selector.base import NEGLIGIBLE, TeamDistribution
from berteam_cli.training import key

# Probability that 100,000 draws may not find two teams of, and with which teams of Elos 1,000 points apart move a mean
# by one point at most.
SMALL = 1e-3


@dataclass(frozen=True)
class Chosen:
    """Which K teams are rated, and for what.

    Attributes:
        teams: (K, T) members in ascending order, each team once.
        probability: (K,) of the selector to choose it; NaN where that is not known.
        listed: (K,) whether a team is there for being among the most probable ones.
        draws: (K,) how often a team was drawn, by its probability, from all those that are not listed.
        listed_mass: probability of the listed teams together.
        sampled: of how many drawn teams the probabilities of the listed ones are shares; 0: they are exact.
    """

    teams: Ints
    probability: Floats
    listed: Bools
    draws: Ints
    listed_mass: float
    sampled: int = 0

    def __len__(self) -> int:
        return len(self.teams)


@dataclass(frozen=True)
class Truth:
    """Elos of K teams.

    Attributes:
        chosen: the teams.
        elos: (K,).
        half_widths: (K,) of their 95 % intervals.
        counts: of their games against each of J teams of fixed policies.
    """

    chosen: Chosen
    elos: Floats
    half_widths: Floats
    counts: Counts

    @property
    def record(self) -> Ints:
        """(3, K) games won, drawn and lost."""
        return self.counts.results.sum(axis=2)

    def expected_elo(self) -> tuple[float, float]:
        """Returns the Elo of a team that the selector chooses, and its 95 % half width.

        Sum of P(team) Elo(team) over all unordered teams. The mean of the drawn teams stands for those that are not
        listed; how they scatter is in the width, by Student's t. Where fewer than two were drawn, the listed ones stand
        for a rest below SMALL, and what it could change within the range of the Elos is in the width; what a larger
        rest leaves unknown is NaN. Where the listed ones' probabilities are shares of drawn teams, so is how those
        scatter.
        """
        chosen = self.chosen
        rest = 1.0 - chosen.listed_mass
        errors = self.half_widths / Z_95
        weights = np.where(chosen.listed, chosen.probability, 0.0)
        quantile = Z_95
        if rest > NEGLIGIBLE:
            drawn = int(chosen.draws.sum())
            if drawn < 2 and rest < SMALL:
                weights /= chosen.listed_mass
                variance = ((weights * errors) ** 2).sum() + self._of_shares(float(weights @ self.elos))
                width = quantile * np.sqrt(variance) + rest * np.ptp(self.elos)
                return float(weights @ self.elos), float(width)
            if drawn == 0:
                return math.nan, math.nan
            weights += rest * chosen.draws / drawn
            if drawn == 1:
                return float(weights @ self.elos), math.nan
            mean = chosen.draws @ self.elos / drawn
            # The teams' own errors are in it, as if each were drawn once: those of a team have one error, not several.
            scatter = chosen.draws @ (self.elos - mean) ** 2 / (drawn - 1)
            alike = (chosen.draws * (chosen.draws - 1)) @ errors**2 / (drawn - 1)
            variance = float(rest**2 * (scatter + alike) / drawn) + self._of_shares(float(mean))
            quantile = float(stdtrit(drawn - 1, 0.975))
            errors = np.where(chosen.listed, errors, 0.0)
        else:
            variance = self._of_shares(0.0)  # there is no rest whose Elo it could be
            quantile = float(stdtrit(chosen.sampled - 1, 0.975)) if chosen.sampled else Z_95
        variance += ((weights * errors) ** 2).sum()
        return float(weights @ self.elos), float(quantile * np.sqrt(variance))

    def _of_shares(self, others: float) -> float:
        """Returns the variance of the mean Elo that comes of the listed teams' shares; ``others``: Elo of the rest."""
        chosen = self.chosen
        if not chosen.sampled:
            return 0.0
        shares, rest = np.where(chosen.listed, chosen.probability, 0.0), max(1.0 - chosen.listed_mass, 0.0)
        middle = shares @ self.elos + rest * others
        return float(shares @ (self.elos - middle) ** 2 + rest * (others - middle) ** 2) / chosen.sampled

    def predicted_elos(self) -> Floats:
        """Returns (K,) the Elos that the selector's probabilities speak of: 1000 + 400 log10 of P over its mean.

        The mean is geometric, over the rated teams that are ever chosen; the others have NaN.
        """
        known = self.chosen.probability > 0
        logs = np.log(self.chosen.probability, where=known, out=np.full(len(known), np.nan))
        return points(logs - logs[known].mean()) if known.any() else logs


def choose_teams(
    distribution: TeamDistribution,
    drawn_by: Callable[[int], Ints],
    games_per_team: int,
    games: int,
) -> Chosen:
    """Returns the teams to rate.

    All teams if ``games`` suffice for them; else half of those they suffice for are the most probable ones, and the
    others are drawn by their probability from the rest.

    Args:
        distribution: over teams; where it is sampled, only the order of its listed teams is used.
        drawn_by: returns so many teams, (count, T), as the selector would make them.
        games_per_team: that one rating takes.
        games: at most.
    """
    afforded = games // games_per_team
    exact = distribution.samples == 0
    if exact and afforded >= len(distribution.teams):
        everyone = np.ones(len(distribution.teams), dtype=np.bool_)
        return Chosen(distribution.teams, distribution.probability, everyone, np.zeros(len(everyone), np.int64), 1.0)
    likely = np.argsort(-distribution.probability, kind="stable")[: -(-afforded // 2)]
    top, chances_of_top = distribution.teams[likely], distribution.probability[likely]
    if not exact:  # drawn anew: those that came often in one sample came too often
        chances_of_top = frequencies(top, drawn_by(distribution.samples))
    mass = float(chances_of_top.sum())
    others = np.zeros((0, top.shape[1]), dtype=np.int64)
    if 1.0 - mass > NEGLIGIBLE and afforded > len(likely):
        others = rest_of(top, drawn_by, afforded - len(likely))
    unique, draws = np.unique(others, axis=0, return_counts=True)
    known = {tuple(team): p for team, p in zip(distribution.teams, distribution.probability, strict=True)}
    chances = [known[tuple(team)] if exact else math.nan for team in unique]
    return Chosen(
        np.concatenate([top, unique]),
        np.concatenate([chances_of_top, chances]),
        np.arange(len(top) + len(unique)) < len(top),
        np.concatenate([np.zeros(len(top), dtype=np.int64), draws]),
        mass,
        distribution.samples,
    )


def frequencies(teams: Ints, drawn: Ints) -> Floats:
    """Returns (K,) the share of each of ``teams``, members ascending, among the ``drawn`` ones."""
    counts = Counter(map(tuple, np.sort(drawn, axis=1)))
    return np.array([counts[tuple(team)] for team in teams]) / len(drawn)


def rest_of(top: Ints, drawn_by: Callable[[int], Ints], count: int) -> Ints:
    """Returns ``count`` teams drawn by their probability from those that are not in ``top``, or fewer.

    Fewer where they are so improbable that some 100,000 draws do not find enough of them.
    """
    listed = {tuple(team) for team in top}
    found: list[tuple[int, ...]] = []
    for _ in range(50):
        drawn = np.sort(drawn_by(2000), axis=1)
        found += [team for team in map(tuple, drawn) if team not in listed]
        if len(found) >= count:
            break
    return np.array(found[:count], dtype=np.int64).reshape(-1, top.shape[1])


@dataclass(frozen=True)
class Fixture:
    """The games of K teams against J teams of fixed policies, G against each.

    Attributes:
        acting: how members and fixed policies act.
        lineups: K J G games, those of a team in a row.
        held: (K J G, S) the sides where our team stands.
        shape: (K, J, G).
        clusters: (K J G,) the first game of which each is a copy.
        settled: (K, J) whether all that can happen between the two is played.
    """

    acting: Policies
    lineups: Lineups
    held: Bools
    shape: tuple[int, int, int]
    clusters: Ints
    settled: Bools

    @property
    def copies(self) -> Ints:
        """(K, J G) how often each of a team's games is played; 0 of those that are copies of an earlier one."""
        return np.bincount(self.clusters, minlength=len(self.clusters)).reshape(self.shape[0], -1)


def fixture(
    games: Games, members: Policies, teams: Ints, reference: Reference, games_per_pair: int, rng: Generator
) -> Fixture:
    """Returns the games of all ``teams`` against all of ``reference``.

    In turn as ``games.arrangements`` says: of two sides from either, of more alone or with the other team alone. The
    members of both stand in every order in turn, or in random ones where there are more orders than games.

    Args:
        games: the game and its threads.
        members: how the members act in evaluation.
        teams: (K, T).
        reference: the opponents.
        games_per_pair: G.
        rng: orders the members.
    """
    ours, anchors = len(teams), len(reference.teams)
    everyone = np.concatenate([teams, reference.teams + len(members.kind)])
    first, second = np.divmod(np.arange(ours * anchors), anchors)
    ways = arrangements(games.env.sides)
    played = schedule(everyone, first, second + ours, games_per_pair, len(ways), rng)
    held = ways[np.arange(ours * anchors * games_per_pair) % (anchors * games_per_pair) % len(ways)]
    acting = joined([members, fixed_policies(range(games.env.standard_policies))])
    lineups = placed(*played, held)
    chance = chancy_teams(games.env, acting, everyone)
    settled = ~(chance[:ours, np.newaxis] | chance[ours:])
    settled &= plays_every_order(games.env.sides, everyone, games_per_pair)
    alike = clusters(games.env, acting, lineups.teams)
    return Fixture(acting, lineups, held, (ours, anchors, games_per_pair), alike, settled)


def rated(chosen: Chosen, reference: Reference, fixture: Fixture, outcomes: Outcomes) -> Truth:
    """Returns the Elos of the ``chosen`` teams, from the ``outcomes`` of their ``fixture`` with ``reference``.

    The half widths are those of the Fisher information, of as many games as would be as sure as these and their copies.
    """
    held, anchors, sides = fixture.held, len(reference.teams), outcomes.scores.shape[1]
    made = np.where(held, outcomes.scores, 0.0).sum(axis=1).reshape(fixture.shape)
    left = np.where(held, 0.0, outcomes.scores).sum(axis=1).reshape(fixture.shape)
    stood = held.sum(axis=1).reshape(fixture.shape)  # on so many sides
    points, played, handicaps = [], [], []
    for k in np.unique(stood):
        points.append(np.where(stood == k, made, 0.0).sum(axis=2))
        played.append((stood == k).sum(axis=2))
        handicaps.append(np.full(anchors, math.log((sides - k) / k)))
    elos, half_widths = held_ratings(
        np.concatenate(points, axis=1),
        np.concatenate(played, axis=1),
        np.tile(reference.elos, len(handicaps)),
        np.concatenate(handicaps),
    )
    kinds = np.where(left == 0.0, 0, np.where(made == 0.0, 2, 1)).ravel()
    found = counts(kinds, fixture.clusters, fixture.shape, fixture.settled)
    return Truth(chosen, elos, half_widths * np.sqrt(found.repetition), found)


def truth(
    games: Games,
    members: Policies,
    chosen: Chosen,
    reference: Reference,
    games_per_pair: int,
    rng: Generator,
) -> Truth:
    """Returns the Elos of the ``chosen`` teams; see ``fixture``, whose games ``rng`` seeds too."""
    matches = fixture(games, members, chosen.teams, reference, games_per_pair, rng)
    title = f"Rating {len(chosen):,} teams"
    return rated(chosen, reference, matches, play_all(games, matches.acting, matches.lineups, key(rng), title))


def elo_samples(found: Truth, reference: Reference, sides: int, rng: Generator) -> Floats:
    """Returns (R, K) Elos as other games of the same teams might have given them.

    By drawing the games anew; among more than two ``sides``, where a game has several kinds of draws, from the normal
    distribution of the Fisher information.
    """
    if sides == 2:
        return held_samples(found.counts, reference.elos, rng)
    return found.elos + found.half_widths / Z_95 * rng.standard_normal((RESAMPLES, len(found.elos)))


def replay_variance(found: Truth, reference: Reference) -> Floats:
    """Returns (K,) the variance of each Elo over repetitions of the same games, NaN where a pair met only once.

    From how the scores against one opponent scatter around their own mean; what is settled does not scatter. Games
    drawn anew (``elo_samples``) scatter more: they also differ in who was met how often, and where a team fares better
    against some opponents and worse against others than two Elos can say, that counts as noise.

    Args:
        found: Elos from games of two sides.
        reference: whom they met.
    """
    games, made = found.counts.results.sum(axis=0).astype(float), np.tensordot(POINTS, found.counts.results, axes=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = (POINTS[:, np.newaxis, np.newaxis] - made / games) ** 2  # (3, K, J)
        often = found.counts.different.sum(axis=(0, 3)).astype(float)
        scatter = (off * (found.counts.different @ found.counts.copies**2)).sum(axis=0) * often / (often - 1)
    scatter = np.where(found.counts.settled, 0.0, scatter)
    chances = expected(nats(found.elos)[:, np.newaxis], nats(reference.elos))
    information = (games * chances * (1 - chances)).sum(axis=1) + PRIOR_DRAWS / 4
    return (POINTS_PER_NAT / information) ** 2 * scatter.sum(axis=1)
