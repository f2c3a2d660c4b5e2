import numpy as np
import pytest

from berteam_cli.selector.embeddings import Embedding, cosines, groups, mean_cosine, nearest
from berteam_cli.selector.mcaa import Mcaa
from tests.selector.test_berteam import made


def test_cosines_by_hand():
    found = cosines(np.array([[2.0, 0.0], [0.0, 0.5], [-3.0, 0.0], [1.0, 1.0]]))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(found, [[1, 0, -1, half], [0, 1, 0, half], [-1, 0, 1, -half], [half, half, -half, 1]])


def test_mean_over_pairs_by_hand():
    similarity = np.array([[1.0, 0.5, 0.1], [0.5, 1.0, -0.3], [0.1, -0.3, 1.0]])
    assert mean_cosine(similarity, np.array([True, True, True])) == pytest.approx(0.1)
    assert mean_cosine(similarity, np.array([True, False, True])) == pytest.approx(0.1)
    assert mean_cosine(similarity, np.array([False, True, True])) == pytest.approx(-0.3)
    assert np.isnan(mean_cosine(similarity, np.array([False, True, False])))


def test_all_are_as_alike_as_a_random_subset():
    rng = np.random.default_rng(0)
    similarity = cosines(rng.normal(size=(9, 4)) + 0.5)
    drawn = [np.isin(np.arange(9), rng.choice(9, 4, replace=False)) for _ in range(4000)]
    mean = np.mean([mean_cosine(similarity, subset) for subset in drawn])
    assert mean == pytest.approx(mean_cosine(similarity, np.ones(9, dtype=bool)), abs=0.01)


def test_nearest_by_hand():
    similarity = np.array([[1.0, 0.5, 0.1], [0.5, 1.0, -0.3], [0.1, -0.3, 1.0]])
    np.testing.assert_array_equal(nearest(similarity, 2), [[1, 2], [0, 2], [0, 1]])
    np.testing.assert_array_equal(nearest(similarity, 1), [[1], [0], [0]])
    assert nearest(similarity, 5).shape == (3, 2)
    assert nearest(np.ones((1, 1)), 5).shape == (1, 0)
    twins = cosines(np.array([[1.0, 2.0], [2.0, 4.0], [1.0, 0.0]]))  # a twin is as near as oneself
    np.testing.assert_array_equal(nearest(twins, 1)[:, 0], [1, 0, 0])


def test_groups_by_hand():
    found = groups(list("aabb"), ["ppo"] * 4, np.array([1.0, 2.0, 3.0, 6.0]), np.array([2.0, 0.5, np.nan, 1.5]))
    assert {name: np.flatnonzero(members).tolist() for name, members in found.items()} == {
        "all": [0, 1, 2, 3],
        "island a": [0, 1],
        "island b": [2, 3],
        "aggressive": [0, 3],
        "defensive": [1],
        "strong": [3],  # the mean is 3
        "weak": [0, 1],
        "strong aggressive": [3],
        "weak aggressive": [0],
        "weak defensive": [1],
    }


def test_berteam_has_a_vector_for_each_member_and_mcaa_none():
    selector = made(members=5, width=8)
    state = selector.init(np.random.default_rng(0))
    vectors = selector.embeddings(state)
    assert vectors.shape == (5, 8)
    np.testing.assert_array_equal(vectors, state.learnt[0].weights["writer.tokens.weight"][:5].numpy())
    assert isinstance(selector, Embedding)
    assert not isinstance(Mcaa(selector.field, 0.01, 1), Embedding)
