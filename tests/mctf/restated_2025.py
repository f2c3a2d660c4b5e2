"""The rules of the Pyquaticus of November 2025, stated once more: an oracle for the compiled kernels.

Plain lists, double precision, one vehicle after another and no care for time. It was written from a description of the
rules and shares nothing with the kernels, so both have a mistake only if both misread the same sentence.

Metres, seconds, m/s; degrees clockwise from north (+y), wrapped to [-180, 180]. Blue is on the left, vehicles 0 to n-1;
red is on the right, n to 2n-1. A number ``v`` is a vehicle, a number ``t`` a team.
"""

import math
from dataclasses import dataclass, field

import numpy as np

BLUE, RED = 0, 1
CAPTURES, TAGS, GRABS = 0, 1, 2
TURNS = (180.0, 135.0, 90.0, 45.0, 0.0, -45.0, -90.0, -135.0)
KEEPOUT_MARGIN = 0.1


@dataclass(frozen=True)
class Hull:
    """Dynamics of a vehicle: limits, the speed held at a thrust, and the gains of its two controllers."""

    max_speed: float
    thrusts: tuple[float, ...]
    speeds: tuple[float, ...]
    turn_rate: float
    max_acc: float
    max_dec: float
    speed_gain: float
    heading_gain: float
    heading_rate_gain: float
    max_thrust: float = 100.0
    max_rudder: float = 100.0
    turn_loss: float = 0.85


HULLS = {
    "heron": Hull(2.0, (0, 40, 100), (0, 1, 2), 60.0, math.inf, 0.5, 1.0, 0.9, 0.6),
    "surveyor": Hull(3.0, (-100, 0, 20, 40, 60, 70, 100), (-2, 0, 1, 1.5, 2, 2.25, 3), 10.0, 0.15, 0.25, 0.5, 1.2, 3.0),
}


@dataclass(frozen=True)
class Settings:
    """What may differ between two games."""

    team_size: int = 2
    width: float = 160.0
    height: float = 80.0
    dynamics: str = "heron"
    substeps: int = 1
    tau: float = 0.1
    agent_radius: float = 2.0
    catch_radius: float = 10.0
    flag_keepout: float = 3.0
    tagging_cooldown: float = 60.0
    max_time: float = 600.0
    max_score: int = 20
    tag_on_oob: bool = True
    oob_speed_share: float = 0.5

    @property
    def hull(self):
        return HULLS[self.dynamics]

    @property
    def homes(self):
        """Flag homes of blue and red."""
        return [(self.width / 8, self.height / 2), (7 * self.width / 8, self.height / 2)]


@dataclass
class Vehicle:
    """``heading_error_prev`` is None until the heading controller is called for the first time."""

    team: int
    pos: tuple[float, float]
    heading: float
    cooldown: float
    prev_pos: tuple[float, float]
    on_own_side: bool
    speed: float = 0.0
    thrust: float = 0.0
    heading_error_prev: float | None = None
    has_flag: bool = False
    is_tagged: bool = False
    oob: bool = False
    collisions: int = 0
    made_tag: int | None = None  # whom it tagged in the last step


@dataclass
class Flag:
    """``home`` is fixed; ``pos`` is the carrier's position while the flag is ``taken``."""

    home: tuple[float, float]
    pos: tuple[float, float]
    taken: bool = False

    def go_home(self):
        self.pos, self.taken = self.home, False


def wrap(degrees):
    while degrees > 180:
        degrees -= 360
    while degrees < -180:
        degrees += 360
    return degrees


def heading_of(x, y):
    """Returns the heading of a vector; 90 for none."""
    return wrap((90 - math.degrees(math.atan2(y, x))) % 360)


def bearing(vehicle, point):
    """Returns the direction of a point as seen from the bow."""
    towards = heading_of(point[0] - vehicle.pos[0], point[1] - vehicle.pos[1])
    return wrap((towards - vehicle.heading) % 360)


def clip(value, low, high):
    return min(max(value, low), high)


def nearest_on(a, b, p):
    """Returns the point of the segment from a to b that is nearest to p."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    share = clip(((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy), 0.0, 1.0)
    return a[0] + share * dx, a[1] + share * dy


def field_points(settings):
    """Returns the 45 named points as blue sees them; for red all is turned by 180 degrees."""
    columns = {"PP": 1.0, "P": 0.75, "C": 0.5, "S": 0.25, "SS": 0.0}
    rows = ("B", "F", "H", "M", "C", "MX", "HX", "FX", "BX")
    return {
        column + row: (i / 8 * settings.width, share * settings.height)
        for column, share in columns.items()
        for i, row in enumerate(rows)
    }


def start_is_allowed(settings, team, pos, earlier):
    """Whether a vehicle may start at ``pos`` on its own half when ``earlier`` holds the positions before it."""
    x, y = pos
    r = settings.agent_radius
    inside = r < x < settings.width - r and r < y < settings.height - r
    own_side = x <= settings.width / 2 if team == BLUE else x >= settings.width / 2
    clear_of_flags = all(math.dist(pos, home) > settings.flag_keepout for home in settings.homes)
    return inside and own_side and clear_of_flags and all(math.dist(pos, other) > 2 * r for other in earlier)


@dataclass
class Game:
    """One game. Set any attribute of ``vehicles`` and ``flags``, ``step``, and read them again."""

    settings: Settings
    vehicles: list[Vehicle] = field(default_factory=list)
    flags: list[Flag] = field(default_factory=list)
    score: list[list[int]] = field(default_factory=list)
    collisions: list[int] = field(default_factory=list)
    contacts: set[tuple[int, int]] = field(default_factory=set)
    time: float = 0.0
    done: dict[str, bool] = field(default_factory=dict)

    def __post_init__(self):
        self.reset()

    def reset(self):
        """Puts everybody at the start; the heading controllers keep their memory, as nothing ever resets it."""
        s = self.settings
        memory = [vehicle.heading_error_prev for vehicle in self.vehicles] or [None] * (2 * s.team_size)
        self.vehicles = []
        for v, error in enumerate(memory):
            team, place = divmod(v, s.team_size)
            pos = ((5, 11)[team] * s.width / 16, s.height - s.height * (place + 1) / (s.team_size + 1))
            start = Vehicle(team, pos, (90.0, -90.0)[team], s.tagging_cooldown, pos, True)
            start.heading_error_prev = error
            self.vehicles.append(start)
        self.flags = [Flag(home, home) for home in s.homes]
        self.score = [[0, 0, 0], [0, 0, 0]]
        self.collisions, self.contacts = [0, 0], set()
        self.time, self.done = 0.0, {"blue": False, "red": False, "all": False}
        self.begin()

    def begin(self):
        """Evaluates what a reset evaluates once the vehicles are placed."""
        self._grab()
        self._tag()
        self._untag()

    def step(self, actions):
        """Plays one environment step.

        ``actions`` has an entry for each vehicle: 0 to 16 or -1, (m/s, degrees), the name of a field point, or None.
        """
        s = self.settings
        for vehicle in self.vehicles:
            if vehicle.cooldown != s.tagging_cooldown:
                vehicle.cooldown = min(vehicle.cooldown + s.substeps * s.tau, s.tagging_cooldown)
        commands = [self._command(vehicle, action) for vehicle, action in zip(self.vehicles, actions, strict=True)]
        for _ in range(s.substeps):
            for vehicle, command in zip(self.vehicles, commands, strict=True):
                self._substep(vehicle, command)
        self.time += s.substeps * s.tau
        self._leave_field()
        self._grab()
        self._tag()
        self._capture()
        self._untag()
        self._end()
        self._collide()

    # Commands: wanted speed and heading error, which is held for all sub-steps.

    def _command(self, vehicle, action):
        if action is None:
            return 0.0, 0.0
        if isinstance(action, str):
            return self._to_field_point(vehicle, action)
        if isinstance(action, tuple | list):
            return action[0], action[1]
        if action in (-1, 16):
            return 0.0, 0.0
        return (1.0, 0.5)[action // 8] * self.settings.hull.max_speed, TURNS[action % 8]

    def _to_field_point(self, vehicle, name):
        s = self.settings
        x, y = field_points(s)[name]
        if vehicle.team == RED:
            x, y = s.width - x, s.height - y
        there = math.dist(vehicle.pos, (x, y)) <= s.agent_radius
        return (0.0 if there else s.hull.max_speed), bearing(vehicle, (x, y))

    # One sub-step of one vehicle.

    def _substep(self, vehicle, command):
        s = self.settings
        middle = s.width / 2
        vehicle.on_own_side = vehicle.pos[0] <= middle if vehicle.team == BLUE else vehicle.pos[0] >= middle
        if vehicle.is_tagged:
            share = s.oob_speed_share if vehicle.oob else 1.0
            command = share * s.hull.max_speed, bearing(vehicle, self.flags[vehicle.team].home)
        elif vehicle.oob:
            command = s.oob_speed_share * s.hull.max_speed, wrap((self._inward(vehicle.pos) - vehicle.heading) % 360)
        self._drive(vehicle, *command)
        self._keep_out(vehicle)
        if vehicle.has_flag:
            self.flags[1 - vehicle.team].pos = vehicle.pos

    def _inward(self, pos):
        """Returns the heading away from the nearest edge; bottom, right, top, left come first in this order."""
        w, h = self.settings.width, self.settings.height
        corners = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)]
        gaps = [math.dist(pos, nearest_on(corners[i], corners[(i + 1) % 4], pos)) for i in range(4)]
        return (0.0, -90.0, 180.0, 90.0)[gaps.index(min(gaps))]

    def _drive(self, vehicle, wanted_speed, heading_error):
        s, hull = self.settings, self.settings.hull
        push = clip(hull.speed_gain * (wanted_speed - vehicle.speed), -hull.max_thrust, hull.max_thrust)
        thrust = vehicle.thrust + push
        thrust = 0.0 if thrust < 0.01 else clip(thrust, -hull.max_thrust, hull.max_thrust)
        rudder = self._rudder(vehicle, heading_error) if thrust > 0 else 0.0
        speed = float(np.interp(thrust, hull.thrusts, hull.speeds)) * (1 - hull.turn_loss * abs(rudder) / 100)
        if (speed - vehicle.speed) / s.tau > hull.max_acc:
            speed = vehicle.speed + hull.max_acc * s.tau
        elif (vehicle.speed - speed) / s.tau > hull.max_dec:
            speed = vehicle.speed - hull.max_dec * s.tau
        turn = 0.0 if speed == 0 else rudder * hull.turn_rate / 100 * s.tau * abs(thrust) / 50
        heading = wrap(vehicle.heading + turn)
        mean_speed = (speed + vehicle.speed) / 2
        old, new = math.radians(vehicle.heading), math.radians(heading)
        course = math.atan2(math.sin(new) + math.sin(old), math.cos(new) + math.cos(old))
        x, y = vehicle.prev_pos = vehicle.pos
        vehicle.pos = (x + mean_speed * math.sin(course) * s.tau, y + mean_speed * math.cos(course) * s.tau)
        vehicle.speed = clip(mean_speed, 0.0, hull.max_speed)  # the mean is kept, not the new speed
        vehicle.heading, vehicle.thrust = heading, thrust

    def _rudder(self, vehicle, error):
        hull = self.settings.hull
        previous = error if vehicle.heading_error_prev is None else vehicle.heading_error_prev
        vehicle.heading_error_prev = error
        rudder = hull.heading_gain * error + hull.heading_rate_gain * (error - previous) / self.settings.tau
        return clip(rudder, -hull.max_rudder, hull.max_rudder)

    def _keep_out(self, vehicle):
        s, flag = self.settings, self.flags[vehicle.team]
        radius = s.flag_keepout + s.agent_radius
        if s.flag_keepout <= 0 or flag.taken or not math.dist(vehicle.pos, flag.home) < radius:
            return
        x, y = vehicle.pos[0] - flag.home[0], vehicle.pos[1] - flag.home[1]
        back_x, back_y = vehicle.prev_pos[0] - vehicle.pos[0], vehicle.prev_pos[1] - vehicle.pos[1]
        if back_x == 0 and back_y == 0:
            back_x, back_y = x, y
        length = math.hypot(back_x, back_y)
        back_x, back_y = back_x / length, back_y / length
        along = x * back_x + y * back_y
        way = -along + math.sqrt(along**2 - (x * x + y * y) + (radius + KEEPOUT_MARGIN) ** 2)
        x, y = x + way * back_x, y + way * back_y
        vehicle.pos = (flag.home[0] + x, flag.home[1] + y)
        course, size = math.radians(vehicle.heading), math.hypot(x, y)
        tangent_x, tangent_y = y / size, -x / size
        slide = vehicle.speed * (math.sin(course) * tangent_x + math.cos(course) * tangent_y)
        vehicle.speed = abs(slide)
        vehicle.heading = heading_of(slide * tangent_x, slide * tangent_y)

    # Events, once in a step.

    def _drop_flag(self, vehicle):
        if vehicle.has_flag:
            vehicle.has_flag = False
            self.flags[1 - vehicle.team].go_home()

    def _leave_field(self):
        for vehicle in self.vehicles:
            x, y = vehicle.pos
            vehicle.oob = not (0 < x < self.settings.width and 0 < y < self.settings.height)
            if vehicle.oob:
                vehicle.is_tagged = vehicle.is_tagged or self.settings.tag_on_oob
                self._drop_flag(vehicle)

    def _grab(self):
        for vehicle in self.vehicles:
            flag = self.flags[1 - vehicle.team]
            free = not (vehicle.has_flag or flag.taken or vehicle.on_own_side or vehicle.is_tagged)
            if free and math.dist(vehicle.pos, flag.pos) < self.settings.catch_radius:
                vehicle.has_flag = flag.taken = True
                flag.pos = vehicle.pos
                self.score[vehicle.team][GRABS] += 1

    def _tag(self):
        s = self.settings
        for vehicle in self.vehicles:
            vehicle.made_tag = None
        for vehicle in self.vehicles:
            ready = vehicle.on_own_side and not vehicle.oob and not vehicle.is_tagged
            if not ready or vehicle.cooldown != s.tagging_cooldown:
                continue
            for v, other in enumerate(self.vehicles):
                intruder = other.team != vehicle.team and not other.on_own_side and not other.is_tagged
                if intruder and math.dist(vehicle.pos, other.pos) < s.catch_radius:
                    other.is_tagged = True
                    self._drop_flag(other)
                    vehicle.cooldown, vehicle.made_tag = 0.0, v
                    self.score[vehicle.team][TAGS] += 1
                    break

    def _capture(self):
        for vehicle in self.vehicles:
            if vehicle.on_own_side and vehicle.has_flag:
                self._drop_flag(vehicle)
                self.score[vehicle.team][CAPTURES] += 1

    def _untag(self):
        for vehicle in self.vehicles:
            if math.dist(vehicle.pos, self.flags[vehicle.team].home) < self.settings.catch_radius:
                vehicle.is_tagged = False

    def _end(self):
        s = self.settings
        blue, red = (self.score[t][CAPTURES] for t in (BLUE, RED))
        if s.max_score in (blue, red):  # a tie is red's
            self.done["red" if red == s.max_score else "blue"] = self.done["all"] = True
        elif self.time > s.max_time or abs(self.time - s.max_time) <= 1e-8 + 1e-5 * s.max_time:
            self.done["all"] = True

    def _collide(self):
        touching = set()
        for v, one in enumerate(self.vehicles):
            for w, other in enumerate(self.vehicles[:v]):
                if math.dist(one.pos, other.pos) <= 2 * self.settings.agent_radius:
                    touching.add((w, v))
        for pair in touching - self.contacts:
            for v in pair:
                self.vehicles[v].collisions += 1
                self.collisions[self.vehicles[v].team] += 1
        self.contacts = touching

    # What a vehicle sees.

    def observe(self, v):
        """Returns the 13 + 16 n numbers of vehicle ``v``, unscaled."""
        me = self.vehicles[v]
        s, opponents = self.settings, 1 - me.team
        targets = [self.flags[opponents].home, self.flags[me.team].home]
        targets += [nearest_on(*wall, me.pos) for wall in self._walls(me.team)]
        targets.append(nearest_on((s.width / 2, 0.0), (s.width / 2, s.height), me.pos))
        seen = [number for point in targets for number in (bearing(me, point), math.dist(me.pos, point))]
        seen += self._status(me)
        seen += [self.score[me.team][CAPTURES], self.score[opponents][CAPTURES]]
        for team in (me.team, opponents):
            for other in self.vehicles:
                if other.team == team and other is not me:
                    seen += self._sight(me, other)
        return [float(number) for number in seen]

    def observe_scaled(self, v):
        """Returns the numbers of ``observe`` scaled to [-1, 1] and clipped."""
        s = self.settings
        far = math.hypot(s.width, s.height)
        status = [(0.0, s.hull.max_speed), (0.0, 1.0), (0.0, 1.0), (0.0, s.tagging_cooldown), (0.0, 1.0)]
        ranges = 7 * [(-180.0, 180.0), (0.0, far)] + status + 2 * [(0.0, s.max_score)]
        ranges += (2 * s.team_size - 1) * [(-180.0, 180.0), (0.0, far), (-180.0, 180.0), *status]
        scaled = [
            (number - (low + high) / 2) / ((high - low) / 2)
            for number, (low, high) in zip(self.observe(v), ranges, strict=True)
        ]
        return [clip(number, -1.0, 1.0) for number in scaled]

    def _walls(self, team):
        """Returns the four walls in the order in which the team numbers them; wall 1 is behind its own flag."""
        w, h = self.settings.width, self.settings.height
        top, right = ((0.0, h), (w, h)), ((w, h), (w, 0.0))
        bottom, left = ((w, 0.0), (0.0, 0.0)), ((0.0, 0.0), (0.0, h))
        return [bottom, left, top, right] if team == BLUE else [top, right, bottom, left]

    def _status(self, vehicle):
        return [vehicle.speed, vehicle.has_flag, vehicle.on_own_side, vehicle.cooldown, vehicle.is_tagged]

    def _sight(self, me, other):
        from_other = heading_of(me.pos[0] - other.pos[0], me.pos[1] - other.pos[1])
        aspect = wrap((other.heading - from_other) % 360)
        return [bearing(me, other.pos), math.dist(me.pos, other.pos), aspect, *self._status(other)]
