"""What a run learnt beside where choosing among its teams ends in theory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from berteam_cli.evaluation.equilibria import Equilibrium, fixed_point, nash, replicator
from berteam_cli.evaluation.payoffs import Payoffs, payoffs
from berteam_cli.outcomes import Floats
from berteam_cli.population import names, policies
from berteam_cli.records import team_name
from berteam_cli.selector.base import TeamDistribution
from berteam_cli.selector.independent import anybody, distribution, with_all_teams
from berteam_cli.training import Parts, Run

STEPS = 10_000  # of the replicator, after which it has settled


@dataclass(frozen=True)
class Points:
    """Mixes of a run's K teams: what it learnt, and where choosing ends in theory.

    Attributes:
        played: what came of their games.
        learned: the run's distribution.
        fixed: the fixed point of learning from weighted winners.
        replicated: the limit of learning from winners without weights.
        equilibrium: the Nash equilibrium of wins less losses.
    """

    played: Payoffs
    learned: TeamDistribution
    fixed: Floats
    replicated: Floats
    equilibrium: Equilibrium

    @property
    def mixes(self) -> dict[str, Floats]:
        """(K,) each, by name."""
        named = {"learned": self.learned.probability, "fixed_point": self.fixed, "replicator": self.replicated}
        return named | {"nash": self.equilibrium.strategy}


def why_not(parts: Parts, learned: TeamDistribution, most: int) -> str:
    """Returns why the teams of a run do not play each other, nothing if they do."""
    field = parts.selector.field
    if field.sides != 2:
        return f"Games of {field.sides} sides have no payoff matrix"
    if field.teams > most:
        return f"{field.teams:,} possible teams are more than most={most:,}"
    if learned.samples:
        return "The teams are too many for an exact distribution (selector.exact_limit)"
    return ""


def reference_points(
    run: Run, parts: Parts, learned: TeamDistribution, games_per_pair: int, rng: Generator, sheet: Path | None = None
) -> Points:
    """Returns the reference points of all teams of ``run``, after each played each; ``learned`` is exact.

    What is played is kept in ``sheet``; see ``play_all``.
    """
    field = parts.selector.field
    learned = with_all_teams(learned, field)
    acting = policies(parts.optimizer.islands, run.population, explore=False)
    played = payoffs(parts.games, acting, learned.teams, games_per_pair, rng, sheet)
    # In proportion to the orders in which the members of each team may stand.
    orders = distribution(anybody(field), field).probability
    limit = replicator(played.wins, orders / orders.sum(), STEPS)[-1]
    return Points(played, learned, fixed_point(played.wins, orders), limit, nash(played.zero_sum))


def point_rows(run: Run, parts: Parts, points: Points) -> list[tuple[Any, ...]]:
    """Returns the rows of reference_points.csv, the most probable team first."""
    called = names(parts.optimizer.islands, run.population)
    surplus = points.played.zero_sum
    against_mix = surplus @ points.learned.probability
    rows = []
    for k in np.argsort(-points.learned.probability, kind="stable"):
        team = points.learned.teams[k]
        mixes = (mix[k] for mix in points.mixes.values())
        rows.append(
            (
                *(run.epoch, team_name(team), " + ".join(called[m] for m in team), *mixes),
                *(against_mix[k], surplus[k].min(), points.played.wins[:, k].max()),
            )
        )
    return rows
