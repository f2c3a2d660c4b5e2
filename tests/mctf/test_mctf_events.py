"""Grabs, tags, captures, untagging and ends, each in a small state worked out by hand.

Blue is 0 and 1 with its flag at (175, 50), red is 2 and 3 with its flag at (25, 50).
"""

import numpy as np
import pytest

from mctf.kernel import BLUE_WON, RED_WON, RUNNING, TIME_OUT, finished
from mctf.start import reset
from mctf.state import (
    CAPTURED,
    CAPTURES,
    EVENTS,
    GRABBED,
    GRABS,
    LOST_BY_TAG,
    STEPS_CARRYING,
    STEPS_TAGGED,
    TAGGED,
    TAGS,
    UNTAGGED,
    WAS_TAGGED,
)


@pytest.mark.parametrize(("x", "grabbed"), [(35.0, False), (34.999, True)])
def test_grab_needs_less_than_the_radius(scene, x, grabbed):
    game = scene()
    game.put(0, x, 50.0)
    game.step()
    assert game.has_flag.tolist() == [grabbed, False, False, False]
    assert game.flag_taken.tolist() == [False, grabbed]
    assert game.pickup.tolist() == [grabbed, False]
    assert game.score[0, GRABS] == game.events[0, GRABBED] == game.events[0, STEPS_CARRYING] == grabbed


def test_lowest_number_grabs_and_a_flag_that_is_away_cannot_be_grabbed(scene):
    game = scene()
    game.put(0, 33.0, 50.0)
    game.put(1, 26.0, 50.0)  # nearer
    game.step()
    assert game.has_flag.tolist() == [True, False, False, False]
    assert game.step().score[0, GRABS] == 1


def test_a_tagged_vehicle_grabs_nothing(scene):
    game = scene()
    game.put(0, 30.0, 50.0, is_tagged=True)
    assert game.step().score[0, GRABS] == 0


def test_a_tag_goes_to_the_lowest_number_not_the_nearest_or_the_carrier(scene):
    game = scene()
    game.put(0, 120.0, 20.0)
    game.put(2, 129.0, 20.0)
    game.put(3, 121.0, 20.0)
    game.give_flag(3)
    game.step()
    assert game.is_tagged.tolist() == [False, False, True, False]
    assert game.tagged_opponent.tolist() == [2, -1, -1, -1]
    assert game.has_flag[3]
    assert game.events[0, TAGGED] == game.events[2, WAS_TAGGED] == game.score[0, TAGS] == 1


def test_two_taggers_take_two_targets(scene):
    game = scene()
    for v, x in ((0, 120.0), (1, 121.0), (2, 122.0), (3, 123.0)):
        game.put(v, x, 20.0)
    assert game.step().tagged_opponent.tolist() == [2, 3, -1, -1]


@pytest.mark.parametrize("distance", [0.0, 10.0])
def test_no_tag_at_no_distance_nor_at_the_radius(scene, distance):
    game = scene()
    game.put(0, 120.0, 20.0)
    game.put(2, 120.0 + distance, 20.0)
    assert not game.step().is_tagged.any()


def test_nobody_tags_from_the_other_half_nor_while_tagged_nor_a_vehicle_on_its_own(scene):
    game = scene()
    game.put(0, 99.0, 20.0)
    game.put(2, 101.0, 20.0)
    assert not game.step().is_tagged.any()
    game.put(0, 101.0, 20.0, is_tagged=True)
    assert not game.step().is_tagged[2]


def test_on_the_line_both_are_at_home(scene):
    game = scene()
    game.put(0, 100.0, 20.0)
    game.put(2, 100.0, 21.0)
    assert not game.step().is_tagged.any()
    game.put(2, 100.5, 20.0)
    assert game.step().is_tagged.tolist() == [False, False, True, False]


def test_a_tag_sends_the_flag_home(scene):
    game = scene()
    game.put(0, 120.0, 20.0)
    game.put(2, 121.0, 20.0)
    game.give_flag(2)
    game.step()
    assert not game.has_flag.any()
    assert not game.flag_taken.any()
    assert not game.pickup.any()
    assert game.flag_pos.tolist() == [[175.0, 50.0], [25.0, 50.0]]
    assert game.events[2, LOST_BY_TAG] == 1


def test_grabbing_and_being_tagged_in_one_step(scene):
    game = scene()
    game.put(0, 170.0, 60.0)
    game.put(2, 170.0, 55.0)
    game.step()
    assert game.score[1, GRABS] == game.events[2, GRABBED] == game.events[2, LOST_BY_TAG] == 1
    assert game.is_tagged[2]
    assert not game.pickup[1]
    assert not game.flag_taken[0]


@pytest.mark.parametrize(("substeps", "steps"), [(10, 30), (4, 76)])
def test_the_next_tag_is_a_cooldown_later(scene, substeps, steps):
    game = scene(substeps=substeps)
    game.put(0, 120.0, 20.0)
    game.put(2, 121.0, 20.0)
    game.put(3, 122.0, 20.0)
    game.step()
    assert game.cooldown[0] == 0.0
    for waited in range(1, steps + 1):
        game.step()
        assert game.is_tagged[3] == (waited == steps)
        assert game.score[0, TAGS] == 1 + (waited == steps)


def test_a_capture_scores_and_ends_the_game(scene):
    game = scene()
    game.put(0, 100.0, 20.0)
    game.give_flag(0)
    game.step()
    assert game.score[:, CAPTURES].tolist() == [1, 0]
    assert game.events[0, CAPTURED] == 1
    assert game.capture.tolist() == [True, False]
    assert not game.pickup.any()
    assert game.flag_pos[1].tolist() == [25.0, 50.0]
    assert finished(game.state, 0, game.rules) == BLUE_WON
    assert not game.step().capture.any()


def test_blue_wins_when_both_come_home_together(scene):
    game = scene()
    game.put(1, 101.0, 20.0)
    game.put(2, 99.0, 80.0)
    game.give_flag(1)
    game.give_flag(2)
    assert game.step().score[:, CAPTURES].tolist() == [1, 0]
    assert finished(game.state, 0, game.rules) == BLUE_WON
    assert game.step().score[:, CAPTURES].tolist() == [1, 1]  # red a step later
    assert finished(game.state, 0, game.rules) == RED_WON


def test_both_score_without_the_switch(scene):
    game = scene(capture_first_only=False)
    game.put(1, 101.0, 20.0)
    game.put(2, 99.0, 80.0)
    game.give_flag(1)
    game.give_flag(2)
    assert game.step().score[:, CAPTURES].tolist() == [1, 1]


def test_no_capture_on_the_other_half(scene):
    game = scene()
    game.put(0, 99.9, 20.0)
    game.give_flag(0)
    assert game.step().score[0, CAPTURES] == 0


@pytest.mark.parametrize(("radius", "x", "free"), [(None, 184.9, True), (None, 189.0, False), (15.0, 189.0, True)])
def test_untagged_near_the_own_home(scene, radius, x, free):
    game = scene(untag_radius_m=radius, substeps=1)
    game.put(0, x, 50.0, is_tagged=True)
    game.step()
    assert game.is_tagged[0] != free
    assert game.events[0, UNTAGGED] == free
    assert game.events[0, STEPS_TAGGED] == (not free)


def test_untag_needs_less_than_the_radius(scene):
    def after_a_step(radius):
        game = scene(substeps=1, untag_radius_m=radius)
        game.put(0, 185.0, 50.0, is_tagged=True, heading=-90.0)
        return game.step()

    distance = after_a_step(1.0).pos[0, 0] - 175.0
    assert after_a_step(distance).is_tagged[0]
    assert not after_a_step(np.nextafter(distance, np.inf)).is_tagged[0]


@pytest.mark.parametrize(
    ("max_time", "substeps", "steps"),
    [(120.0, 1, 1201), (420.0, 10, 420), (420.0, 1, 4200), (240.0, 1, 2401), (240.0, 4, 600)],
)
def test_steps_of_a_game_by_the_sum_of_its_clock(scene, max_time, substeps, steps):
    game = scene(max_time_s=max_time, substeps=substeps)
    for played in range(1, steps + 1):
        game.step()
        assert finished(game.state, 0, game.rules) == (TIME_OUT if played == steps else RUNNING)


def test_reset_starts_afresh(scene):
    game = scene()
    game.step(0, 3, 9, 12, times=40)
    game.state.events[:] = 7
    reset(game.state, 0, game.rules)
    fresh = scene()
    reset(fresh.state, 0, fresh.rules)
    for name, mine, theirs in zip(game.state._fields, game.state, fresh.state, strict=True):
        if name != "direction":  # every step starts with its own
            np.testing.assert_array_equal(mine, theirs, err_msg=name)
    assert fresh.pos.tolist() == [[150.0, 100 / 3], [150.0, 200 / 3], [50.0, 100 / 3], [50.0, 200 / 3]]
    assert fresh.heading.tolist() == [-90.0, -90.0, 90.0, 90.0]


def test_reset_can_keep_the_heading_memory(scene):
    game = scene(pid_reset=False)
    game.step(0, 16, 16, 16)
    reset(game.state, 0, game.rules)
    assert game.heading_error_prev.tolist() == [180.0, 0.0, 0.0, 0.0]


def test_events_have_names():
    assert EVENTS[CAPTURED] == "captures"
    assert EVENTS[STEPS_TAGGED] == "steps_tagged"
