import numpy as np
import pytest

from berteam_cli.evaluation.equilibria import (
    HIGHEST_ENTROPY,
    ONLY,
    estimated_exploitability,
    exploitability,
    fixed_point,
    nash,
    nash_conv,
    projected,
    projected_replicator,
    replicator,
    total_variation,
)

ROCK_PAPER_SCISSORS = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])
PRICED = np.array([[0.0, -1.0, 2.0], [1.0, 0.0, -1.0], [-2.0, 1.0, 0.0]])  # rock's win counts twice
EQUAL = np.full(3, 1 / 3)


def antisymmetric(size, seed):
    drawn = np.random.default_rng(seed).normal(size=(size, size))
    return drawn - drawn.T


def test_fixed_point_by_hand():
    # a beats b always, b beats a never, equals win half: D_a = a, then W_a = a/2 + (1 - a), W_b = (1 - a)/2,
    # so a = (1 - a/2) / (3/2 - a), whose root in [0, 1] is 1: b dies out.
    np.testing.assert_allclose(fixed_point(np.array([[0.5, 1.0], [0.0, 0.5]]), np.ones(2)), [1, 0], atol=1e-4)
    # With b winning a quarter: a = (3/4 - a/4) / (5/4 - a/2) / 1, a^2 / 2 - 3a/2 + 3/4 = 0, a = (3 - sqrt 3) / 2.
    root = (3 - np.sqrt(3)) / 2
    np.testing.assert_allclose(
        fixed_point(np.array([[0.5, 0.75], [0.25, 0.5]]), np.ones(2)), [root, 1 - root], atol=1e-9
    )


@pytest.mark.parametrize("seed", range(5))
def test_fixed_point_solves_its_equation(seed):
    rng = np.random.default_rng(seed)
    wins, orders = rng.random((20, 20)), rng.choice([1.0, 2.0, 6.0], 20)
    found = fixed_point(wins, orders)
    winning = orders * (wins @ found)
    np.testing.assert_allclose(found, winning / winning.sum(), atol=1e-11)
    values, vectors = np.linalg.eig(orders[:, np.newaxis] * wins)
    largest = np.abs(vectors[:, values.real.argmax()].real)
    np.testing.assert_allclose(found, largest / largest.sum(), atol=1e-9)


def test_fixed_point_over_unordered_teams_sums_that_over_ordered_ones():
    rng = np.random.default_rng(0)
    wins, team = rng.random((3, 3)), np.array([0, 1, 1, 2, 2, 2])  # teams of 1, 2 and 3 orders
    ordered = fixed_point(wins[np.ix_(team, team)], np.ones(6))
    np.testing.assert_allclose(
        fixed_point(wins, np.array([1.0, 2.0, 3.0])), np.bincount(team, weights=ordered), atol=1e-11
    )


def test_fixed_point_of_a_circle_is_its_middle():
    np.testing.assert_allclose(fixed_point((ROCK_PAPER_SCISSORS > 0).astype(float), np.ones(3)), EQUAL, atol=1e-12)


def test_without_wins_nothing_is_learnt():
    np.testing.assert_array_equal(fixed_point(np.zeros((2, 2)), np.array([1.0, 3.0])), [0.25, 0.75])
    np.testing.assert_array_equal(replicator(np.zeros((2, 2)), np.array([0.25, 0.75]), 3), [[0.25, 0.75]] * 4)


def test_replicator_by_hand():
    path = replicator(np.array([[0.5, 1.0], [0.0, 0.5]]), np.array([0.5, 0.5]), 2)
    np.testing.assert_allclose(path, [[0.5, 0.5], [0.75, 0.25], [15 / 16, 1 / 16]])  # W = 3/4, 1/4; then 5/8, 1/8
    np.testing.assert_allclose(replicator(np.array([[0.5, 1.0], [0.0, 0.5]]), path[0], 50)[-1], [1, 0], atol=1e-9)


def test_replicator_keeps_a_team_that_is_not_there_away():
    path = replicator(np.array([[0.5, 1.0], [0.0, 0.5]]), np.array([0.0, 1.0]), 5)
    np.testing.assert_array_equal(path[-1], [0, 1])


def test_nash_of_rock_paper_scissors():
    found = nash(ROCK_PAPER_SCISSORS)
    np.testing.assert_allclose(found.strategy, EQUAL, atol=1e-9)
    assert (found.value, found.which) == (0.0, ONLY)
    np.testing.assert_allclose(nash(PRICED).strategy, [0.25, 0.5, 0.25], atol=1e-9)


def test_nash_leaves_out_what_loses():
    worse = np.zeros((4, 4))
    worse[:3, :3] = ROCK_PAPER_SCISSORS
    worse[3, :3], worse[:3, 3] = -0.5, 0.5
    np.testing.assert_allclose(nash(worse).strategy, [*EQUAL, 0], atol=1e-9)


def test_nash_of_highest_entropy():
    np.testing.assert_allclose(nash(np.zeros((4, 4))).strategy, 0.25, atol=1e-6)
    # A second rock that draws the first: rock's third is shared among both.
    twice = ROCK_PAPER_SCISSORS[np.ix_([0, 1, 2, 0], [0, 1, 2, 0])]
    found = nash(twice)
    np.testing.assert_allclose(found.strategy, [1 / 6, 1 / 3, 1 / 3, 1 / 6], atol=1e-6)
    assert (found.value, found.which) == (0.0, HIGHEST_ENTROPY)
    # Three teams that never lose; the fourth loses to one of them and would gain nothing.
    unbeaten = np.zeros((4, 4))
    unbeaten[0, 3], unbeaten[3, 0] = 1.0, -1.0
    np.testing.assert_allclose(nash(unbeaten).strategy, [1 / 3, 1 / 3, 1 / 3, 0], atol=1e-6)


def test_nash_of_a_game_that_is_not_symmetric():
    found = nash(np.array([[3.0, -1.0], [-2.0, 1.0]]))  # matching pennies with prices: 3p - 2(1 - p) = -p + (1 - p)
    np.testing.assert_allclose(found.strategy, [3 / 7, 4 / 7], atol=1e-9)
    assert found.value == pytest.approx(1 / 7)
    found = nash(np.array([[2.0, 1.0, 3.0], [0.0, -1.0, 5.0]]))  # a saddle point
    np.testing.assert_allclose(found.strategy, [1, 0], atol=1e-9)
    assert found.value == pytest.approx(1.0)


@pytest.mark.parametrize("size", [2, 7, 40])
@pytest.mark.parametrize("values", ["any", "few"])
def test_nobody_exploits_a_nash_equilibrium(size, values):
    payoff = antisymmetric(size, size)
    found = nash(payoff if values == "any" else np.sign(payoff) * (np.abs(payoff) > 1))
    assert found.strategy.sum() == pytest.approx(1)
    assert (found.strategy >= 0).all()
    payoff = payoff if values == "any" else np.sign(payoff) * (np.abs(payoff) > 1)
    assert exploitability(found.strategy, payoff) < 1e-6


def test_exploitability_by_hand():
    assert exploitability(EQUAL, ROCK_PAPER_SCISSORS) == pytest.approx(0)
    assert exploitability(np.array([1.0, 0, 0]), ROCK_PAPER_SCISSORS) == 1
    assert exploitability(np.array([0.5, 0.5, 0]), ROCK_PAPER_SCISSORS) == 0.5  # paper: beats rock, draws paper
    assert exploitability(EQUAL, PRICED) == pytest.approx(1 / 3)


@pytest.mark.parametrize("seed", range(3))
def test_exploitability_is_half_of_nash_conv_where_both_players_do_the_same(seed):
    payoff, mix = antisymmetric(6, seed), np.random.default_rng(seed).dirichlet(np.ones(6))
    assert nash_conv(mix, mix, payoff) == pytest.approx(2 * exploitability(mix, payoff))


def test_estimated_exploitability_by_hand():
    one = np.array([[0.0, 0.4, 0.6], [-0.4, 0.0, 0.0], [-0.6, 0.0, 0.0]])
    other = np.array([[0.0, -0.2, -0.8], [0.2, 0.0, 0.0], [0.8, 0.0, 0.0]])
    mix = np.array([0.5, 0.5, 0.0])  # gains .2, -.2, -.3 by the one, -.1, .1, .4 by the other
    assert estimated_exploitability(mix, one, one) == exploitability(mix, one) == 0.2
    assert estimated_exploitability(mix, other, other) == exploitability(mix, other) == 0.4
    assert estimated_exploitability(mix, one, other) == 0  # it would be (-.3 - .1) / 2
    assert estimated_exploitability(np.array([0.2, 0.8, 0.0]), one, one - 0.1) == pytest.approx(0.32 - 0.05)


def measured(chances):
    """Means over 500 measurements by eight games a pair without draws, one half of them each and both together."""
    rng, size = np.random.default_rng(0), len(chances)
    mixes = np.full(size, 1 / size), np.eye(size)[0]
    halved, whole = [], []
    for _ in range(500):
        games = np.triu(np.where(rng.random((2, 4, size, size)) < chances, 1.0, -1.0), 1)
        one, other = (games - games.transpose(0, 1, 3, 2)).mean(axis=1)
        halved.append([estimated_exploitability(mix, one, other) for mix in mixes])
        whole.append([exploitability(mix, (one + other) / 2) for mix in mixes])
    return np.mean(halved, axis=0), np.mean(whole, axis=0)


def test_luck_does_not_make_equal_teams_exploitable():
    """Equal chances of all and all mass on one: what is left is the estimates below 0 that are told as 0."""
    halved, whole = measured(np.full((21, 21), 0.5))
    np.testing.assert_allclose(whole, [0.14, 0.63], atol=0.02)
    np.testing.assert_allclose(halved, [0.03, 0.15], atol=0.02)


def test_a_best_response_is_not_rated_above_what_it_gets():
    chances = np.full((21, 21), 0.5)
    chances[7], chances[:, 7] = 0.75, 0.25  # it gets a half of everybody else
    halved, whole = measured(chances)
    assert halved[0] == pytest.approx(0.5 * 20 / 21, abs=0.01)  # far above all others, so that it is always found
    # Against one team alone 19 others are as likely to look better by luck: too low, where it was too high.
    np.testing.assert_allclose([halved[1], whole[1]], [0.23, 0.71], atol=0.03)


def test_nash_conv_is_0_at_the_equilibrium_of_both_players():
    payoff = np.random.default_rng(0).normal(size=(4, 6))
    row, column = nash(payoff), nash(-payoff.T)
    assert row.value == pytest.approx(-column.value)
    assert nash_conv(row.strategy, column.strategy, payoff) == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize("payoff", [PRICED, antisymmetric(5, 1), np.array([[3.0, -1.0], [-2.0, 1.0]])])
def test_the_average_of_projected_replicator_dynamics_is_near_a_nash_equilibrium(payoff):
    row, column = projected_replicator(payoff)
    assert nash_conv(row, column, payoff) < 0.05
    assert nash_conv(*(np.full(n, 1 / n) for n in payoff.shape), payoff) > 0.2


def test_projected_replicator_dynamics_keep_exploring():
    losing = np.array([[0.0, 1.0], [-1.0, 0.0]])
    row, _ = projected_replicator(losing, exploration=0.3, steps=20_000)
    np.testing.assert_allclose(row, [0.9, 0.1], atol=2e-3)  # 0.3 / (2 + 1)


def test_projection_by_hand():
    np.testing.assert_allclose(projected(np.array([0.5, 0.7]), 0.0), [0.4, 0.6])
    np.testing.assert_allclose(projected(np.array([2.0, 0.0, -1.0]), 0.0), [1, 0, 0])
    np.testing.assert_allclose(projected(np.array([2.0, 0.0, -1.0]), 0.1), [0.8, 0.1, 0.1])
    np.testing.assert_allclose(projected(np.array([0.2, 0.3, 0.5]), 0.1), [0.2, 0.3, 0.5])


def test_total_variation():
    assert total_variation(np.array([1.0, 0.0]), np.array([0.0, 1.0])) == 1
    assert total_variation(np.array([0.5, 0.5]), np.array([0.25, 0.75])) == 0.25
