"""What it is worth to have seen an opponent: teams chosen before a first game against it, and after."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.acting import Policies, fixed_policies, joined
from berteam_cli.evaluation.reference import Reference
from berteam_cli.evaluation.sheet import Sheet, named
from berteam_cli.games import as_side_0, both_sides, in_turn
from berteam_cli.outcomes import Floats, Ints
from berteam_cli.population import policies
from berteam_cli.progress import progress
from berteam_cli.rating.bootstrap import with_interval
from berteam_cli.rating.bradley_terry import held_ratings
from berteam_cli.records import team_name
from berteam_cli.selector.observations import seen_in
from berteam_cli.training import Parts, Run, key

BATCH = 64  # an even number of encounters whose trajectories are held at once
RESAMPLES = 1000  # of the bootstrap
ROW = np.dtype([("before", "<f8"), ("after", "<f8")])  # what is kept of an encounter


@dataclass(frozen=True)
class Encounters:
    """Two games in a row against each of J opponents, several times; the opponent keeps its team.

    Attributes:
        reference: the opponents.
        before: (J, E) our score of the first game, with a team chosen on nothing.
        after: (J, E) of the second, with a team chosen on what the first one's members saw.
    """

    reference: Reference
    before: Floats
    after: Floats

    def elos(self) -> dict[str, tuple[float, float, float]]:
        """Returns the Elo of choosing before and after, and the gain, each with its 95 % interval.

        As that of a player who fields many teams. The intervals come from drawing encounters anew for each opponent
        (bootstrap), both games of one together.
        """
        return {
            "before": with_interval(self._elo(self.before), self._resampled(self.before)),
            "after": with_interval(self._elo(self.after), self._resampled(self.after)),
            "gain": with_interval(
                self._elo(self.after) - self._elo(self.before),
                self._resampled(self.after) - self._resampled(self.before),
            ),
        }

    def _elo(self, scores: Floats) -> float:
        """Returns the Elo that (J, E) ``scores`` give."""
        return float(self._elos(scores.sum(axis=1)[np.newaxis])[0])

    def _elos(self, points: Floats) -> Floats:
        """Returns (K,) Elos of (K, J) points against each opponent."""
        games = np.full(points.shape, self.before.shape[1], dtype=float)
        return held_ratings(points, games, self.reference.elos)[0]

    def _resampled(self, scores: Floats) -> Floats:
        """Returns (RESAMPLES,) Elos of encounters drawn anew; the same draws whatever the scores."""
        opponents, each = scores.shape
        drawn = np.random.default_rng(0).integers(each, size=(RESAMPLES, opponents, each))
        return self._elos(np.take_along_axis(np.broadcast_to(scores, drawn.shape), drawn, axis=2).sum(axis=2))


def encounters(
    run: Run, parts: Parts, reference: Reference, each: int, rng: Generator, sheet: Path | None = None
) -> Encounters:
    """Returns what came of ``each`` encounters with every team of ``reference``.

    Args:
        run: what the selector learnt, and its members.
        parts: of the run, whose games have two sides and whose selector answers.
        reference: teams of fixed policies.
        each: E; the sides change from one encounter to the next.
        rng: the only source of chance.
        sheet: a file without ending that keeps the scores, batch by batch, as ``play_all`` does.
    """
    env, seed = parts.games.env, key(rng)
    members = policies(parts.optimizer.islands, run.population, explore=False)
    acting = joined([members, fixed_policies(range(env.standard_policies))])
    theirs = rng.permuted(np.repeat(reference.teams + run.population.size, each, axis=0), axis=1)
    scores = np.zeros((len(theirs), 2))
    first, kept = 0, None
    if sheet is not None:
        kept = Sheet(sheet, named(parts.games, acting, [theirs], seed, BATCH), BATCH)
        first = kept.begun(scores.view(ROW)[:, 0])
    with progress("Meeting each opponent twice", 2 * len(theirs)) as tell:
        tell(2 * first)
        for start in range(first, len(theirs), BATCH):
            part = slice(start, start + BATCH)
            scores[part] = met(run, parts, acting, theirs[part], np.random.default_rng([seed, start // BATCH])).T
            if kept is not None:
                kept.add(scores[part])
            tell(2 * len(theirs[part]))
    before, after = scores.T.reshape(2, len(reference.teams), each)
    return Encounters(reference, before, after)


def met(run: Run, parts: Parts, acting: Policies, theirs: Ints, rng: Generator) -> Floats:
    """Returns (2, B) our scores of the first and the second game against each of ``theirs``, (B, T)."""
    games, count = parts.games, len(theirs)
    selector: Any = parts.selector  # one that looks at games
    ours = selector.sample(run.selection, count, rng)
    first, experience = games.play(acting, both_sides(ours, theirs, count), key(rng), record=True)
    mine = in_turn(count, count)
    seen = seen_in(experience, count, 2, selector.observations)[np.arange(count), mine]
    ours = selector.sample(run.selection, count, rng, seen=seen)
    second, _ = games.play(acting, both_sides(ours, theirs, count), key(rng))
    return np.array([as_side_0(x, count).scores[:, 0] for x in (first, second)])


def conditioning_rows(epoch: int, found: Encounters) -> dict[str, list[tuple[Any, ...]]]:
    """Returns the rows of conditioning.csv and encounters.csv after ``epoch`` epochs."""
    opponents = [team_name(team) for team in found.reference.teams]
    means = zip(opponents, found.before.mean(axis=1), found.after.mean(axis=1), strict=True)
    each = found.before.shape[1]
    return {
        "conditioning": [(epoch, choice, *elo) for choice, elo in found.elos().items()],
        "encounters": [(epoch, opponent, each, before, after) for opponent, before, after in means],
    }
