import numpy as np
import pytest
from hypothesis import given

from berteam_cli.rating.elo import nats, points, softmax
from tests.strategies import floats


def test_ten_times_the_odds_are_400_points():
    assert points(np.log(10.0)) - points(0.0) == pytest.approx(400)
    assert points(0.0) == 1000


@given(floats(5))
def test_nats_undoes_points(strengths):
    np.testing.assert_allclose(nats(points(strengths)), strengths, atol=1e-12)


def test_softmax_by_hand():
    np.testing.assert_allclose(softmax(np.log([1.0, 3.0])), [0.25, 0.75])
    np.testing.assert_allclose(softmax(np.array([1e4, 0.0])), [1, 0])
