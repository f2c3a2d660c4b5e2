import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from berteam_cli.arithmetic import exp, multiply, multiply_row, tanh

sizes = st.integers(1, 70)


def normal(rng, *shape):
    return rng.standard_normal(shape, dtype=np.float32)


@given(sizes, sizes, sizes, st.booleans())
def test_products_of_every_shape_and_layout(m, n, k, turned):
    rng = np.random.default_rng(m * 10_000 + n * 100 + k)
    a, b, start, c = normal(rng, m, k), normal(rng, k, n), normal(rng, n), np.full((m, n), np.nan, np.float32)
    multiply(np.ascontiguousarray(a.T).T if turned else a, b, start, c)
    np.testing.assert_allclose(c, start + a.astype(np.float64) @ b, atol=3e-5)


@given(sizes, sizes, sizes)
def test_a_row_is_the_same_to_the_bit_alone_and_among_others(m, n, k):
    rng = np.random.default_rng(m * 10_000 + n * 100 + k)
    a, b, start, c, row = normal(rng, m, k), normal(rng, k, n), normal(rng, n), *np.zeros((2, m, n), np.float32)
    multiply(a, b, start, c)
    for i in range(m):
        multiply(a[i : i + 1], b, start, row[i : i + 1])
    np.testing.assert_array_equal(c, row)


@given(sizes, sizes, st.integers(0, 5))
def test_a_row_by_places_touches_only_its_own(k, n, before):
    rng = np.random.default_rng(k * 100 + n)
    a, b, c = normal(rng, before + k), normal(rng, before + k * n + n), np.full(before + n + 3, 7, np.float32)
    multiply_row(a, before, b, before, before + k * n, c, before, k, n)
    matrix, start = b[before : before + k * n].reshape(k, n), b[before + k * n :]
    np.testing.assert_allclose(c[before : before + n], start + a[before:] @ matrix, atol=3e-5)
    assert (c[:before] == 7).all()
    assert (c[before + n :] == 7).all()


@pytest.mark.parametrize(("ours", "theirs"), [(tanh, np.tanh), (exp, np.exp)])
def test_functions_of_one_number(ours, theirs):
    x = np.concatenate([np.linspace(-86, 86, 100_001), np.linspace(-1, 1, 10_001), [0.0]]).astype(np.float32)
    y = x.copy()
    ours(y, 5, len(y) - 5)
    np.testing.assert_allclose(y[5:], theirs(x[5:].astype(np.float64)), rtol=4e-7, atol=1e-37)
    np.testing.assert_array_equal(y[:5], x[:5])


def test_beyond_the_range_they_stay_finite():
    far = np.array([-1e30, -100, 100, 1e30], np.float32)
    tanh(ends := far.copy(), 0, 4)
    np.testing.assert_allclose(ends, [-1, -1, 1, 1], atol=3e-7)
    exp(ends := far.copy(), 0, 4)
    np.testing.assert_allclose(ends, np.exp([-87.0, -87, 88, 88]), rtol=1e-6)
