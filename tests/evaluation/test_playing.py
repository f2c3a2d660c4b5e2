"""Games in batches: kept, gone on with, and the same wherever they were cut."""

import numpy as np
import pytest

from berteam_cli.acting import fixed_policies
from berteam_cli.env.rps import Rps
from berteam_cli.evaluation import playing
from berteam_cli.evaluation.playing import play_all
from berteam_cli.evaluation.sheet import forget
from berteam_cli.games import Games, pairings
from berteam_cli.workers import Workers


@pytest.fixture(autouse=True)
def small_batches(monkeypatch):
    monkeypatch.setattr(playing, "BATCH", 16)


def hands(games=50):
    rng = np.random.default_rng(1)
    players = fixed_policies(range(len(Rps(1).fixed_policies)))
    return players, pairings(*rng.integers(len(players.kind), size=(2, games, 1)))


def counted(workers=1):
    """A game that counts how often it is played."""
    games = Games(Rps(1), Workers(workers))
    played = []
    play = games.env.play
    object.__setattr__(games.env, "play", lambda batch, *rest: (played.extend(batch), play(batch, *rest))[1])
    return games, played


def same(one, other):
    for name in ("scores", "steps", "events", "seeds"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_what_is_played_does_not_depend_on_workers_or_on_being_kept(tmp_path):
    players, lineups = hands()
    whole = play_all(counted()[0], players, lineups, 7, "Playing")
    same(whole, play_all(counted(3)[0], players, lineups, 7, "Playing", tmp_path / "sheet"))
    assert len(np.unique(whole.seeds)) == len(lineups)  # no two games share a stream


@pytest.mark.parametrize("kept", [0, 15, 16, 33, 49, 50])
def test_it_goes_on_from_the_last_whole_batch(kept, tmp_path):
    players, lineups = hands()
    whole = play_all(counted()[0], players, lineups, 7, "Playing", tmp_path / "sheet")
    file = tmp_path / "sheet.games"
    size = len(file.read_bytes()) // 50
    file.write_bytes(file.read_bytes()[: kept * size + (3 if kept < 50 else 0)])
    games, played = counted()
    same(whole, play_all(games, players, lineups, 7, "Playing", tmp_path / "sheet"))
    assert len(played) == (50 - kept // 16 * 16 if kept < 50 else 0)
    assert len(file.read_bytes()) == 50 * size


def test_other_games_are_not_taken_for_these(tmp_path):
    players, lineups = hands()
    play_all(counted()[0], players, lineups, 7, "Playing", tmp_path / "sheet")
    games, played = counted()
    again = play_all(games, players, lineups, 8, "Playing", tmp_path / "sheet")
    assert len(played) == 50
    same(again, play_all(counted()[0], players, lineups, 8, "Playing"))
    forget(tmp_path / "sheet")
    assert list(tmp_path.iterdir()) == []
