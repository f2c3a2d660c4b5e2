"""Motion: actions, controllers, walls and the keep-out circle, one or a few sub-steps by hand."""

import math

import numpy as np
import pytest

from mctf.state import HIT_WALL, LOST_BY_WALL, TAGS

AHEAD, AHEAD_SLOW, RIGHT, LEFT, STOP = 4, 12, 2, 6, 16


@pytest.mark.parametrize("action", range(17))
def test_actions(scene, action):
    game = scene(substeps=1)
    game.put(0, 120.0, 50.0, heading=0.0)
    game.step(action, STOP, STOP, STOP)
    speed = 0.0 if action == 16 else 1.5 if action < 8 else 0.75
    turn = 0.0 if action == 16 else (180, 135, 90, 45, 0, -45, -90, -135)[action % 8]
    assert game.thrust[0] == 20.0 * speed
    assert game.heading_error_prev[0] == turn


def test_minus_one_is_stop(scene):
    missing, stop = scene(), scene()
    for game, action in ((missing, -1), (stop, STOP)):
        game.put(0, 120.0, 50.0, speed=1.2, thrust=24.0)
        game.step(action, STOP, STOP, STOP, times=3)
    for mine, theirs in zip(missing.state, stop.state, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_first_substep_ahead(scene):
    # thrust 20 * 1.5 = 30 holds 1.5 m/s; that is more than 1 m/s² away, so 0.1 m/s is added, not taken
    game = scene(substeps=1)
    game.put(0, 120.0, 50.0, heading=90.0)
    game.step(AHEAD, STOP, STOP, STOP)
    assert game.thrust[0] == 30.0
    assert game.pos[0] == pytest.approx([120.0 + (0.0 + 1.6) / 2 * 0.1, 50.0], abs=1e-8)
    assert game.speed[0] == 1.5  # clipped, but it moved with 1.6
    assert not game.speed_is_f32[0]


def test_acceleration_is_limited_without_the_switch(scene):
    game = scene(substeps=1, accel_rule="limit")
    game.put(0, 120.0, 50.0, heading=90.0)
    game.step(AHEAD, STOP, STOP, STOP)
    assert game.speed[0] == pytest.approx(0.1)
    game.put(0, 120.0, 50.0, speed=1.5, thrust=30.0)
    game.step(STOP, STOP, STOP, STOP)
    assert game.speed[0] == pytest.approx(1.4)


@pytest.mark.parametrize(("subtracts", "speed"), [(True, 1.5), (False, 2.0 * (1.0 - 0.85 * 0.315))])
def test_turn_loss(scene, subtracts, speed):
    # rudder 0.35 * 90 = 31.5; thrust 40 holds 2 m/s: minus 0.26775 is still above the maximum
    game = scene(substeps=1, turn_loss_rule="subtract" if subtracts else "multiply")
    game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=40.0, heading_error_prev=90.0)
    assert game.step(RIGHT, STOP, STOP, STOP).speed[0] == pytest.approx(speed, abs=1e-7)


def test_braking_overshoots_too(scene):
    # rudder 94.5, thrust 20 holds 1 m/s: 1 - 0.85 * 0.945 is more than 1 m/s² away from 0.75, so 0.1 lower still
    game = scene(substeps=1)
    game.put(0, 120.0, 50.0, heading=0.0, speed=0.75, thrust=20.0)
    assert game.step(10, STOP, STOP, STOP).speed[0] == pytest.approx(1.0 - 0.85 * 0.945 - 0.1, abs=1e-7)


def test_turn_rate_and_derivative_kick(scene):
    # rudder 31.5 without, 94.5 with the kick; at thrust 30: 31.5 * 0.7 * 0.1 * 30 / 50 deg
    for memory, rudder in ((90.0, 31.5), (0.0, 94.5)):
        game = scene(substeps=1)
        game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=30.0, heading_error_prev=memory)
        game.step(RIGHT, STOP, STOP, STOP)
        assert game.heading[0] == pytest.approx(rudder * 0.7 * 0.1 * 30 / 50, abs=1e-5)


def test_the_command_goes_on_turning(scene):
    game = scene(substeps=10)
    game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=30.0, heading_error_prev=45.0)
    game.step(3, STOP, STOP, STOP, times=12)
    assert game.heading[0] > 60.0  # beyond the 45 deg of the action: it is an error, not a target


@pytest.mark.parametrize(("thrust", "turn"), [(13.0, -31.5 * 0.07 * 2 / 50), (17.0, 31.5 * 0.07 * 2 / 50)])
def test_negative_thrust_turns_the_other_way(scene, thrust, turn):
    # thrust - 20 * 0.75 is -2 or 2; new speed about -0.4 m/s, so the average is just above 0.5 m/s
    game = scene(substeps=1)
    game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=thrust, heading_error_prev=90.0)
    assert game.step(10, STOP, STOP, STOP).heading[0] == pytest.approx(turn)


@pytest.mark.parametrize(("speed", "thrust", "turns"), [(0.5, 6.08, False), (0.58, 9.68, True)])
def test_no_turn_below_half_a_metre_per_second(scene, speed, thrust, turns):
    # rudder 0.35 * 45 = 15.75 costs 0.134 m/s; thrusts 11.08 and 13.08 then hold 0.42 and 0.52 m/s
    game = scene(substeps=1)
    game.put(0, 120.0, 50.0, heading=0.0, speed=speed, thrust=thrust, heading_error_prev=45.0)
    game.step(11, STOP, STOP, STOP)
    assert game.speed[0] == pytest.approx(0.52 if turns else 0.42, abs=1e-3)
    assert (abs(game.heading[0]) > 0.1) == turns


def test_thrust_accumulates_and_is_clipped(scene):
    game = scene(substeps=1)
    game.put(0, 120.0, 50.0, heading=0.0, speed=0.5, thrust=65.0)
    assert game.step(AHEAD, STOP, STOP, STOP).thrust[0] == 70.0
    game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=-60.0)
    assert game.step(STOP, STOP, STOP, STOP).thrust[0] == -70.0


@pytest.mark.parametrize("counts", [True, False])
def test_wall_hit(scene, counts):
    game = scene(substeps=1, oob_counts_as_tag=counts)
    game.put(2, 1.9, 40.0, came_from=(2.05, 40.0), heading=-90.0, speed=1.5, thrust=30.0)
    game.give_flag(2)
    game.step(STOP, STOP, AHEAD, STOP)
    assert game.pos[2].tolist() == game.prev_pos[2].tolist() == [2.05, 40.0]
    assert game.heading[2] == 90.0
    assert game.speed[2] == game.thrust[2] == 0.0
    assert game.oob.tolist() == [False, False, True, False]
    assert game.score[:, TAGS].tolist() == [int(counts), 0]
    assert not game.is_tagged.any()
    assert not game.has_flag[2]
    assert not game.flag_taken[0]
    assert not game.pickup[1]
    assert game.flag_pos[0].tolist() == [175.0, 50.0]
    assert game.events[2, HIT_WALL] == game.events[2, LOST_BY_WALL] == 1


@pytest.mark.parametrize(("x", "y"), [(2.0, 40.0), (198.0, 40.0), (40.0, 2.0), (40.0, 98.0)])
def test_the_margin_itself_is_in_bounds(scene, x, y):
    game = scene(substeps=1)
    game.put(0, x, y)
    assert not game.step().oob[0]
    outwards = 1e-6 * np.sign([x - 100.0, y - 50.0]) * [x in (2.0, 198.0), y in (2.0, 98.0)]
    game.put(0, *(np.array([x, y]) + outwards))
    assert game.step().oob[0]


def test_a_wall_hit_is_seen_in_the_last_substep_only(scene):
    game = scene(substeps=10)
    game.put(2, 1.9, 40.0, came_from=(2.05, 40.0), heading=-90.0, speed=1.5, thrust=30.0)
    game.step()
    assert not game.oob.any()
    assert game.events[2, HIT_WALL] == 1


def test_kept_out_of_the_own_circle(scene):
    game = scene(substeps=1)
    game.put(0, 179.0, 51.0, came_from=(179.2, 51.0), heading=-90.0, speed=1.5, thrust=30.0)
    game.step(AHEAD, STOP, STOP, STOP)
    # back along +x to the circle of 5.1 m, where the way along the circle is steep: it slides up
    exit_x = 175.0 + math.sqrt(5.1**2 - 1.0)
    assert abs(game.pos[0, 0] - exit_x) < 0.16
    assert math.dist(game.pos[0], (175.0, 50.0)) > 5.0
    assert game.prev_pos[0].tolist() == [179.0, 51.0]
    slope = math.degrees(math.atan2(1.0, math.sqrt(5.1**2 - 1.0)))
    assert game.heading[0] == pytest.approx(-slope, abs=1e-4)  # tangent, on the side of the old velocity
    assert game.speed[0] == pytest.approx(1.5 * math.sin(math.radians(slope)), abs=1e-6)


@pytest.mark.parametrize("tagged", [True, False])
def test_keepout_rests_while_the_flag_is_away(scene, tagged):
    for taken in (False, True):
        game = scene(substeps=1)
        game.put(0, 179.0, 50.5, came_from=(179.2, 50.5), heading=-90.0, is_tagged=tagged)
        if taken:
            game.give_flag(3)
        game.step()
        assert (math.dist(game.pos[0], (175.0, 50.0)) > 5.0) == (not taken)


def test_keepout_is_of_the_own_flag_only(scene):
    game = scene(substeps=1)
    game.put(2, 179.0, 50.5)
    assert game.step().pos[2].tolist() == [179.0, 50.5]


def test_a_still_vehicle_leaves_straight_away_from_the_flag(scene):
    game = scene(substeps=1)
    game.put(0, 175.0, 48.0)
    assert game.step().pos[0] == pytest.approx([175.0, 50.0 - 5.1])


@pytest.mark.parametrize("aside", [0.0, 1e-14, 1e-13, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, -1e-13, -1e-6])
@pytest.mark.parametrize("along", [0.15, -0.15])
def test_a_steep_way_into_the_circle_leads_out_of_it(scene, aside, along):
    game = scene(substeps=1)
    game.put(0, 176.0, 50.0 + 30.0 * along, came_from=(176.0 + aside, 50.0 + 31.0 * along))
    game.step()
    assert math.dist(game.pos[0], (175.0, 50.0)) == pytest.approx(5.1, abs=1e-3)
    assert (game.pos[0, 1] - 50.0) * along > 0.0


def test_even_on_top_of_the_flag_there_is_a_way_out(scene):
    game = scene(substeps=1)
    game.put(0, 175.0, 50.0)
    assert math.dist(game.step().pos[0], (175.0, 50.0)) == pytest.approx(5.1)


def test_a_tagged_vehicle_drives_home_whatever_it_is_told(scene):
    ways = []
    for action in (STOP, 0, 9):
        game = scene()
        game.put(0, 110.0, 20.0, heading=-90.0, is_tagged=True)
        ways.append(game.step(action, STOP, STOP, STOP, times=30).pos[0].copy())
    np.testing.assert_array_equal(ways[0], ways[1])
    np.testing.assert_array_equal(ways[0], ways[2])
    assert math.dist(ways[0], (175.0, 50.0)) < math.dist((110.0, 20.0), (175.0, 50.0)) - 25.0


@pytest.mark.parametrize("stale", [True, False])
def test_own_side_is_one_substep_old(scene, stale):
    game = scene(substeps=1, stale_side=stale)
    game.put(0, 100.05, 20.0, heading=-90.0, speed=1.5, thrust=30.0)
    game.step(AHEAD, STOP, STOP, STOP)
    assert game.pos[0, 0] < 100.0
    assert game.on_own_side[0] == stale


def test_the_flag_goes_with_its_carrier(scene):
    game = scene()
    game.put(0, 60.0, 20.0, heading=90.0)
    game.give_flag(0)
    game.step(AHEAD, STOP, STOP, STOP)
    assert game.flag_pos[1].tolist() == game.pos[0].tolist()


def test_single_precision_is_a_switch(scene):
    games = [scene(float32=on) for on in (True, False)]
    for game in games:
        game.put(0, 120.0, 50.0, heading=-37.0)
        game.step(5, STOP, STOP, STOP, times=3)
    assert games[0].speed_is_f32[0] or games[0].speed[0] == 1.5
    assert not games[1].speed_is_f32.any()
    assert 0.0 < np.abs(games[0].pos - games[1].pos).max() < 1e-5
