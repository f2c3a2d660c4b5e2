"""Whether teams are as strong, one beside the other, as the selector's probabilities say."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.random import Generator

from berteam_cli.evaluation.regression import line, ranks
from berteam_cli.evaluation.strength import Strength
from berteam_cli.evaluation.truth import Truth
from berteam_cli.outcomes import Floats
from berteam_cli.rating.bootstrap import Interval, interval, redrawn, with_interval

GROUPS = 10


def calibration(truth: Truth, rng: Generator) -> dict[str, Interval]:
    """Returns how far predicted ranks are from true ones, and the slope of true on predicted Elo.

    ``rank_error`` is the mean distance of the ranks as a share of the number of teams: 0 where all are right, 1/3 for
    ranks at random. ``calibration_slope`` is 1 where a team that is chosen ten times as often is 400 Elo stronger, and
    0 where it is no stronger. Intervals from drawing the teams anew (bootstrap).

    Args:
        truth: K teams whose probabilities are known.
        rng: the only source of chance.
    """
    errors = np.abs(ranks(-truth.elos) - ranks(-truth.chosen.probability)) / len(truth.elos)
    predicted = truth.predicted_elos()
    known = ~np.isnan(predicted)
    return {
        "rank_error": with_interval(errors.mean(), errors[redrawn(len(errors), rng)].mean(axis=1)),
        "calibration_slope": slope(predicted[known], truth.elos[known], rng),
    }


def slope(predicted: Floats, elos: Floats, rng: Generator) -> Interval:
    """Returns the slope of ``elos`` on ``predicted`` ones, (K,); NaN where fewer than two differ."""
    if len(elos) < 2:
        return (float("nan"),) * 3
    again = redrawn(len(elos), rng)
    value = line(predicted[np.newaxis], elos[np.newaxis])[0][0]
    return with_interval(value, line(predicted[again], elos[again])[0])


def deciles(found: Strength) -> Iterator[tuple[int, int, float, float, float, float]]:
    """Returns decile, teams, predicted and true Elo of tenths of the teams by predicted rank, the most probable first.

    Elos are means; the last two numbers are the 95 % interval of the true one, from drawing the games anew. Teams that
    are never chosen have no predicted Elo. Fewer than ten teams make so many groups.
    """
    truth = found.truth
    predicted = truth.predicted_elos()
    order = np.argsort(-truth.chosen.probability, kind="stable")
    for decile, part in enumerate(np.array_split(order, min(GROUPS, len(order))), start=1):
        known = predicted[part][~np.isnan(predicted[part])]
        low, high = interval(found.samples[:, part].mean(axis=1))
        mean = float(known.mean()) if len(known) else float("nan")
        yield decile, len(part), mean, float(truth.elos[part].mean()), float(low), float(high)
