import numpy as np
import pytest

from berteam_cli.acting import FIXED
from berteam_cli.learner.fixed import Fixed
from berteam_cli.workers import Workers


def test_members_are_the_games_policies_and_stay_so(random_games):
    fixed = Fixed(indices=(4, 2, 2), policies_by_name=tuple("abcde"))
    state = fixed.init(3, np.random.default_rng(0))
    games = random_games([[5, 6, 9, 5], [6, 8, 8, 9]], [7, 11], [True, False])
    figures = fixed.learn(state, games, 5, np.random.default_rng(0), Workers(1))
    assert [(each.row, each.steps, each.updates) for each in figures] == [(0, 14, 0), (1, 18, 0)]
    for explore in (True, False):
        policies = fixed.policies(state, explore=explore)
        assert policies.kind.tolist() == [FIXED] * 3
        assert policies.fixed.tolist() == [4, 2, 2]


def test_a_copy_plays_as_its_parent_and_is_restored_so():
    fixed = Fixed(indices=(4, 2), policies_by_name=tuple("abcde"))
    state = fixed.init(2, np.random.default_rng(0))
    assert fixed.names(state, "island") == ["e", "c"]
    fixed.copy(state, 1, 0)
    assert fixed.names(state, "island") == ["e", "e"]
    assert fixed.policies(fixed.restored(fixed.tensors(state)), explore=False).fixed.tolist() == [4, 4]


def test_needs_one_index_for_each_member():
    with pytest.raises(ValueError, match="members must be 2"):
        Fixed(indices=(4, 2), policies_by_name=tuple("abcde")).init(3, np.random.default_rng(0))
