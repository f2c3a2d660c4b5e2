"""Players who never met."""

import logging

import numpy as np

from berteam_cli.rating.bradley_terry import ratings
from berteam_cli.rating.groups import groups


def test_groups_by_hand():
    games = np.zeros((6, 6))
    games[0, 3] = games[3, 5] = games[1, 2] = 4  # 4 met nobody
    assert [list(group) for group in groups(games)] == [[0, 3, 5], [1, 2], [4]]
    assert [list(group) for group in groups(np.ones((3, 3)))] == [[0, 1, 2]]


def test_ratings_warn_of_them(caplog, monkeypatch):
    monkeypatch.setattr(logging.getLogger("berteam"), "propagate", True)
    games = np.zeros((4, 4))
    games[0, 1] = games[1, 0] = games[2, 3] = games[3, 2] = 10
    elos, _ = ratings(games * 0.5, games)
    assert np.isfinite(elos).all()
    assert "2 groups of players never met, so that Elos can be compared within each only: 0, 1; 2, 3." in caplog.text
    caplog.clear()
    ratings(np.full((4, 4), 5.0), np.full((4, 4), 10.0))
    assert not caplog.text
