"""Fixed policies in cases that the recorded games do not decide; vectors are (forward, starboard)."""

import numpy as np
import pytest

from mctf.rules import make_rules
from mctf.scripted import ATTACK_EASY, ATTACK_HARD, ATTACK_MEDIUM, DEFEND_EASY, DEFEND_HARD, DEFEND_MEDIUM, act

RULES = make_rules(team_size=1)
AHEAD, RIGHT, LEFT = 4, 2, 6
SLOW = 8  # added to them


def seen(goal=(0.0, 80.0), home=(180.0, 80.0), enemy=(180.0, 90.0), walls=((0, 50), (90, 50), (180, 50), (-90, 50))):
    """Returns a 1v1 observation: bearing and distance of flags, opponent and walls."""
    raw = np.zeros(29)
    raw[0:2], raw[2:4], raw[21:23] = goal, home, enemy
    raw[4:12] = np.ravel(walls)
    return raw


@pytest.mark.parametrize(
    ("goal", "wall", "action"),
    [
        # (d² cos b, d² sin b) = (21.65 m, 12.5 deg) is read as distance and bearing:
        # 1.25 sin 5 = 0.109 and 1.25 sin 15 = 0.324 against sin 12.5 = 0.216
        (5.0, (30.0, 5.0), LEFT),
        (15.0, (30.0, 5.0), RIGHT),
        (5.0, (20.0, 6.0), RIGHT),  # 33.8 m: too far to count, 12.3 deg would turn it left
        (5.0, (90.0, 5.0), RIGHT),  # abeam: not ahead
        (0.5, (30.0, 10.0), AHEAD),  # not nearer than 10 m
    ],
)
@pytest.mark.parametrize("place", range(4))
def test_hard_attacker_at_a_wall(goal, wall, action, place):
    walls = [(180.0, 50.0)] * 4
    walls[place] = wall
    assert act(ATTACK_HARD, seen(goal=(goal, 80.0), walls=walls), RULES, 0.0) == action


def test_only_one_wall_of_a_pair_counts():
    # Wall 0 alone as above; with wall 2 as well the dangers would add up to straight ahead
    walls = [(30.0, 5.0), (180.0, 50.0), (-30.0, 5.0), (180.0, 50.0)]
    assert act(ATTACK_HARD, seen(goal=(5.0, 80.0), walls=walls), RULES, 0.0) == LEFT


@pytest.mark.parametrize(("room", "action"), [((90, 60), RIGHT), ((60, 90), LEFT), ((70, 60), LEFT)])
def test_hard_attacker_escapes_along_the_middle(room, action):
    walls = [(90.0, room[0]), (180.0, 50.0), (-90.0, room[1]), (0.0, 50.0)]
    assert act(ATTACK_HARD, seen(enemy=(0.0, 20.0), walls=walls), RULES, 0.0) == action


@pytest.mark.parametrize(("bearing", "turn"), [(0.9, AHEAD), (-0.9, AHEAD), (1.1, RIGHT), (-1.1, LEFT), (180.0, RIGHT)])
def test_dead_band(bearing, turn):
    assert act(ATTACK_EASY, seen(goal=(bearing, 80.0)), RULES, 0.0) == SLOW + turn


def test_attackers_go_home_with_the_flag():
    raw = seen(goal=(90.0, 80.0), home=(-90.0, 80.0))
    raw[15] = 1.0
    assert [act(policy, raw, RULES, 0.0) for policy in (ATTACK_EASY, ATTACK_MEDIUM, ATTACK_HARD)] == [14, 14, 6]


def test_medium_attacker_avoids_opponents_within_ten_metres():
    # 2 sin 20 = 0.68 against sin 60 = 0.87
    assert act(ATTACK_MEDIUM, seen(goal=(20.0, 80.0), enemy=(60.0, 9.9)), RULES, 0.0) == SLOW + LEFT
    assert act(ATTACK_MEDIUM, seen(goal=(20.0, 80.0), enemy=(60.0, 10.0)), RULES, 0.0) == SLOW + RIGHT


@pytest.mark.parametrize(("distance", "action"), [(16.1, RIGHT), (16.0, LEFT)])
def test_easy_defender_keeps_its_distance(distance, action):
    assert act(DEFEND_EASY, seen(home=(90.0, distance)), RULES, 0.0) == SLOW + action


def test_medium_defender_chases_the_carrier():
    raw = seen(enemy=(90.0, 8.0))
    raw[21 + 4] = 1.0
    assert act(DEFEND_MEDIUM, raw, RULES, 0.0) == SLOW + RIGHT
    assert act(DEFEND_EASY, raw, RULES, 0.0) == SLOW + LEFT


@pytest.mark.parametrize(
    ("home", "enemy", "action"),
    [
        ((0.0, 10.0), (90.0, 15.0), RIGHT),  # 18 m from the flag, within 25: at it
        ((0.0, 10.0), (90.0, 50.0), RIGHT),  # beyond: to the point of the line nearest to here, at 11 deg
        ((0.0, 60.0), (45.0, 60.0), RIGHT),  # nearest point at 22 deg and 23 m from the flag
        ((0.0, 80.0), (80.0, 60.0), LEFT),  # 59 m from the flag: behind it, seen from that point
    ],
)
def test_hard_defender_blocks(home, enemy, action):
    assert act(DEFEND_HARD, seen(home=home, enemy=enemy), RULES, 0.0) == action
