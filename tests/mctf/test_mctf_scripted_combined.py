"""The combined policies: when they change roles, and the medium one's defence at random."""

import math

import numpy as np
import pytest

from mctf.scripted import (
    ATTACK_EASY,
    ATTACK_HARD,
    ATTACK_MEDIUM,
    COMBINED_EASY,
    COMBINED_HARD,
    COMBINED_MEDIUM,
    DEFEND_EASY,
    DEFEND_HARD,
    DEFEND_MEDIUM,
    act,
)
from mctf.start import reset
from tests.mctf.sight import AHEAD, LEFT, RIGHT, SLOW, VERSIONS, Sight, seed_with

NEW = VERSIONS[1:]
COMBINED = (COMBINED_EASY, COMBINED_MEDIUM, COMBINED_HARD)
ATTACK = (ATTACK_EASY, ATTACK_MEDIUM, ATTACK_HARD)
DEFEND = (DEFEND_EASY, DEFEND_MEDIUM, DEFEND_HARD)
every_version = pytest.mark.parametrize("version", VERSIONS)


def roles(sight):
    """Returns for each level whether it does what an attacker does, or a defender, or draws numbers."""
    out = []
    for combined, attack, defend in zip(COMBINED, ATTACK, DEFEND, strict=True):
        action, draws = sight.drawn(combined, 3)
        assert sight.act(attack) != sight.act(defend)
        out.append("roams" if draws else "attacks" if action == sight.act(attack) else "defends")
        assert draws or action in (sight.act(attack), sight.act(defend))
    return out


def around_flag(version, gaps, tagged=(), **flags):
    """Returns a vehicle with its flag 30 m to starboard, and opponents this much farther that way."""
    sight = Sight(version, enemies=len(gaps)).see(goal=(-90.0, 80.0), home=(90.0, 30.0))
    for place, gap in enumerate(gaps):
        sight.enemy(90.0, 30.0 + gap, place=place, is_tagged=place in tagged, **flags)
    return sight


@every_version
@pytest.mark.parametrize(
    ("gaps", "tagged", "expected"),
    [
        ([29.9], (), ["defends", "defends", "defends"]),
        ([30.1], (), ["attacks", "roams", "attacks"]),
        ([49.9], (), ["attacks", "roams", "attacks"]),
        ([50.1], (), ["attacks", "attacks", "attacks"]),
        ([29.9], (0,), ["attacks", "roams", "attacks"]),  # nobody to defend against
        ([1.0, 57.0], (), ["defends", "defends", "defends"]),  # the middle of both counts
        ([1.0, 57.0], (1,), ["defends", "defends", "defends"]),  # one is free
        ([1.0, 57.0], (0, 1), ["attacks", "roams", "attacks"]),
        ([1.0, 61.0], (), ["attacks", "roams", "attacks"]),
        ([1.0, 101.0], (), ["attacks", "attacks", "attacks"]),
    ],
)
def test_roles_by_the_distance_of_the_opponents(version, gaps, tagged, expected):
    assert roles(around_flag(version, gaps, tagged)) == expected


@every_version
def test_the_limits_themselves(version):
    sight = Sight(version).see(goal=(-90.0, 80.0), home=(0.0, 20.0))  # (20, 0): these distances are exact
    assert roles(sight.enemy(0.0, 50.0)) == ["attacks", "roams", "attacks"]
    assert roles(sight.enemy(0.0, 70.0)) == ["attacks", "roams", "attacks"]


@every_version
def test_flags_decide_before_distances(version):
    # The own flag is where its carrier is, 80 m from the middle of both opponents
    sight = Sight(version, enemies=2).see(goal=(-90.0, 80.0), home=(90.0, 30.0))
    sight.enemy(90.0, 90.0, has_flag=True).enemy(90.0, 250.0, place=1)
    assert roles(sight) == ["attacks", "defends", "defends"]
    # Opponents are close: the easy one defends, and leaves its flag; the others bring home the one they have
    sight = Sight(version).see(home=(90.0, 12.0), has_flag=True).enemy(-90.0, 2.0)
    assert roles(sight) == ["defends", "attacks", "attacks"]


# The defence at random


def roaming(version, **flags):
    """Returns a medium one in between: own flag 30 m behind, an opponent 40 m from that to starboard."""
    sight = Sight(version).see(goal=(0.0, 120.0), home=(180.0, 30.0), **flags)
    return sight.enemy(math.degrees(math.atan2(40.0, -30.0)), 50.0)


def at_flag(version, **flags):
    """The same with the own flag 5 m behind: no farther than the keep-out circle and 2 m."""
    sight = Sight(version).see(goal=(0.0, 145.0), home=(180.0, 5.0), **flags)
    return sight.enemy(math.degrees(math.atan2(40.0, -5.0)), math.hypot(40.0, 5.0))


ANYWHERE = seed_with(lambda a, b, c: a < 0.25 and 0.2 < b < 0.3)
FAR_OUT = seed_with(lambda a, b, c: a < 0.25 and b > 0.6)
TO_ENEMY = seed_with(lambda a, b, c: a > 0.25 and b < 0.5)
TO_FLAG = seed_with(lambda a, b, c: a > 0.25 and b > 0.5 and c < 0.1)
TO_FLAG_OUT = seed_with(lambda a, b, c: a > 0.25 and b > 0.5 and 0.3 < c < 0.9)


@every_version
def test_what_is_drawn(version):
    for seed in (ANYWHERE, FAR_OUT, TO_ENEMY, TO_FLAG):
        for home in (True, False):
            assert roaming(version, on_own_side=home).drawn(COMBINED_MEDIUM, seed)[1] == 2
            assert at_flag(version, on_own_side=home).drawn(COMBINED_MEDIUM, seed)[1] == 2 + (seed == TO_FLAG)


@every_version
def test_others_draw_nothing(version):
    for policy in (COMBINED_EASY, COMBINED_HARD):
        assert roaming(version).drawn(policy, 5)[1] == 0


def test_the_caught_error_of_2024():
    """On its own side it drives on straight at full speed, wherever it wants to go."""
    for sight in (roaming("2024", on_own_side=True), at_flag("2024", on_own_side=True)):
        assert {sight.act(COMBINED_MEDIUM, seed) for seed in range(50)} == {AHEAD}


@pytest.mark.parametrize("version", NEW)
def test_on_its_own_side(version):
    sight = roaming(version, on_own_side=True)
    # Own flag (-30, 0), middle of the field (45, 0): a quarter of the way is behind, three fifths are ahead
    assert sight.act(COMBINED_MEDIUM, ANYWHERE) == SLOW + RIGHT
    assert sight.act(COMBINED_MEDIUM, FAR_OUT) == SLOW + AHEAD
    assert sight.act(COMBINED_MEDIUM, TO_ENEMY) == SLOW + RIGHT
    assert sight.enemy(180.0 - 53.2, 50.0).see(home=(-170.0, 30.0)).act(COMBINED_MEDIUM, TO_FLAG) == SLOW + LEFT
    sight = at_flag(version, on_own_side=True)
    # (-5, 0) and 55 of the 75 m to the middle
    assert sight.act(COMBINED_MEDIUM, TO_FLAG_OUT) == SLOW + AHEAD
    near = seed_with(lambda a, b, c: a > 0.25 and b > 0.5 and 5.0 / 75.0 < c < 5.0 / 55.0)
    assert sight.act(COMBINED_MEDIUM, near) == SLOW + RIGHT


@pytest.mark.parametrize("version", NEW)
def test_the_middle_is_on_the_line_between_the_halves(version):
    """Flags need not be as far from it: own home 60 m from the line, the opponents' 20 m."""
    homes = ((160.0, 50.0), (80.0, 50.0)) if version == "repaired" else ((40.0, 50.0), (120.0, 50.0))
    sight = Sight(version, world_size_m=(200.0, 100.0), flag_homes_m=homes)
    sight.see(goal=(0.0, 50.0), home=(180.0, 30.0), on_own_side=True).enemy(126.9, 50.0)
    # (-30, 0) to (30, 0) instead of (10, 0)
    seed = seed_with(lambda a, b, c: a < 0.25 and 0.55 < b < 0.7)
    assert sight.act(COMBINED_MEDIUM, seed) == SLOW + AHEAD


def test_the_reach_of_2024():
    """What it sees ahead at the first call, 120 - 30/2, is kept: the goal is on its bow, as far as that."""
    sight = roaming("2024")
    assert math.isnan(sight.state.reach[0, 0])
    assert sight.act(COMBINED_MEDIUM, ANYWHERE) == SLOW + AHEAD
    assert sight.state.reach[0, 0] == pytest.approx(105.0)
    sight.see(goal=(180.0, 120.0), home=(0.0, 30.0)).enemy(53.1, 50.0)
    assert sight.act(COMBINED_MEDIUM, ANYWHERE) == SLOW + AHEAD
    assert sight.state.reach[0, 0] == pytest.approx(105.0)
    reset(sight.state, 0, sight.rules)
    assert sight.act(COMBINED_MEDIUM, ANYWHERE) == SLOW + RIGHT  # -120 + 30/2: behind
    assert sight.state.reach[0, 0] == pytest.approx(-105.0)


def test_the_reach_is_of_the_first_call_whatever_is_done_then():
    sight = roaming("2024", has_flag=True)
    sight.act(COMBINED_MEDIUM)
    assert sight.state.reach[0, 0] == pytest.approx(105.0)


def test_a_short_reach_is_negative_near_the_flag():
    for goal, turn in ((30.0, AHEAD), (20.0, RIGHT)):  # 27.5 - 20 and 17.5 - 20
        sight = at_flag("2024").see(goal=(0.0, goal))
        assert sight.act(COMBINED_MEDIUM, TO_FLAG_OUT) == SLOW + turn


@every_version
def test_off_its_own_side_it_avoids_opponents(version):
    sight = Sight(version, enemies=2).see(goal=(0.0, 120.0), home=(180.0, 30.0))
    for distance, turn in ((14.9, LEFT), (15.0, RIGHT)):
        # Their middle is that of ``roaming``; towards the flag (-1, 0), away from the near one (-0.5, -0.87)
        near = distance * np.array([math.cos(math.radians(60.0)), math.sin(math.radians(60.0))])
        far = 2.0 * np.array([-30.0, 40.0]) - near
        sight.enemy(60.0, distance)
        sight.enemy(math.degrees(math.atan2(far[1], far[0])), math.hypot(*far), place=1)
        assert sight.drawn(COMBINED_MEDIUM, TO_FLAG) == (SLOW + turn, 2)


@pytest.mark.parametrize("version", NEW)
@pytest.mark.parametrize("bearing", [37.0, -112.0, 0.3])
def test_towards_the_opponent_that_it_avoids(version, bearing):
    sight = Sight(version).see(home=(bearing + 180.0, 30.0)).enemy(bearing, 10.0)
    assert sight.drawn(COMBINED_MEDIUM, TO_ENEMY) == (SLOW + AHEAD, 2)


@every_version
def test_an_opponent_in_the_same_place(version):
    sight = Sight(version).see(home=(90.0, 40.0)).enemy(-90.0, 0.0)
    assert sight.act(COMBINED_MEDIUM, TO_FLAG) == (16 if version == "2024" else SLOW + RIGHT)  # NaN stops


def test_each_game_draws_and_remembers_for_itself():
    sight = roaming("2024")
    state = type(sight.state)(*(np.concatenate([array] * 3) for array in sight.state))
    state.stream[:] = TO_ENEMY, ANYWHERE, TO_ENEMY
    assert act(COMBINED_MEDIUM, state, 1, 0, sight.raw, sight.rules) == SLOW + AHEAD
    assert state.stream[[0, 2]].tolist() == [TO_ENEMY, TO_ENEMY]
    assert state.stream[1] != ANYWHERE
    assert np.isnan(state.reach).tolist() == [[True, True], [False, True], [True, True]]
