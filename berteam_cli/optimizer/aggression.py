"""Aggression, the behaviour that MAP-Elites keeps diverse (paper, appendix on MAP-Elites)."""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from berteam_cli.outcomes import Floats, Ints, Outcomes


def aggression(outcomes: Outcomes) -> Floats:
    """Returns (B,) the aggression of side 0 against all others: above 1 it attacks, below 1 it defends.

    (1 + 1.5 grabs + 2 captures + times tagged) / (1 + tags made), of the team as a whole. Hitting a wall is not being
    tagged here, whatever the rules score for it.
    """
    grabs, captures, tags = (outcomes.event(name) for name in ("grabs", "captures", "tags"))
    return (1 + 1.5 * grabs[:, 0] + 2 * captures[:, 0] + tags[:, 1:].sum(axis=1)) / (1 + tags[:, 0])


def opponents(policies: tuple[int, ...], team_size: int) -> Ints:
    """Returns (J, T) every unordered team of the fixed ``policies``."""
    return np.array(list(combinations_with_replacement(policies, team_size)), dtype=np.int64)
