"""Games between runs, and what they say of the algorithms that made the runs (paper, third experiment, Table 3)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies, joined
from berteam_cli.evaluation.contenders import Contender, sampled
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.seeds import drawn_seeds, improvement, iqm
from berteam_cli.games import placed
from berteam_cli.outcomes import Bools, Floats, Ints, Lineups, Outcomes
from berteam_cli.population import policies
from berteam_cli.rating.bootstrap import RESAMPLES
from berteam_cli.rating.bradley_terry import held_ratings
from berteam_cli.rating.joint import joint_ratings

SIDES = 2


@dataclass(frozen=True)
class Played:
    """What came of the games of R runs.

    Attributes:
        versus: (R, R, 3) games that row won, drew and lost against column; nothing between runs of one algorithm.
        fixed: for each run (M, J, 3), games that each sampled team won, drew and lost against each fixed team.
    """

    versus: Ints
    fixed: list[Ints]


def even_share(games: int, parts: int) -> int:
    """Returns an even number of games for each of ``parts``, so that all together are ``games`` at least."""
    return SIDES * -(-games // (SIDES * parts))


@dataclass(frozen=True)
class Plan:
    """The games of R runs: first those against J fixed teams, run by run, then those between runs.

    Attributes:
        acting: how everybody acts.
        lineups: B games.
        first: (B,) whether the run that is looked at stands on side 0.
        teams: for each run, how many teams it sampled for the fixed teams; each plays each of them twice, see
            ``for_fixed``.
        row: of the games between runs, the run that is looked at.
        column: of these games, its opponent.
    """

    acting: Policies
    lineups: Lineups
    first: Bools
    teams: list[int]
    row: Ints
    column: Ints


def planned(
    runs: list[Contender],
    of: Ints,
    reference: Reference,
    policies_there: int,
    between: int,
    against: int,
    rng: Generator,
) -> Plan:
    """Returns the games of runs of different algorithms against each other, and of all against the fixed teams.

    Between two runs both sample a team for every game. Against the fixed teams a sampled team plays all of them, so
    that the teams' own Elos are known too.

    Args:
        runs: R of them.
        of: (R,) the algorithm of each.
        reference: the fixed teams.
        policies_there: how many fixed policies these are made of.
        between: games of two algorithms, divided among the pairs of their runs.
        against: games of an algorithm against each fixed team, divided among its runs.
        rng: samples the teams and orders the members of the fixed ones.
    """
    offsets = np.cumsum([0, *(x.run.population.size for x in runs)])
    members = [policies(x.parts.optimizer.islands, x.run.population, explore=False) for x in runs]
    anchors, sizes = len(reference.teams), np.bincount(of)
    ours, theirs, first, teams = [], [], [], []
    for r, run in enumerate(runs):
        made, on_0 = for_fixed(run, even_share(against, int(sizes[of[r]])) // SIDES, rng)
        teams.append(len(made))
        ours.append(np.repeat(made + offsets[r], anchors * SIDES, axis=0))
        fixed = np.tile(np.repeat(reference.teams, SIDES, axis=0), (len(made), 1)) + offsets[-1]
        theirs.append(rng.permuted(fixed, axis=1))
        first.append(np.repeat(on_0, anchors, axis=0).ravel())
    row, column = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for i, j in combinations(range(len(runs)), 2):
        if of[i] == of[j]:
            continue
        half = even_share(between, int(sizes[of[i]] * sizes[of[j]])) // SIDES
        for side in range(SIDES):
            ours.append(sampled(runs[i], half, side, rng) + offsets[i])
            theirs.append(sampled(runs[j], half, 1 - side, rng) + offsets[j])
            first.append(np.full(half, side == 0))
            row.append(np.full(half, i))
            column.append(np.full(half, j))
    on_left = np.concatenate(first)
    lineups = placed(np.concatenate(ours), np.concatenate(theirs), np.stack([on_left, ~on_left], axis=1))
    acting = joined([*members, fixed_policies(range(policies_there))])
    return Plan(acting, lineups, on_left, teams, np.concatenate(row), np.concatenate(column))


def for_fixed(run: Contender, count: int, rng: Generator) -> tuple[Ints, Bools]:
    """Returns (M, T) teams that ``run`` samples to meet fixed ones, and (M, SIDES) in which games each is on side 0.

    A team plays once from either side; M is ``count``. A selector that tells sides apart makes as many teams for each,
    M is even, and they stand there in both games: it would field them nowhere else.
    """
    if not run.parts.selector.by_side:
        return sampled(run, count, 0, rng), np.tile([True, False], (count, 1))
    half = -(-count // SIDES)
    made = np.concatenate([sampled(run, half, side, rng) for side in range(SIDES)])
    return made, np.repeat([[True, True], [False, False]], half, axis=0)


def counted(plan: Plan, outcomes: Outcomes, anchors: int) -> Played:
    """Returns what came of a ``plan`` with so many fixed teams, counted."""
    scores = np.where(plan.first, outcomes.scores[:, 0], outcomes.scores[:, 1])
    results = np.stack([scores == 1.0, (scores > 0.0) & (scores < 1.0), scores == 0.0], axis=1).astype(np.int64)
    ends = np.cumsum([count * anchors * SIDES for count in plan.teams])
    parts = np.split(results, ends)
    fixed = [part.reshape(-1, anchors, SIDES, 3).sum(axis=2) for part in parts[:-1]]
    versus = np.zeros((len(plan.teams), len(plan.teams), 3), dtype=np.int64)
    np.add.at(versus, (plan.row, plan.column), parts[-1])
    np.add.at(versus, (plan.column, plan.row), parts[-1][:, ::-1])
    return Played(versus, fixed)


@dataclass(frozen=True)
class Figures:
    """What is known of players, runs or algorithms: point estimates, and B of each as other games might have given.

    Attributes:
        mixed: (K,) Elo of each as one player that fields sampled teams.
        mixed_samples: (B, K).
        expected: (K,) mean Elo of its sampled teams.
        expected_samples: (B, K).
        scores: (K, K) mean score of row against column; NaN where they did not meet.
        score_samples: (B, K, K).
    """

    mixed: Floats
    mixed_samples: Floats
    expected: Floats
    expected_samples: Floats
    scores: Floats
    score_samples: Floats


@dataclass(frozen=True)
class Comparison:
    """What a comparison of R runs of A algorithms says.

    Attributes:
        runs: of each run; sampled over its games.
        algorithms: of each algorithm; sampled over seeds and games.
        iqm: (A,) interquartile mean of the mixed Elos of each algorithm's runs; NaN of a single run.
        iqm_samples: (B, A).
        improvement: (A, A) probability that a run of row is above one of column.
        improvement_samples: (B, A, A); NaN where neither has several runs.
    """

    runs: Figures
    algorithms: Figures
    iqm: Floats
    iqm_samples: Floats
    improvement: Floats
    improvement_samples: Floats


def compared(played: Played, of: Ints, reference: Reference, rng: Generator) -> Comparison:
    """Returns what ``played`` says of the algorithms ``of`` (R,) the runs.

    The intervals of algorithms come from drawing anew their seeds, of each run its sampled teams with all their games
    against the fixed ones, and the games between runs. An algorithm of one run has that run's: they say nothing of
    other seeds.
    """
    anew = resampled(played, reference, rng)
    alone = np.broadcast_to(np.eye(len(of)), (1 + RESAMPLES, len(of), len(of)))
    runs = figures(anew, alone, reference.elos)
    chosen = np.concatenate([np.arange(len(of))[np.newaxis], drawn_seeds(of, RESAMPLES, rng)])
    times = (chosen[..., np.newaxis] == np.arange(len(of))).sum(axis=1)  # how often each run is there
    owned = np.arange(of.max() + 1)[:, np.newaxis] == of  # (A, R)
    algorithms = figures(anew, owned * times[:, np.newaxis], reference.elos)
    picked = np.take_along_axis(np.concatenate([runs.mixed[np.newaxis], runs.mixed_samples]), chosen, axis=1)
    groups = [picked[:, mine] for mine in owned]
    middle = np.stack([iqm(x) if x.shape[1] > 1 else np.full(len(x), np.nan) for x in groups], axis=1)
    better = np.stack([np.stack([improvement(x, y) for y in groups], axis=1) for x in groups], axis=1)
    single = owned.sum(axis=1) == 1
    better[1:, single[:, np.newaxis] & single] = np.nan
    lone = np.array([len(counts) for counts in played.fixed]) == 1
    unknown(runs, lone)
    unknown(algorithms, (owned[:, lone].sum(axis=1) == 1) & single)
    return Comparison(runs, algorithms, middle[0], middle[1:], better[0], better[1:])


def unknown(figures: Figures, lone: Bools) -> None:
    """Takes the samples from ``lone`` (K,) players, of whom one sampled team is known: others might be anything."""
    figures.mixed_samples[:, lone] = np.nan
    figures.expected_samples[:, lone] = np.nan


@dataclass(frozen=True)
class Resampled:
    """The games of R runs as they were played, and then as others might have been, B times.

    Attributes:
        versus: (1 + B, R, R, 3) games won, drawn and lost between runs.
        fixed: (1 + B, R, J, 3) against each fixed team.
        means: (1 + B, R) mean Elo of the teams that each run sampled.
    """

    versus: Floats
    fixed: Floats
    means: Floats


def resampled(played: Played, reference: Reference, rng: Generator) -> Resampled:
    """Returns the games drawn anew: those of a team that met the fixed ones together, as they are not independent."""
    upper = np.triu(np.ones(played.versus.shape[:2], dtype=bool), 1)[..., np.newaxis]
    drawn = rng.poisson(np.where(upper, played.versus, 0), size=(RESAMPLES, *played.versus.shape))
    versus = np.concatenate([played.versus[np.newaxis], drawn + drawn.transpose(0, 2, 1, 3)[..., ::-1]])
    fixed, means = [], []
    for counts in played.fixed:
        teams = len(counts)
        often = np.concatenate([np.ones((1, teams)), rng.multinomial(teams, np.full(teams, 1 / teams), RESAMPLES)])
        elos = held_ratings(points_of(counts), counts.sum(axis=-1).astype(float), reference.elos)[0]
        fixed.append(np.tensordot(often, counts, axes=1))
        means.append(often @ elos / teams)
    return Resampled(versus.astype(float), np.stack(fixed, axis=1), np.stack(means, axis=1))


def points_of(counts: Ints | Floats) -> Floats:
    """Returns the points of (..., 3) games won, drawn and lost."""
    return counts[..., 0] + np.float64(0.5) * counts[..., 1]


def figures(anew: Resampled, shares: Floats, anchors: Floats) -> Figures:
    """Returns the figures of K players made of runs.

    Args:
        anew: the games of R runs.
        shares: (1 + B, K, R) how often each run is part of each player.
        anchors: (J,) Elos of the fixed teams.
    """
    shares = shares.astype(float)
    across = shares.transpose(0, 2, 1)
    versus = np.stack([shares @ anew.versus[..., result] @ across for result in range(3)], axis=-1)
    fixed = np.stack([shares @ anew.fixed[..., result] for result in range(3)], axis=-1)
    games, points = versus.sum(axis=-1), points_of(versus)
    mixed = joint_ratings(points, games, points_of(fixed), fixed.sum(axis=-1), anchors)
    means = (shares @ anew.means[..., np.newaxis])[..., 0] / shares.sum(axis=-1)
    scores = np.divide(points, games, where=games > 0, out=np.full(games.shape, np.nan))
    return Figures(mixed[0], mixed[1:], means[0], means[1:], scores[0], scores[1:])
