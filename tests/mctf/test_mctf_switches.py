"""Every difference between the versions of the rules, alone, in a case worked by hand."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from mctf.commands import FIELD_POINTS, MISSING
from mctf.kernel import RED_WON, RUNNING, TIED, finished, step
from mctf.observe import normalise, observation_size, observe, ranges
from mctf.play import play_scripted
from mctf.profiles import PROFILES
from mctf.rules import ACTIONS, make_rules
from mctf.start import reset
from mctf.state import HIT_WALL, TAGS, empty

AHEAD, RIGHT, SLOW_RIGHT, STOP = 4, 2, 10, 16
DOCS = Path(__file__).parents[2] / "docs" / "mctf.md"


def test_the_documents_table_is_the_profiles():
    """A row of the table: `name` | what | 2024 | 2025 | clean."""
    rows = re.findall(r"^\| `(\w+)` \|[^|]*\| *([^|]*?) *\| *([^|]*?) *\| *([^|]*?) *\|$", DOCS.read_text(), re.M)
    table = {name: values for name, *values in rows}
    assert set(table) == set(PROFILES["clean"])
    for name, values in table.items():
        assert values == [shown(profile[name]) for profile in PROFILES.values()], name


def shown(value):
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return " x ".join(f"{extent:g}" for extent in value)
    return f"{value:g}" if isinstance(value, float | int) else value


@pytest.mark.parametrize("turns_wrong", [True, False])
def test_reverse_steering(scene, turns_wrong):
    # thrust 10 + 20 (0.75 - 1.5) = -5; rudder 0.35 * 90; mean speed 0.516 is just enough to turn
    game = scene(substeps=1, reverse_steering=turns_wrong)
    game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=10.0, heading_error_prev=90.0, heading_error_known=True)
    game.step(SLOW_RIGHT, STOP, STOP, STOP)
    turn = 31.5 * 0.7 * 0.1 * 5.0 / 50.0
    assert game.thrust[0] == -5.0
    assert game.heading[0] == pytest.approx(-turn if turns_wrong else turn, abs=1e-5)


@pytest.mark.parametrize(("kicks", "rudder"), [(True, 94.5), (False, 31.5)])
def test_first_kick(scene, kicks, rudder):
    game = scene(substeps=1, first_kick=kicks)
    game.put(0, 120.0, 50.0, heading=0.0, speed=1.5, thrust=40.0)
    game.step(RIGHT, STOP, STOP, STOP)
    assert game.heading[0] == pytest.approx(rudder * 0.07 * 0.8, abs=1e-5)


@pytest.mark.parametrize(("mean", "speed"), [(True, 0.8), (False, 1.5)])
def test_speed_is_mean(scene, mean, speed):
    game = scene(substeps=1, speed_is_mean=mean)
    game.put(0, 120.0, 50.0, heading=90.0)
    game.step(AHEAD, STOP, STOP, STOP)
    assert game.speed[0] == pytest.approx(speed, abs=1e-7)
    assert game.pos[0, 0] == pytest.approx(120.08, abs=1e-7)


@pytest.mark.parametrize(("rule", "thrust"), [("fixed", 30.0), ("share", 20.0)])
def test_action_speed(scene, rule, thrust):
    game = scene(substeps=1, max_speed=1.0, action_speed=rule)
    assert game.step(AHEAD, STOP, STOP, STOP).thrust[0] == thrust


@pytest.mark.parametrize(("rule", "error"), [("heading", 33.0), ("stop", 0.0)])
def test_missing_action(scene, rule, error):
    game = scene(substeps=1, missing_action=rule)
    game.put(0, 120.0, 50.0, heading=33.0, speed=1.0, thrust=20.0)
    game.step(MISSING, STOP, STOP, STOP)
    assert game.heading_error_prev[0] == error
    assert game.thrust[0] == 0.0


@pytest.mark.parametrize(("side", "x", "heading"), [("right", 150.0, -90.0), ("left", 50.0, 90.0)])
def test_blue_side(side, x, heading):
    rules = make_rules(blue_side=side)
    state = started(rules)
    assert state.pos[0, :, 0].tolist() == [x, x, 200.0 - x, 200.0 - x]
    assert state.heading[0].tolist() == [heading, heading, -heading, -heading]
    assert state.flag_pos[0, 0].tolist() == [175.0 if side == "right" else 25.0, 50.0]
    raw = np.zeros((4, observation_size(rules)))
    observe(state, 0, rules, raw)
    assert raw[0, :4] == pytest.approx(raw[3, :4], abs=1e-4)
    assert raw[0, 7] == pytest.approx(50.0)  # wall 1 is behind the own flag


def started(rules, seed=0):
    state = empty(1, rules)
    state.stream[0] = seed
    reset(state, 0, rules)
    return state


def test_starts():
    quarter, midway = started(make_rules(team_size=3)), started(make_rules(team_size=3, starts="midway"))
    assert quarter.pos[0, :3].tolist() == [[150.0, 25.0], [150.0, 50.0], [150.0, 75.0]]
    assert midway.pos[0, :3].tolist() == [[137.5, 75.0], [137.5, 50.0], [137.5, 25.0]]
    assert midway.pos[0, 3:].tolist() == [[62.5, 75.0], [62.5, 50.0], [62.5, 25.0]]


@pytest.mark.parametrize("side", ["right", "left"])
def test_random_starts(side):
    rules = make_rules(team_size=(2, 5), starts="random", blue_side=side)
    places = np.stack([started(rules, seed).pos[0] for seed in range(300)])
    right = places[:, :2] if side == "right" else places[:, 2:]
    left = places[:, 2:] if side == "right" else places[:, :2]
    assert ((right[..., 0] >= 100.0) & (right[..., 0] <= 198.0)).all()
    assert ((left[..., 0] >= 2.0) & (left[..., 0] <= 100.0)).all()
    assert ((places[..., 1] >= 2.0) & (places[..., 1] <= 98.0)).all()
    assert np.hypot(right[..., 0] - 175.0, right[..., 1] - 50.0).min() > 7.0
    assert right[..., 0].max() > 195.0  # the whole half
    assert left[..., 0].min() < 5.0
    assert started(rules, 7).pos.tobytes() == started(rules, 7).pos.tobytes() != started(rules, 8).pos.tobytes()


def test_wall_rule(scene):
    bounces, drives = scene(substeps=1), scene(substeps=1, wall_rule="drive_back")
    for game in (bounces, drives):
        game.put(0, 200.5, 50.0, heading=90.0, speed=1.0, thrust=20.0, oob=True)
        game.give_flag(0)
        game.step(AHEAD, STOP, STOP, STOP)
        assert not game.has_flag[0]
    assert (bounces.heading[0], bounces.speed[0], bounces.events[0, HIT_WALL]) == (-90.0, 0.0, 1)
    assert drives.events[0, HIT_WALL] == 0  # it was outside before
    assert drives.thrust[0] == 20.0 + 20.0 * (0.75 - 1.0)  # half speed
    assert drives.heading_error_prev[0] == -180.0 or drives.heading_error_prev[0] == 180.0


@pytest.mark.parametrize("tagged", [True, False])
@pytest.mark.parametrize("rule", ["bounce", "drive_back"])
def test_wall_tags(scene, rule, tagged):
    game = scene(wall_rule=rule, wall_tags=tagged, oob_counts_as_tag=False)
    game.put(0, 200.5, 90.0, heading=90.0)
    game.step(STOP, STOP, STOP, STOP)
    assert game.is_tagged[0] == tagged
    assert game.score[1, TAGS] == 0


@pytest.mark.parametrize(("rule", "distance"), [("before", 5.1), ("after", 7.1)])
def test_keepout_rule(scene, rule, distance):
    game = scene(substeps=1, keepout_rule=rule, agent_radius_m=2.0)
    game.put(0, 179.0, 50.0, came_from=(179.1, 50.0), heading=-90.0)
    game.step(STOP, STOP, STOP, STOP)
    assert game.pos[0, 0] - 175.0 == pytest.approx(distance, abs=1e-6)


@pytest.mark.parametrize("stale", [True, False])
def test_stale_side(scene, stale):
    game = scene(substeps=1, stale_side=stale)
    game.put(0, 99.95, 20.0, heading=90.0, speed=1.5, thrust=30.0)
    game.step(AHEAD, STOP, STOP, STOP)
    assert game.pos[0, 0] > 100.0
    assert game.on_own_side[0] == (not stale)


@pytest.mark.parametrize("allowed", [True, False])
def test_grab_from_own_side(scene, allowed):
    game = scene(flag_homes_m=[[175.0, 50.0], [95.0, 50.0]], grab_from_own_side=allowed)
    game.put(0, 101.0, 50.0)
    assert game.step().score[0].tolist() == [allowed, 0, allowed]  # on its own side it has captured, too


@pytest.mark.parametrize("tags", [True, False])
def test_tag_at_zero(scene, tags):
    game = scene(tag_at_zero=tags)
    game.put(0, 120.0, 20.0)
    game.put(2, 120.0, 20.0)
    assert game.step().is_tagged[2] == tags


@pytest.mark.parametrize("may", [True, False])
def test_oob_may_tag(scene, may):
    game = scene(oob_may_tag=may)
    game.put(0, 199.0, 20.0)
    game.put(2, 193.0, 20.0)
    game.step()
    assert game.oob[0]
    assert game.is_tagged[2] == may


@pytest.mark.parametrize(("tie", "end"), [("red", RED_WON), ("draw", TIED)])
def test_tie_at_max(scene, tie, end):
    game = scene(capture_first_only=False, tie_at_max=tie)
    for v, x in ((0, 120.0), (2, 80.0)):
        game.put(v, x, 20.0 if v else 80.0)
        game.give_flag(v)
    game.step()
    assert game.score[:, 0].tolist() == [1, 1]
    assert finished(game.state, 0, game.rules) == end


def test_capture_first_only(scene):
    game = scene(max_score=2)
    for v, x in ((0, 120.0), (2, 80.0)):
        game.put(v, x, 20.0 if v else 80.0)
        game.give_flag(v)
    assert game.step().score[:, 0].tolist() == [1, 0]
    assert game.step().score[:, 0].tolist() == [1, 1]


def test_untag_at_keepout():
    assert make_rules(flag_keepout_m=12.0).untag_radius_m == 10.0
    assert make_rules("clean", flag_keepout_m=12.0).untag_radius_m == 13.0
    assert make_rules("clean", flag_keepout_m=5.0).untag_radius_m == 10.0
    assert make_rules("clean", flag_keepout_m=12.0, untag_radius_m=7.0).untag_radius_m == 7.0
    # After a move the circle is wider by agent_radius_m, and who is tagged must come nearer than the untag radius
    assert make_rules("clean", flag_keepout_m=9.0, keepout_rule="after").untag_radius_m == 12.0


@pytest.mark.parametrize(("overruns", "steps"), [(True, 1201), (False, 1200)])
def test_clock_overruns(overruns, steps):
    rules = make_rules(substeps=1, max_time_s=120.0, clock_overruns=overruns)
    state = started(rules)
    while finished(state, 0, rules) == RUNNING:
        step(state, 0, np.full(4, STOP), rules)
    assert state.steps[0] == steps


def test_what_is_seen_is_scaled():
    diagonal = math.hypot(200.0, 100.0)
    plain = ranges(make_rules())
    other = ranges(make_rules(obs_margin_m=0.0, obs_line_range="diagonal"))
    assert plain[1, [1, 13, 22]] == pytest.approx([(diagonal + 10.0) / 2.0, 50.0, (diagonal + 10.0) / 2.0])
    assert other[1, [1, 13, 22]] == pytest.approx([diagonal / 2.0] * 3)


@pytest.mark.parametrize("clipped", [True, False])
def test_obs_clipped(scene, clipped):
    game = scene(obs_clipped=clipped)
    game.state.score[0, 0, 0] = 5
    raw, out = np.zeros((4, 45)), np.zeros((4, 45), np.float32)
    observe(game.state, 0, game.rules, raw)
    normalise(raw, ranges(game.rules), game.rules, out)
    assert out[0, 19] == (1.0 if clipped else 9.0)
    assert (np.abs(out).max() <= 1.0) == clipped


@pytest.mark.parametrize(("kind", "x", "y"), [("fixed", 20.0, 60.0), ("scaled", 25.0, 75.0)])
def test_field_points(scene, kind, x, y):
    game = scene(substeps=1, field_points=kind)
    point = ACTIONS + FIELD_POINTS.index("PF")
    game.put(2, x + 5.0, y, heading=0.0)  # red is on the left; blue drives to the same point turned by half a circle
    blue = (160.0 - x, 80.0 - y) if kind == "fixed" else (200.0 - x, 100.0 - y)
    game.put(0, blue[0] - 5.0, blue[1], heading=0.0)
    game.step(point, STOP, point, STOP)
    assert game.heading_error_prev[[0, 2]].tolist() == [90.0, -90.0]
    assert game.thrust[[0, 2]].tolist() == [30.0, 30.0]


@pytest.mark.parametrize(("reach", "speed"), [(0.3, 1.5), (2.0, 0.0)])
def test_field_point_reach(scene, reach, speed):
    game = scene(substeps=1, field_points="scaled", field_point_reach_m=reach)
    game.put(0, 101.0, 50.0, heading=0.0)
    game.step(ACTIONS + FIELD_POINTS.index("CC"), STOP, STOP, STOP)
    assert game.command[0].tolist() == [speed, -90.0]


def test_flag_homes_are_where_they_are_put():
    rules = make_rules(flag_homes_m=[[150.0, 30.0], [40.0, 80.0]])
    state = started(rules)
    assert state.flag_pos[0].tolist() == [[150.0, 30.0], [40.0, 80.0]]
    raw = np.zeros((4, 45))
    observe(state, 0, rules, raw)
    assert raw[0, 3] == pytest.approx(math.dist(state.pos[0, 0], (150.0, 30.0)))
    for homes, said in (([[90.0, 50.0], [40.0, 50.0]], "half"), ([[150.0, 4.0], [40.0, 50.0]], "walls"), ("ab", "two")):
        with pytest.raises(ValueError, match=f"flag_homes_m.*{said}"):
            make_rules(flag_homes_m=homes)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("team_size", [(1, 3), (4, 2), (10, 10)])
def test_teams_of_any_size_play_to_the_end(profile, team_size):
    rules = make_rules(profile, team_size, max_time_s=60.0, substeps=10)
    policies = np.random.default_rng(0).integers(7, size=(6, sum(team_size)))
    state = play_scripted(policies, np.arange(6, dtype=np.uint64), rules)
    assert np.isfinite(state.pos).all()
    assert (state.steps > 0).all()
    assert (state.pos >= -5.0).all()
    assert (state.pos <= np.array([rules.width_m, rules.height_m]) + 5.0).all()
