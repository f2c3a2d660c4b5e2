"""Policies that drive from field point to field point; 160 x 80 m, where all versions have the same points."""

import numpy as np
import pytest

from mctf.commands import FIELD_POINTS
from mctf.kernel import step
from mctf.observe import observation_size, observe
from mctf.rules import ACTIONS, make_rules
from mctf.scripted import (
    ATTACK_COMPETITION_EASY,
    DEFEND_COMPETITION_EASY,
    DEFEND_COMPETITION_MEDIUM,
    NOTHING,
    WAYPOINT,
    act,
)
from mctf.start import reset
from mctf.state import CAPTURES, GRABS, empty
from tests.mctf.sight import AHEAD, LEFT, PROFILE, RIGHT, VERSIONS

ORIGINAL = ("2024", "2025")
every_version = pytest.mark.parametrize("version", VERSIONS)
every_team = pytest.mark.parametrize("team", [0, 1])
SC, CFX, PC, CF, PM, SM, CH = (
    ACTIONS + FIELD_POINTS.index(name) for name in ("SC", "CFX", "PC", "CF", "PM", "SM", "CH")
)


class Driver:
    """One of two vehicles; the other is in a corner."""

    def __init__(self, version, team=0, **rules):
        self.rules = make_rules(PROFILE[version], 1, **{"world_size_m": (160.0, 80.0)} | rules)
        self.state, self.v = empty(1, self.rules), team
        reset(self.state, 0, self.rules)
        self.right = team == (0 if self.rules.blue_right else 1)
        self.put(1 - team, 4.0 if self.right else 156.0, 4.0)
        self.raw = np.zeros((2, observation_size(self.rules)))

    def put(self, v, x, y, **flags):
        self.state.pos[0, v] = x, y
        for name, value in flags.items():
            getattr(self.state, name)[0, v] = value
        return self

    def at(self, point, off=0.0, **flags):
        """Puts it ``off`` m beside a point, as its team names it."""
        x, y = place(point, self.right)
        return self.put(self.v, x, y + off, **flags)

    def act(self, policy):
        observe(self.state, 0, self.rules, self.raw)
        return act(policy, self.state, 0, self.v, self.raw[self.v], self.rules)


def place(point, right):
    """Returns x and y of a point in a field of 160 x 80 m, worked out from its name."""
    row, column = (point[0], point[1:]) if len(point) > 1 else (point, "")
    x = {"B": 0, "F": 20, "H": 40, "M": 60, "C": 80, "MX": 100, "HX": 120, "FX": 140, "BX": 160}[column]
    y = {"P": 60, "C": 40, "S": 20}[row]
    return (160.0 - x, 80.0 - y) if right else (float(x), float(y))


@every_version
@every_team
def test_the_raid(version, team):
    driver = Driver(version, team)
    assert driver.at("CC").act(ATTACK_COMPETITION_EASY) == SC
    assert driver.at("SC", 2.6).act(ATTACK_COMPETITION_EASY) == SC
    assert driver.at("SC", -2.4).act(ATTACK_COMPETITION_EASY) == CFX
    assert driver.at("SC").act(ATTACK_COMPETITION_EASY) == CFX
    assert driver.at("CFX").act(ATTACK_COMPETITION_EASY) == PC
    if version in ORIGINAL:  # home is never driven to
        assert driver.at("PC", 2.4).act(ATTACK_COMPETITION_EASY) == SC
        return
    assert driver.at("PC", 2.4).act(ATTACK_COMPETITION_EASY) == CF
    assert driver.at("CF", 6.1).act(ATTACK_COMPETITION_EASY) == CF
    assert driver.at("CF", 5.9).act(ATTACK_COMPETITION_EASY) == SC


@every_version
@every_team
def test_a_tag_begins_the_raid_anew(version, team):
    driver = Driver(version, team)
    driver.at("SC").act(ATTACK_COMPETITION_EASY)
    assert driver.at("CC").act(ATTACK_COMPETITION_EASY) == CFX
    assert driver.at("CC", is_tagged=True).act(ATTACK_COMPETITION_EASY) == SC
    # Tagged at the point where it was to go: the original compares with that one, and goes on
    driver.at("SC", is_tagged=False).act(ATTACK_COMPETITION_EASY)
    assert driver.at("CFX", 1.0, is_tagged=True).act(ATTACK_COMPETITION_EASY) == (CFX if version in ORIGINAL else SC)


@every_version
@every_team
def test_the_beat(version, team):
    driver = Driver(version, team)
    assert driver.at("CC").act(DEFEND_COMPETITION_EASY) == PM
    assert driver.at("PM", 2.6).act(DEFEND_COMPETITION_EASY) == PM
    assert driver.at("PM", 2.4).act(DEFEND_COMPETITION_EASY) == SM
    assert driver.at("SM").act(DEFEND_COMPETITION_EASY) == PM
    assert driver.at("CC", is_tagged=True).act(DEFEND_COMPETITION_EASY) == SC
    assert driver.at("CC", is_tagged=False).act(DEFEND_COMPETITION_EASY) == SC
    assert driver.at("SC").act(DEFEND_COMPETITION_EASY) == SM
    assert driver.at("SM", is_tagged=True).act(DEFEND_COMPETITION_EASY) == (SM if version in ORIGINAL else SC)


@every_version
@every_team
def test_the_post(version, team):
    driver = Driver(version, team)
    assert driver.at("CH", 2.6).act(DEFEND_COMPETITION_MEDIUM) == CH
    assert driver.at("CH", 2.4).act(DEFEND_COMPETITION_MEDIUM) == -1


@every_version
@every_team
def test_intruders_are_chased(version, team):
    driver = Driver(version, team)
    x, y = place("CM", driver.right)
    ahead = -1.0 if driver.right else 1.0
    driver.at("CH", heading=90.0 * ahead)
    other = 1 - team
    assert driver.put(other, x, y, on_own_side=False).act(DEFEND_COMPETITION_MEDIUM) == AHEAD
    assert driver.put(other, x, y + 10.0, on_own_side=False).act(DEFEND_COMPETITION_MEDIUM) == (
        RIGHT if driver.right else LEFT
    )
    assert driver.put(other, x, y, is_tagged=True).act(DEFEND_COMPETITION_MEDIUM) == -1
    assert driver.put(other, x, y, is_tagged=False, on_own_side=True).act(DEFEND_COMPETITION_MEDIUM) == -1
    # Whoever has the flag is chased anywhere
    assert driver.put(other, x, y, has_flag=True).act(DEFEND_COMPETITION_MEDIUM) == AHEAD


@every_version
@every_team
def test_the_round(version, team):
    driver = Driver(version, team)
    names = ["PM", "PHX", "CFX", "SHX", "SM", "CH"]
    for name, following in zip(names, names[1:] + names[:1], strict=True):
        assert driver.at("CC").act(WAYPOINT) == ACTIONS + FIELD_POINTS.index(name)
        assert driver.at(name, 2.4).act(WAYPOINT) == ACTIONS + FIELD_POINTS.index(following)
    driver.at("PM").act(WAYPOINT)
    assert driver.at("CC").act(WAYPOINT) == ACTIONS + FIELD_POINTS.index("PHX")
    assert driver.at("CC", is_tagged=True).act(WAYPOINT) == PM


def test_the_round_goes_on_where_vehicles_stop_early():
    driver = Driver("2025", field_point_reach_m=8.0)
    assert driver.at("PM", 7.9).act(WAYPOINT) == ACTIONS + FIELD_POINTS.index("PHX")


@every_version
def test_memory_is_of_one_game(version):
    for policy, first, second in (
        (ATTACK_COMPETITION_EASY, "SC", "CFX"),
        (DEFEND_COMPETITION_EASY, "PM", "SM"),
        (WAYPOINT, "PM", "PHX"),
    ):
        driver = Driver(version)
        assert driver.at(first).act(policy) == ACTIONS + FIELD_POINTS.index(second)
        reset(driver.state, 0, driver.rules)
        assert driver.act(policy) == ACTIONS + FIELD_POINTS.index(first)


def test_points_are_those_of_the_action():
    """In 2024 the points stay where they are in a field of another size: for both teams 160 x 80 m from the corner."""
    for team, (x, y) in enumerate([(80.0, 60.0), (80.0, 20.0)]):
        driver = Driver("2024", team, world_size_m=(200.0, 100.0))
        step(driver.put(team, x, y).state, 0, np.array([SC, SC]), driver.rules)
        assert driver.state.command[0, :, 0].tolist() == ([0.0, 1.5] if team == 0 else [1.5, 0.0])  # it is there
        assert driver.put(team, x, y + 2.6).act(ATTACK_COMPETITION_EASY) == SC
        assert driver.put(team, x, y + 2.4).act(ATTACK_COMPETITION_EASY) == CFX


@every_version
@every_team
@pytest.mark.parametrize("policy", [ATTACK_COMPETITION_EASY, WAYPOINT])
def test_they_bring_the_flag_home(version, team, policy):
    driver = Driver(version, team, substeps=10, max_time_s=600.0, max_score=9)
    actions = np.zeros(2, np.int64)
    for _ in range(400):
        actions[team] = driver.act(policy)
        actions[1 - team] = driver.act(NOTHING)
        step(driver.state, 0, actions, driver.rules)
    assert driver.state.score[0, team, [GRABS, CAPTURES]].min() >= 1
