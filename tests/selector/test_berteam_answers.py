"""BERTeam where every opponent is met twice."""

import numpy as np

from berteam_cli.outcomes import Experience, Lineups
from berteam_cli.selector.observations import Looking
from tests.selector.test_berteam import made, scored

LOOKING = Looking("previous_game", 1, 0.5, 0.1, "mean", 2, 2, 1)


def watched(games, size):
    """Returns what the players of ``games`` saw: player v of game b the number 10 b + v, twice."""
    players = 2 * size
    rows = 10 * np.arange(games)[:, np.newaxis] + np.arange(players)
    rows = np.broadcast_to(rows[:, :, np.newaxis, np.newaxis], (games, players, 2, 1)).astype(np.float32)
    nothing = np.zeros((games, players, 1))
    lengths = np.ones(games, dtype=np.int64)
    return Experience(
        np.zeros((games, players), dtype=np.int64),
        rows,
        nothing.astype(np.int16),
        nothing.astype(np.float32),
        lengths,
        np.ones(games, dtype=np.bool_),
    )


def test_only_new_choices_of_second_games_are_learnt_from_with_what_was_seen_in_the_first():
    selector = made(4, 2, observations=LOOKING)
    teams = np.arange(8).reshape(4, 2, 1).repeat(2, axis=2) % 4  # games 2 and 3 answer 0 and 1
    scores = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 0.0]])
    outcomes = scored(Lineups(teams, teams[:, :, 0], np.zeros((4, 2))), scores)
    found = selector.examples(outcomes, watched(4, 2), np.ones((4, 2), dtype=np.bool_))
    # Side 0 chose anew in game 2 and won; side 1 chose anew in game 3 and lost to a team that had stayed.
    assert found.teams[:, 0].tolist() == [teams[0, 0, 0], teams[1, 1, 0], teams[2, 0, 0]]
    assert found.sides.tolist() == [0, 1, 0]
    assert found.lengths.tolist() == [[0, 0], [0, 0], [2, 2]]
    np.testing.assert_array_equal(found.rows[2, :, :, 0], [[0, 0], [1, 1]])  # players 0 and 1 of game 0


def test_the_side_that_answers_changes_in_turn_and_the_others_stay():
    selector = made(4, 2, observations=LOOKING, weighting=True)
    rng = np.random.default_rng(0)
    state = selector.init(rng)
    first = selector.select(state, 6, np.full(4, 100), rng)
    second = selector.answer(state, first, watched(6, 2), np.full(4, 100), rng)
    stays = np.arange(6)[:, np.newaxis] % 2 != np.arange(2)
    np.testing.assert_array_equal(second.teams[stays], first.teams[stays])
    np.testing.assert_array_equal(second.captains[stays], first.captains[stays])
    np.testing.assert_array_equal(np.isnan(second.log_chances), stays)
