"""Attackers and defenders in cases that the recorded games do not decide; vectors are (forward, starboard)."""

import pytest

from mctf.scripted import (
    ATTACK_COMPETITION_MEDIUM,
    ATTACK_EASY,
    ATTACK_HARD,
    ATTACK_MEDIUM,
    COMBINED_HARD,
    DEFEND_EASY,
    DEFEND_HARD,
    DEFEND_MEDIUM,
    NAMES,
    NOTHING,
    PAPER,
    RANDOM,
)
from tests.mctf.sight import AHEAD, LEFT, RIGHT, SLOW, VERSIONS, Sight, uniforms

STOP = 16
NEW = VERSIONS[1:]
every_version = pytest.mark.parametrize("version", VERSIONS)


def test_names_stand_in_files():
    assert PAPER == (
        "attack_easy",
        "attack_medium",
        "attack_hard",
        "defend_easy",
        "defend_medium",
        "defend_hard",
        "random",
    )
    assert NAMES[:7] == PAPER
    assert (RANDOM, COMBINED_HARD, NOTHING) == (6, 9, 15)
    assert len(set(NAMES)) == len(NAMES) == 16


# Attackers


@every_version
@pytest.mark.parametrize(("bearing", "turn"), [(0.9, AHEAD), (-0.9, AHEAD), (1.1, RIGHT), (-1.1, LEFT), (180.0, RIGHT)])
def test_dead_band(version, bearing, turn):
    assert Sight(version).see(goal=(bearing, 80.0)).act(ATTACK_EASY) == SLOW + turn


@every_version
def test_attackers_go_home_with_the_flag(version):
    sight = Sight(version, mates=1).see(goal=(90.0, 80.0), home=(-90.0, 80.0), has_flag=True)
    attackers = (ATTACK_EASY, ATTACK_MEDIUM, ATTACK_HARD, ATTACK_COMPETITION_MEDIUM)
    assert [sight.act(policy) for policy in attackers] == [14, 14, 6, 6]
    sight.see(has_flag=False).mate(0.0, 20.0, has_flag=True)
    # The competition's follows the mate with the flag
    assert [sight.act(policy) for policy in attackers] == [14, 14, 6, AHEAD]


@every_version
def test_medium_attacker_avoids_opponents_within_ten_metres(version):
    sight = Sight(version).see(goal=(20.0, 80.0))
    # 2 sin 20 = 0.68 against sin 60 = 0.87
    assert sight.enemy(60.0, 9.9).act(ATTACK_MEDIUM) == SLOW + LEFT
    assert sight.enemy(60.0, 9.9, is_tagged=True).act(ATTACK_MEDIUM) == SLOW + LEFT
    assert sight.enemy(60.0, 10.0).act(ATTACK_MEDIUM) == SLOW + RIGHT


@every_version
def test_mates_are_no_danger(version):
    sight = Sight(version, mates=1, enemies=2).see(goal=(20.0, 80.0)).mate(60.0, 5.0)
    assert sight.act(ATTACK_MEDIUM) == SLOW + RIGHT
    assert sight.enemy(60.0, 5.0, place=1).act(ATTACK_MEDIUM) == SLOW + LEFT


@every_version
@pytest.mark.parametrize(("distance", "actions"), [(29.0, (LEFT, LEFT)), (59.0, (RIGHT, LEFT)), (60.0, (RIGHT, RIGHT))])
def test_hard_attackers_look_farther(version, distance, actions):
    # 1.25 sin 20 = 0.43 against 0.87
    sight = Sight(version).see(goal=(20.0, 80.0)).enemy(60.0, distance)
    assert (sight.act(ATTACK_HARD), sight.act(ATTACK_COMPETITION_MEDIUM)) == actions


@pytest.mark.parametrize(
    ("goal", "wall", "action", "repaired"),
    [
        # (d² cos b, d² sin b) = (21.65 m, 12.5 deg) is read as distance and bearing:
        # 1.25 sin 5 = 0.109 and 1.25 sin 15 = 0.324 against sin 12.5 = 0.216; repaired against sin 30 = 0.5
        (5.0, (30.0, 5.0), LEFT, LEFT),
        (15.0, (30.0, 5.0), RIGHT, LEFT),
        (5.0, (20.0, 6.0), RIGHT, LEFT),  # 33.8 m: too far to count, 12.3 deg would turn it left
        (5.0, (90.0, 5.0), RIGHT, RIGHT),  # abeam: not ahead
        (0.5, (30.0, 10.0), AHEAD, AHEAD),  # not nearer than 10 m
    ],
)
@pytest.mark.parametrize("place", range(4))
def test_hard_attacker_at_a_wall(goal, wall, action, repaired, place):
    walls = dict.fromkeys(range(4), (180.0, 50.0)) | {place: wall}
    assert Sight("2024").see(goal=(goal, 80.0), walls=walls).act(ATTACK_HARD) == action
    for version in NEW:
        assert Sight(version).see(goal=(goal, 80.0), walls=walls).act(ATTACK_HARD) == repaired


@every_version
def test_only_one_wall_of_a_pair_counts(version):
    # Wall 0 alone as above; with wall 2 as well the dangers would add up to straight ahead
    sight = Sight(version).see(goal=(5.0, 80.0), walls={0: (30.0, 5.0), 1: (180.0, 50.0), 2: (-30.0, 5.0)})
    assert sight.act(ATTACK_HARD) == LEFT


@every_version
@pytest.mark.parametrize(("room", "action"), [((90, 60), RIGHT), ((60, 90), LEFT), ((70, 60), LEFT)])
def test_hard_attackers_escape_along_the_middle(version, room, action):
    walls = {0: (90.0, room[0]), 1: (180.0, 50.0), 2: (-90.0, room[1]), 3: (0.0, 50.0)}
    sight = Sight(version).see(walls=walls).enemy(0.0, 20.0)
    assert sight.act(ATTACK_HARD) == action
    sight.enemy(0.0, 50.0)
    assert (sight.act(ATTACK_HARD), sight.act(ATTACK_COMPETITION_MEDIUM)) == (AHEAD, action)


def test_an_opponent_in_the_same_place():
    """Its weight is infinite: NaN, and straight on in 2024; else it is driven from."""
    for policy, speed in ((ATTACK_MEDIUM, SLOW), (ATTACK_HARD, 0)):
        assert Sight("2024").see(goal=(45.0, 80.0)).enemy(60.0, 0.0).act(policy) == speed + AHEAD
        for version in NEW:
            assert Sight(version).see(goal=(-45.0, 80.0)).enemy(60.0, 0.0).act(policy) == speed + LEFT


# Defenders


@pytest.mark.parametrize(("version", "edge"), [("2024", 16.0), ("repaired", 16.0), ("2025", 14.0)])
def test_easy_defenders_keep_their_distance(version, edge):
    for policy in (DEFEND_EASY, DEFEND_MEDIUM):
        assert Sight(version).see(home=(90.0, edge + 0.1)).act(policy) == SLOW + RIGHT
        assert Sight(version).see(home=(90.0, edge)).act(policy) == SLOW + LEFT


@pytest.mark.parametrize(("version", "turn"), [("2024", LEFT), ("repaired", RIGHT), ("2025", RIGHT)])
def test_easy_defender_turns_away_from_a_flag_dead_ahead(version, turn):
    assert Sight(version).see(home=(0.0, 12.0)).act(DEFEND_EASY) == SLOW + turn


@every_version
def test_medium_defender_chases_the_carrier(version):
    sight = Sight(version).enemy(90.0, 8.0, has_flag=True)
    assert sight.act(DEFEND_MEDIUM) == SLOW + RIGHT
    assert sight.act(DEFEND_EASY) == SLOW + LEFT
    assert sight.act(DEFEND_HARD) == RIGHT


@pytest.mark.parametrize(
    ("home", "enemy", "actions"),
    [
        ((0.0, 10.0), (90.0, 15.0), (RIGHT, RIGHT, RIGHT)),  # 18 m from the flag, within 25: at it
        # Beyond: to the point of the line nearest to here, at 11 deg; midway is 25.5 m from the flag, so 25 m from it
        ((0.0, 10.0), (90.0, 50.0), (RIGHT, RIGHT, RIGHT)),
        ((0.0, 60.0), (45.0, 60.0), (RIGHT, RIGHT, RIGHT)),  # nearest point at 22 deg and 23 m from the flag
        # 91 m from the flag, nearest point 60 m: behind the flag seen from there, but repaired in front of it
        ((0.0, 80.0), (80.0, 60.0), (LEFT, RIGHT, RIGHT)),
        # Flag (0, 10), enemy (30, -20), 42 m from it: the nearest point is (5, 5), midway is (15, -5)
        ((90.0, 10.0), (-33.69, 36.06), (RIGHT, RIGHT, LEFT)),
    ],
)
def test_hard_defender_blocks(home, enemy, actions):
    for version, action in zip(VERSIONS, actions, strict=True):
        sight = Sight(version, flag_keepout_m=5.0).see(home=home).enemy(*enemy)
        assert sight.act(DEFEND_HARD) == action


def test_hard_defender_beyond_its_flag():
    """With a tagged opponent the 2024 one divides 0 by 0 and stops; repaired it goes 25 m in front of the flag."""
    for version, tagged, free in zip(VERSIONS, (STOP, RIGHT, RIGHT), (AHEAD, AHEAD, RIGHT), strict=True):
        sight = Sight(version, flag_keepout_m=5.0).see(home=(0.0, 10.0))
        assert sight.enemy(10.0, 100.0, is_tagged=True).act(DEFEND_HARD) == tagged
        assert sight.enemy(10.0, 100.0).act(DEFEND_HARD) == free  # to the flag, or midway


def test_a_tagged_opponent_on_the_flag():
    for version, action in zip(VERSIONS, (STOP, RIGHT, RIGHT), strict=True):
        sight = Sight(version).see(home=(90.0, 10.0)).enemy(90.0, 10.0, is_tagged=True)
        assert sight.act(DEFEND_HARD) == action
        assert sight.enemy(90.0, 10.0).act(DEFEND_HARD) == RIGHT


@every_version
def test_hard_defender_prefers_the_untagged(version):
    sight = Sight(version, enemies=3).see(home=(0.0, 1.0))
    for place, (bearing, distance, tagged) in enumerate(
        ((-90.0, 6.0, True), (90.0, 13.0, False), (-90.0, 14.0, False))
    ):
        sight.enemy(bearing, distance, place=place, is_tagged=tagged)
    assert sight.act(DEFEND_HARD) == RIGHT


@every_version
def test_hard_defender_sees_farther_than_a_thousand_metres(version):
    sight = Sight(version).see(home=(0.0, 2.0)).enemy(90.0, 1500.0)
    assert sight.act(DEFEND_HARD) in (AHEAD, RIGHT, LEFT)


def test_hard_defender_at_a_wall():
    """Its goal is (3, 0); the wall's entry (12.5 m, 21.7 deg) is too far to count, (5 m, 60 deg) is not."""
    for version, action in zip(VERSIONS, (AHEAD, LEFT, LEFT), strict=True):
        sight = Sight(version).see(home=(0.0, 8.0), walls={0: (60.0, 5.0)}).enemy(0.0, 3.0)
        assert sight.act(DEFEND_HARD) == action
        assert sight.see(walls={0: (60.0, 7.0)}).act(DEFEND_HARD) == AHEAD


# The others


@every_version
def test_nothing(version):
    assert Sight(version).drawn(NOTHING, 5) == (-1, 0)


@every_version
def test_random_draws_one_number(version):
    sight = Sight(version)
    for seed in range(200):
        assert sight.drawn(RANDOM, seed) == (int(17 * uniforms(seed, 1)[0]), 1)
    assert {sight.act(RANDOM) for _ in range(500)} == set(range(17))
