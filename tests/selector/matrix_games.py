"""Games that are played in a matrix, and runs of a selector in them."""

import numpy as np

from berteam_cli.outcomes import Outcomes
from berteam_cli.selector.listed import places_of
from rps import hands_beaten
from tests.strategies import outcomes


def played(selector, state, score, games, rng):
    """Returns the outcomes of one epoch's games; ``score`` tells (B, S) scores of (B, S, T) teams."""
    lineups = selector.select(state, games, np.zeros(selector.field.members, dtype=int), rng)
    came = outcomes(lineups.teams, score(lineups.teams, rng), lineups.captains)
    return Outcomes(lineups, came.scores, came.steps, came.events, came.seeds)


def trained(selector, score, epochs, games=16, seed=0):
    """Returns the state after so many epochs, in which the fitness of members never changes."""
    rng = np.random.default_rng(seed)
    state = selector.init(rng)
    for _ in range(epochs):
        state, _ = selector.learn(
            state, played(selector, state, score, games, rng), None, np.zeros(selector.field.members), rng
        )
    return state


def hands(teams, rng=None):
    """Returns the scores of games of rock, paper, scissors, members 0, 1 and 2."""
    beaten = np.array([[hands_beaten(a, b), hands_beaten(b, a)] for a, b in teams])
    gap = beaten[:, 1] - beaten[:, 0]
    return np.stack([(np.sign(gap) + 1) / 2, (1 - np.sign(gap)) / 2], axis=1)


def chance_game(wins, teams):
    """Returns scores that are drawn: ``wins[i, j]`` is the chance of team i of ``teams`` to win against team j."""

    def score(played, rng):
        which = places_of(played, teams)
        first = (rng.random(len(played)) < wins[which[:, 0], which[:, 1]]).astype(float)
        return np.stack([first, 1 - first], axis=1)

    return score


def by_strength(strength):
    """Returns scores of a game of any number of sides in which the largest ``strength``, of (K, T) teams, wins."""

    def score(played, rng):
        values = strength(played.reshape(-1, played.shape[2])).reshape(played.shape[:2])
        best = values == values.max(axis=1, keepdims=True)
        return best / best.sum(axis=1, keepdims=True)

    return score
