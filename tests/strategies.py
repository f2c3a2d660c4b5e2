"""Hypothesis strategies for our own types, and small makers of them."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from berteam_cli.outcomes import EVENTS, NOBODY, Experience, Lineups, Outcomes

UNSEEN = Experience(
    np.zeros((0, 4), dtype=np.int64),
    np.zeros((0, 4, 2, 1), dtype=np.float32),
    np.zeros((0, 4, 1), dtype=np.int16),
    np.zeros((0, 4, 1), dtype=np.float32),
    np.zeros(0, dtype=np.int64),
    np.zeros(0, dtype=np.bool_),
)
"""What is known of games that nobody watched."""


def floats(size, low=-5.0, high=5.0):
    return arrays(np.float64, size, elements=st.floats(low, high, allow_nan=False))


def outcomes(teams, scores, captains=None, events=None):
    """Returns outcomes of (B, S, T) teams with (B, S) scores."""
    teams = np.asarray(teams, dtype=np.int64)
    games, sides = teams.shape[:2]
    captains = np.full((games, sides), NOBODY) if captains is None else np.asarray(captains)
    events = np.zeros((games, sides, len(EVENTS)), dtype=np.int64) if events is None else np.asarray(events)
    lineups = Lineups(teams, captains, np.zeros((games, sides)))
    return Outcomes(
        lineups, np.asarray(scores, dtype=float), np.ones(games, dtype=int), events, np.zeros(games, np.uint64)
    )


@st.composite
def played(draw, members=6, games=8, size=2, sides=2):
    """Outcomes of random games, each with different captains; the best sides share a score of 1."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    teams = rng.integers(members, size=(games, sides, size))
    captains = np.array([rng.choice(members, sides, replace=False) for _ in range(games)])
    teams[:, :, 0] = captains
    best = rng.integers(1, 2**sides, size=games)[:, np.newaxis] >> np.arange(sides) & 1
    return outcomes(teams, best / best.sum(axis=1, keepdims=True), captains)
