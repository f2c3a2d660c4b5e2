"""What a selector's choice is worth: in Elo, and beside the best team there is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator

from berteam_cli.evaluation.calibration import calibration
from berteam_cli.evaluation.strength import Match, Strength
from berteam_cli.evaluation.truth import Chosen, Truth
from berteam_cli.outcomes import Floats
from berteam_cli.rating.bootstrap import Interval, with_interval
from berteam_cli.rating.bradley_terry import Z_95
from berteam_cli.records import team_name
from berteam_cli.selector.base import TeamDistribution

UNKNOWN = (math.nan, math.nan)  # no interval


@dataclass(frozen=True)
class Replayed:
    """Two teams, measured again in other games than those they were picked by.

    Attributes:
        favourite: index of the selector's most probable team among the rated ones.
        best: index of the one rated best.
        elos: (2,) of both in the new games.
        samples: (R, 2) of both after drawing the new games anew; the same twice where it is one team.
    """

    favourite: int
    best: int
    elos: Floats
    samples: Floats


def picked(truth: Truth) -> tuple[int, int]:
    """Returns the indices of the most probable team and of the one rated best."""
    known = np.where(truth.chosen.listed, truth.chosen.probability, -np.inf)
    return int(np.argmax(known)), int(np.argmax(truth.elos))


def replayed(match: Match, truth: Truth, games_per_pair: int, rng: Generator, sheet: Path) -> Replayed:
    """Returns what the most probable and the best rated team are worth in other games: no luck is left in them.

    The best of many measured Elos is too high on average (winner's curse).

    Args:
        match: where they play.
        truth: of all teams.
        games_per_pair: of either against each team of fixed policies.
        rng: the only source of chance, another one than that of ``truth``.
        sheet: where what is played is kept; see ``play_all``.
    """
    favourite, best = picked(truth)
    pair = list(dict.fromkeys([favourite, best]))
    nobody = np.zeros(len(pair), dtype=np.int64)
    teams = Chosen(truth.chosen.teams[pair], truth.chosen.probability[pair], nobody == 0, nobody, math.nan)
    again = match.strength(teams, games_per_pair, rng, "Replaying the best teams", sheet)
    both = [0, len(pair) - 1]
    return Replayed(favourite, best, again.truth.elos[both], again.samples[:, both])


def figures(
    found: Strength, distribution: TeamDistribution, again: Replayed, rng: Generator
) -> list[tuple[str, float, float, float, str]]:
    """Returns quantity, value, the ends of its 95 % interval, and the team it is of, if it is of one.

    Args:
        found: the rated teams.
        distribution: the selector's, over teams.
        again: its most probable and the best rated team in other games.
        rng: the only source of chance.
    """
    truth = found.truth
    expected, width = truth.expected_elo()
    # Of other games than those replayed, so that the errors are independent.
    about = expected + width / Z_95 * rng.standard_normal(len(again.samples))
    rows: list[tuple[str, Interval, int | None]] = [
        ("expected_elo", (expected, expected - width, expected + width), None),
        ("effective_teams", (math.exp(distribution.entropy), *UNKNOWN), None),
    ]
    for place, (name, k) in enumerate((("chosen", again.favourite), ("best", again.best))):
        fresh = with_interval(again.elos[place], again.samples[:, place])
        rows += [
            (f"{name}_elo", with_interval(truth.elos[k], found.samples[:, k]), k),
            (f"{name}_elo_replayed", fresh, k),
        ]
    chosen, best = again.elos
    rows += [
        ("regret", with_interval(best - expected, again.samples[:, 1] - about), None),
        ("top_1_regret", with_interval(best - chosen, again.samples[:, 1] - again.samples[:, 0]), None),
    ]
    if not distribution.samples:
        rows += [(name, value, None) for name, value in calibration(truth, rng).items()]
    teams = truth.chosen.teams
    return [(name, *value, "" if k is None else team_name(teams[k])) for name, value, k in rows]
