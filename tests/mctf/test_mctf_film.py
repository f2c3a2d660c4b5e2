"""A film is the game that was played, and its events are those that the game counted."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from mctf.film import ARRAYS, Event, called, film_of_policies, filmed, said
from mctf.kernel import BLUE_WON, RUNNING, TIME_OUT
from mctf.play import play_scripted
from mctf.recording import read
from mctf.rules import make_rules
from mctf.scripted import NAMES
from mctf.start import reset
from mctf.state import (
    CAPTURED,
    GRABBED,
    HIT_WALL,
    LOST_BY_TAG,
    LOST_BY_WALL,
    TAGGED,
    UNTAGGED,
    empty,
)
from tests.mctf.films import DUEL, film_of

TRACES = Path(__file__).parent.parent / "traces"
ONCE_A_STEP = {
    "lost_by_wall": LOST_BY_WALL,
    "grab": GRABBED,
    "tag": TAGGED,
    "lost_by_tag": LOST_BY_TAG,
    "capture": CAPTURED,
    "untag": UNTAGGED,
}
STOP = 16


@pytest.mark.parametrize(
    ("names", "rules"),
    [
        (DUEL, {}),
        (("random",) * 4, {"max_time_s": 200.0}),
        (("attack_hard", "random", "random", "defend_medium", "attack_hard"), {"team_size": [3, 2]}),
        (DUEL, {"profile": "pyquaticus-2025-11", "max_time_s": 60.0, "max_score": 1}),
        (("random",) * 4, {"profile": "clean", "starts": "random", "max_time_s": 120.0}),
    ],
)
def test_a_film_is_the_game(names, rules):
    film = film_of(*names, seed=7, **rules)
    policies = np.array([[NAMES.index(name) for name in names]])
    state = play_scripted(policies, np.array([7], np.uint64), film.rules)
    for name in ARRAYS:
        assert len(getattr(film, name)) == state.steps[0] + 1
        np.testing.assert_array_equal(getattr(film, name)[-1], getattr(state, name)[0])
    assert film.end != RUNNING
    told = Counter((event.kind, event.vehicle) for event in film.events)
    for v in range(len(names)):
        for kind, column in ONCE_A_STEP.items():
            assert told[kind, v] == state.events[0, v, column], (kind, v)
        assert (told["wall", v] > 0) == (state.events[0, v, HIT_WALL] > 0)
    assert [event.frame for event in film.events] == sorted(event.frame for event in film.events)


def test_it_begins_at_the_start():
    film = film_of(*DUEL)
    state = empty(1, film.rules)
    reset(state, 0, film.rules)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(film, name)[0], getattr(state, name)[0])
    assert film.end == BLUE_WON


def test_events_are_what_is_seen_in_the_frames():
    film = film_of(*DUEL)
    kinds = {event.kind for event in film.events}
    assert {"tag", "grab", "lost_by_tag", "untag", "capture"} <= kinds
    for frame, kind, v, other in film.events:
        if kind == "grab":
            assert not film.has_flag[frame - 1, v]
            assert film.has_flag[frame, v]
        if kind == "tag":
            assert film.is_tagged[frame, other]
            assert film.cooldown[frame, v] == 0.0
            assert np.linalg.norm(film.pos[frame, v] - film.pos[frame, other]) < film.rules.catch_radius_m
        if kind == "lost_by_tag":
            assert Event(frame, "tag", other, v) in film.events
            assert film.has_flag[frame - 1, v]
        if kind == "untag":
            assert film.is_tagged[frame - 1, v]
        if kind == "capture":
            assert film.score[frame, 0, 0] - film.score[frame - 1, 0, 0] == 1


def test_recorded_actions_give_the_recorded_game():
    """The recordings were made by the original simulator."""
    recording = read(TRACES / "scripted_2v2.npz")
    for episode in range(2):
        recorded = recording.of(episode)
        film = filmed(recorded["action"][:-1], recording.rules[episode])
        np.testing.assert_array_equal(film.score, recorded["score"])
        np.testing.assert_array_equal(film.is_tagged, recorded["is_tagged"])
        np.testing.assert_allclose(film.pos, recorded["pos"], atol=1e-4)


def test_leaving_the_field_tags_where_the_rules_say_so():
    rules = make_rules(profile="pyquaticus-2025-11", team_size=1, max_time_s=90.0)
    left, straight = 6, 4
    turning = filmed([[left, STOP]] * 300, rules)
    north = int(np.argmax(np.abs(turning.heading[:, 0]) < 10.0))
    assert turning.events == ()
    film = filmed([[left, STOP]] * north + [[straight, STOP]] * 500, rules)
    assert [(event.kind, event.vehicle) for event in film.events[:2]] == [("wall", 0), ("wall_tag", 0)]
    assert film.is_tagged[film.events[1].frame, 0]
    assert "tag" not in {event.kind for event in film.events}


def test_a_drawn_start_comes_from_the_seed():
    rules = make_rules(starts="random")
    none = np.zeros((0, 4), int)
    one, same, other = (filmed(none, rules, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.pos, same.pos)
    assert not np.array_equal(one.pos, other.pos)
    assert one.pos.shape == (1, 4, 2)
    assert one.end == RUNNING


def test_words():
    rules = make_rules(team_size=[3, 2])
    assert [called(v, rules) for v in range(5)] == ["blue 0", "blue 1", "blue 2", "red 0", "red 1"]
    assert said(Event(1, "tag", 4, 2), rules) == "red 1 tags blue 2"
    assert said(Event(1, "lost_by_tag", 2, 4), rules) == "blue 2 loses the flag to red 1"
    assert said(Event(9, "capture", 0, -1), rules) == "blue 0 captures the flag"


def test_wrong_actions():
    rules = make_rules(max_time_s=3.0)
    assert filmed(np.full((3, 4), STOP), rules).end == TIME_OUT
    for actions, message in (
        (np.full((4, 4), STOP), r"actions has 4 rows, but the game is over after 3 steps"),
        (np.full((3, 3), STOP), r"shape \(steps, 4\), but has \(3, 3\)"),
        (np.full((3, 4), 0.5), "whole numbers.*float64"),
        (np.full((3, 4), 62), r"-2\.\.61, but is 62\.\.62"),
        (np.full((3, 4), -3), r"-2\.\.61, but is -3\.\.-3"),
    ):
        with pytest.raises(ValueError, match=message):
            filmed(actions, rules)
    with pytest.raises(ValueError, match="policies must be 4, one for each vehicle, but are 3"):
        film_of_policies([0, 1, 2], rules)
    with pytest.raises(ValueError, match=r"policies must be 0\.\.\d+, but are \[0, 1, 2, -1\]"):
        film_of_policies([0, 1, 2, -1], rules)
