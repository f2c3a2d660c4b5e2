import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from berteam_cli.outcomes import OPEN
from berteam_cli.selector.filling import drawn, filled, noise, proposal, sharpened, towards_uniform, within
from tests.selector.odds import at_places


def test_noise_by_hand():
    np.testing.assert_allclose(noise(np.array([0, 400, 800, 200]), 400.0), [1, 0.5, 0.25, 0.5**0.5])
    np.testing.assert_array_equal(noise(np.array([0, 7]), 0.0), [0, 0])


def test_towards_uniform_by_hand():
    # (1 - 1) 0.7 + 1/3, (1 - 0.5) 0.1 + 0.5/3, 0.2; their sum is 0.75.
    expected = np.array([1 / 3, 0.05 + 0.5 / 3, 0.2]) / 0.75
    np.testing.assert_allclose(towards_uniform(np.array([[0.7, 0.1, 0.2]]), np.array([1, 0.5, 0])), [expected])


def test_noise_makes_all_new_members_equally_likely_and_trusts_the_network_about_old_ones():
    odds = np.random.default_rng(0).dirichlet(np.ones(5), size=3)
    np.testing.assert_allclose(towards_uniform(odds, np.ones(5)), 0.2)
    np.testing.assert_allclose(towards_uniform(odds, np.zeros(5)), odds)


def test_drawn_columns_come_as_often_as_their_chances_say():
    chances = np.array([0.0, 3.0, 0.0, 1.0, 0.0])  # in proportion, not normalised
    columns = drawn(np.tile(chances, (40_000, 1)), np.random.default_rng(0))
    share = np.bincount(columns, minlength=5) / 40_000
    assert share[[0, 2, 4]].sum() == 0
    np.testing.assert_allclose(share, chances / 4, atol=5 * np.sqrt(0.75 * 0.25 / 40_000))


def test_extreme_draws_find_columns_with_a_chance():
    class Extreme:
        def __init__(self, value):
            self.value = value

        def random(self, shape):
            return np.full(shape, self.value)

    chances = np.array([[0.0, 0.1, 0.2, 0.7 - 1e-17, 0.0]])
    assert drawn(chances, Extreme(0.0)) == 1
    assert drawn(chances, Extreme(np.nextafter(1, 0))) == 3


@settings(deadline=None, max_examples=40)
@given(st.integers(1, 6), st.integers(1, 4), st.integers(0, 2**32 - 1), st.data())
def test_property_held_places_stay_and_open_ones_get_members(members, size, seed, data):
    rng = np.random.default_rng(seed)
    teams = rng.integers(members, size=(5, size))
    held = data.draw(st.integers(0, size))
    open_ = np.argsort(rng.random((5, size)), axis=1) >= held
    teams[open_] = OPEN
    before = teams.copy()

    @at_places
    def odds(partial, known):
        assert np.all((partial >= OPEN) & (partial < members))
        return rng.dirichlet(np.ones(members), size=partial.shape)

    full = filled(odds, teams, np.zeros(5, dtype=int), rng)
    assert np.array_equal(full[~open_], before[~open_])
    assert np.all((full >= 0) & (full < members))
    assert np.array_equal(teams, before)


def test_the_network_is_asked_once_per_place_and_never_twice_about_one_team():
    asked = []

    def odds(partial, known, places):
        assert len(np.unique(np.column_stack([known, places, partial]), axis=0)) == len(partial)
        asked.append(len(partial))
        return np.full((len(partial), 4), 0.25)

    filled(odds, np.full((1000, 3), OPEN), np.zeros(1000, dtype=int), np.random.default_rng(0))
    assert asked == [3, 2 * 3 * 4, 3 * 4 * 4]  # places, then those open beside a filled one, and so on


def test_every_order_of_filling_is_equally_likely():
    # Member k is the k-th to come, so a team tells the order it was filled in.
    @at_places
    def odds(partial, known):
        step = (partial != OPEN).sum(axis=1)
        return np.repeat(np.eye(3)[step][:, np.newaxis], 3, axis=1)

    teams = filled(odds, np.full((30_000, 3), OPEN), np.zeros(30_000, dtype=int), np.random.default_rng(1))
    orders, counts = np.unique(teams, axis=0, return_counts=True)
    assert len(orders) == 6
    np.testing.assert_allclose(counts / 30_000, 1 / 6, atol=5 * np.sqrt(5 / 36 / 30_000))


def test_noise_is_applied_to_every_place():
    @at_places
    def odds(partial, known):
        return np.broadcast_to(np.eye(4)[0], (*partial.shape, 4)).copy()

    doubt = np.array([0.5, 0.25, 0, 0])
    expected = towards_uniform(np.eye(4)[0], doubt)
    doubted = proposal(odds, doubt, np.ones((2, 4), dtype=np.bool_))
    teams = filled(doubted, np.full((20_000, 2), OPEN), np.zeros(20_000, dtype=int), np.random.default_rng(2))
    for place in range(2):
        share = np.bincount(teams[:, place], minlength=4) / 20_000
        np.testing.assert_allclose(share, expected, atol=5 * 0.5 / np.sqrt(20_000))


def test_what_is_known_of_each_team_reaches_the_network_with_it():
    @at_places
    def odds(partial, known):
        return np.repeat(np.eye(3)[known][:, np.newaxis], 2, axis=1)

    known = np.array([2, 0, 1, 2])
    teams = filled(odds, np.full((4, 2), OPEN), known, np.random.default_rng(0))
    np.testing.assert_array_equal(teams, np.repeat(known[:, np.newaxis], 2, axis=1))


def test_within_the_rules_by_hand():
    allowed = np.array([[True, False, True], [False, True, False]])
    odds = np.array([[0.2, 0.5, 0.3], [0.6, 0.0, 0.4]])
    np.testing.assert_allclose(within(odds, allowed), [[0.4, 0, 0.6], [0, 1, 0]])
    assert within(odds, np.ones((2, 3), dtype=np.bool_)) is odds


def test_sharpened_by_hand():
    odds = at_places(lambda teams, known: np.array([[[0.2, 0.4, 0.4], [0.0, 0.5, 0.5]]]))
    sharp = sharpened(odds, 2.0)
    np.testing.assert_allclose(
        sharp(np.array([[OPEN, OPEN]]), np.array([0]))[0], [[1 / 9, 4 / 9, 4 / 9], [0, 0.5, 0.5]]
    )
    assert sharpened(odds, 1.0) is odds


def test_sharpened_where_a_float_is_too_coarse():
    """0.4 ** 900 is 0 in floating point; (0.35 / 0.4) ** 900 is 6e-53."""
    odds = at_places(lambda teams, known: np.array([[[0.25, 0.35, 0.4]]]))
    sharp = sharpened(odds, 900.0)(np.array([[OPEN]]), np.array([0]))[0, 0]
    np.testing.assert_allclose(sharp, [0.625**900, 0.875**900, 1.0], rtol=1e-9)
    teams = filled(sharpened(odds, 900.0), np.full((20, 1), OPEN), np.zeros(20, np.int64), np.random.default_rng(0))
    assert (teams == 2).all()


def test_noise_comes_before_the_rules():
    doubt, allowed = np.array([1.0, 0.0, 0.0]), np.array([[True, True, False]])
    odds = proposal(at_places(lambda teams, known: np.array([[[0.0, 0.2, 0.8]]])), doubt, allowed)
    # 1/3 : 0.2 : 0.8 after the noise, of which the first two are left.
    np.testing.assert_allclose(odds(np.array([[OPEN]]), np.array([0]))[0, 0], [5 / 8, 3 / 8, 0])
