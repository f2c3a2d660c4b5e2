"""The numbers and switches of one kind of game, as the kernels read them.

``make_rules`` is the border: what it returns is valid, and no kernel checks it again.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mctf.profiles import PROFILES, WORDS
from mctf.words import check_word, did_you_mean

ACTIONS = 17
"""Number of discrete actions: 8 turns at full speed, 8 at half speed, and stop."""

BLUE, RED = 0, 1
"""Teams. Blue has the first vehicles, red the others."""

HERON_2024, HERON, SURVEYOR = range(3)
STARTS_QUARTER, STARTS_MIDWAY, STARTS_RANDOM = range(3)
POLICIES_2024, POLICIES_REPAIRED, POLICIES_2025 = range(3)
"""Numbers of the words of ``dynamics``, ``starts`` and ``policy_version``; of the others the first word is True."""

MAX_SPEED = {"heron_2024": 1.5, "heron": 2.0, "surveyor": 3.0}
"""m/s, of each of the ``dynamics``."""
LARGEST_TEAM = 512


class Rules(NamedTuple):
    """Constants of a game; plain numbers, so that a compiled kernel takes them as one argument.

    Attributes:
        blue_size: vehicles 0..blue_size-1 are blue.
        red_size: the vehicles behind them are red.
        width_m: extent of the field in x.
        height_m: extent of the field in y.
        blue_home_m: x and y of the home of blue's flag.
        red_home_m: of red's.
        agent_radius_m: size of a vehicle: its distance from a wall that makes it bounce.
        catch_radius_m: nearer than this a flag is grabbed and an opponent tagged.
        untag_radius_m: nearer than this to the own flag's home a tagged vehicle is free again.
        flag_keepout_m: a vehicle is pushed out of this circle around its own flag; 0 for none.
        max_speed: m/s.
        tau_s: length of a sub-step.
        substeps: k, sub-steps of an environment step.
        max_time_s: the game is over when its clock reaches this.
        max_score: captures that win the game.
        tagging_cooldown_s: time from a tag to the next one of the same vehicle.
        dynamics: HERON_2024, HERON or SURVEYOR: how a vehicle answers its controllers.
        accel_overshoots: an acceleration above the vehicle's is increased instead of limited.
        turn_loss_subtracts: the rudder takes speed away in m/s instead of as a share of the speed.
        reverse_steering: a vehicle that brakes with negative thrust turns the wrong way.
        speed_is_mean: the speed kept is the mean of old and new, which smooths it.
        first_kick: the heading controller takes the error before its first call for 0, and kicks.
        pid_reset: a reset forgets the controllers' memory, as a new environment object did.
        float32: rounds where the original computed in single precision.
        fixed_action_speeds: actions are 1.5 and 0.75 m/s; else ``max_speed`` and half of it.
        missing_action_turns: who gets no action brakes and turns by its absolute heading; else it stops.
        blue_right: blue has the right half.
        starts: STARTS_QUARTER, STARTS_MIDWAY or STARTS_RANDOM.
        bounces: a vehicle at a wall is turned round; else it drives back on its own at half speed.
        oob_counts_as_tag: a wall hit counts as a tag of the opponents' team.
        wall_tags: whoever hits a wall is tagged.
        keepout_before: the keep-out circle is tested before a move; else after it, and with ``agent_radius_m`` more.
        stale_side: the own-side test of a step's events is one sub-step old.
        grab_from_own_side: a flag may be grabbed from the own half.
        tag_at_zero: a vehicle at the very same place is tagged too.
        oob_may_tag: a vehicle out of bounds tags.
        capture_first_only: of several carriers home in one step only the lowest number scores.
        tie_is_reds: red wins if both have ``max_score``; else it is a draw.
        clock_overruns: the clock, a sum of rounded numbers, must reach ``max_time_s``, which may take a step more.
        obs_margin_m: what the range of observed distances has above the field's diagonal.
        obs_line_half: the range of the distance to the middle line is half the width; else the diagonal.
        obs_clipped: normalised observations are cut to [-1, 1].
        field_points_fixed: field points are those of a field of 160 x 80 m; else of this one.
        field_point_reach_m: nearer than this to its field point a vehicle stops.
        policy_version: POLICIES_2024, POLICIES_REPAIRED or POLICIES_2025.
    """

    blue_size: int
    red_size: int
    width_m: float
    height_m: float
    blue_home_m: tuple[float, float]
    red_home_m: tuple[float, float]
    agent_radius_m: float
    catch_radius_m: float
    untag_radius_m: float
    flag_keepout_m: float
    max_speed: float
    tau_s: float
    substeps: int
    max_time_s: float
    max_score: int
    tagging_cooldown_s: float
    dynamics: int
    accel_overshoots: bool
    turn_loss_subtracts: bool
    reverse_steering: bool
    speed_is_mean: bool
    first_kick: bool
    pid_reset: bool
    float32: bool
    fixed_action_speeds: bool
    missing_action_turns: bool
    blue_right: bool
    starts: int
    bounces: bool
    oob_counts_as_tag: bool
    wall_tags: bool
    keepout_before: bool
    stale_side: bool
    grab_from_own_side: bool
    tag_at_zero: bool
    oob_may_tag: bool
    capture_first_only: bool
    tie_is_reds: bool
    clock_overruns: bool
    obs_margin_m: float
    obs_line_half: bool
    obs_clipped: bool
    field_points_fixed: bool
    field_point_reach_m: float
    policy_version: int


def make_rules(
    profile: str = "pyquaticus-2024-06",
    team_size: int | Sequence[int] = 2,
    flag_homes_m: Sequence[Sequence[float]] | None = None,
    max_speed: float | None = None,
    untag_radius_m: float | None = None,
    **given: Any,
) -> Rules:
    """Returns checked rules: those of a profile, but for what is given.

    Args:
        profile: one of ``profiles.PROFILES``.
        team_size: vehicles of a team, or of blue and of red.
        flag_homes_m: (x, y) of blue's and of red's flag; None for an eighth of the width from the wall behind it.
        max_speed: m/s; None for that of the vehicle, ``MAX_SPEED``.
        untag_radius_m: None for the catch radius, and for ``untag_at_keepout`` 1 m more than the circle that keeps a
            vehicle out, if that is larger.
        **given: other entries of ``profiles.PROFILES``, described there and at ``Rules``; None for the profile's.

    Raises:
        ValueError: an argument is not allowed; the message names it, what is allowed and what was given.
    """
    check_word("profile", profile, PROFILES)
    unknown = [name for name in given if name not in PROFILES[profile]]
    if unknown:
        raise ValueError(f"{unknown[0]} is no rule.{did_you_mean(unknown[0], PROFILES[profile])}")
    settings = dict(PROFILES[profile]) | {name: value for name, value in given.items() if value is not None}
    numbers = _numbers(settings)
    words = {name: _word(name, settings[name]) for name in WORDS}
    first = {name: number == 0 for name, number in words.items()}
    switches = {
        name: _switch(name, settings[name]) for name, value in PROFILES[profile].items() if isinstance(value, bool)
    }
    numbers["max_speed"] = MAX_SPEED[settings["dynamics"]] if max_speed is None else _number("max_speed", max_speed)
    width, height = _pair("world_size_m", settings["world_size_m"], "width and height")
    margin = _margin(numbers["agent_radius_m"], numbers["flag_keepout_m"])
    _check_field(width, height, margin)
    if untag_radius_m is None:
        untag_radius_m = numbers["catch_radius_m"]
        if switches["untag_at_keepout"]:
            wider = 0.0 if first["keepout_rule"] else numbers["agent_radius_m"]
            untag_radius_m = max(untag_radius_m, numbers["flag_keepout_m"] + wider + 1.0)
    if numbers["catch_radius_m"] >= width / 2.0:
        raise ValueError(
            f"catch_radius_m must be < {width / 2.0:g}, half of world_size_m[0], but is {numbers['catch_radius_m']:g}."
        )
    sizes = _sizes(team_size)
    if first["wall_rule"] and words["starts"] != STARTS_RANDOM:
        _check_starts(max(sizes), height, numbers["agent_radius_m"])
    left, right = (width / 8.0, height / 2.0), (7.0 * width / 8.0, height / 2.0)
    homes = (right, left) if first["blue_side"] else (left, right)
    if flag_homes_m is not None:
        homes = _homes(flag_homes_m, width, height, margin, first["blue_side"])
    del switches["untag_at_keepout"]
    return Rules(
        blue_size=sizes[0],
        red_size=sizes[1],
        width_m=width,
        height_m=height,
        blue_home_m=homes[0],
        red_home_m=homes[1],
        untag_radius_m=_number("untag_radius_m", untag_radius_m),
        dynamics=words["dynamics"],
        accel_overshoots=first["accel_rule"],
        turn_loss_subtracts=first["turn_loss_rule"],
        fixed_action_speeds=first["action_speed"],
        missing_action_turns=first["missing_action"],
        blue_right=first["blue_side"],
        starts=words["starts"],
        bounces=first["wall_rule"],
        keepout_before=first["keepout_rule"],
        tie_is_reds=first["tie_at_max"],
        obs_line_half=first["obs_line_range"],
        field_points_fixed=first["field_points"],
        policy_version=words["policy_version"],
        **numbers,
        **switches,
    )


def _numbers(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the settings that are one number, checked."""
    may_be_zero = ("agent_radius_m", "flag_keepout_m", "obs_margin_m")
    above_zero = ("catch_radius_m", "tau_s", "max_time_s", "tagging_cooldown_s", "field_point_reach_m")
    numbers: dict[str, Any] = {name: _number(name, settings[name], zero_allowed=True) for name in may_be_zero}
    numbers |= {name: _number(name, settings[name]) for name in above_zero}
    return numbers | {name: _count(name, settings[name]) for name in ("substeps", "max_score")}


def _pair(name: str, value: Any, what: str) -> tuple[float, float]:
    if isinstance(value, str) or not hasattr(value, "__len__") or len(value) != 2:
        raise ValueError(f"{name} must be two numbers, {what}, but is {value!r}.")
    return _number(f"{name}[0]", value[0]), _number(f"{name}[1]", value[1])


def _margin(agent_radius: float, keepout: float) -> float:
    """Returns how far in m a flag's home must be from a wall, so that a vehicle fits between.

    The keep-out circle pushes to 0.1 m outside itself, and that point must be inside the walls on every side.
    """
    return agent_radius + (keepout + 0.1 if keepout > 0 else 0.0)


def _check_field(width: float, height: float, margin: float) -> None:
    for name, extent, homes in (("world_size_m[0]", width, 8), ("world_size_m[1]", height, 2)):
        if not extent / homes > margin:
            raise ValueError(
                f"{name} must be > {homes * margin:g}, {homes} times agent_radius_m and the keep-out circle together "
                f"({margin:g} m), so that a vehicle fits between its flag and the wall, but is {extent:g}."
            )


def _check_starts(size: int, height: float, agent_radius: float) -> None:
    """Checks that nobody starts at a wall: who bounces is put back to where it was, there for ever."""
    if height / (size + 1) < agent_radius:
        largest = math.floor(height / agent_radius) - 1
        raise ValueError(
            f"team_size must be at most {largest}, so that nobody starts within agent_radius_m ({agent_radius:g} m) of "
            f"a wall of a field {height:g} m high, but is {size}. A larger world_size_m, a smaller agent_radius_m or "
            "starts='random' has room for more."
        )


def _homes(
    homes: Any, width: float, height: float, margin: float, blue_right: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    if isinstance(homes, str) or not hasattr(homes, "__len__") or len(homes) != 2:
        raise ValueError(f"flag_homes_m must be two points, of blue's and of red's flag, but is {homes!r}.")
    blue, red = (_pair(f"flag_homes_m[{i}]", home, "x and y") for i, home in enumerate(homes))
    for team, (x, y) in ((BLUE, blue), (RED, red)):
        right = blue_right == (team == BLUE)
        low, high = (width / 2.0, width - margin) if right else (margin, width / 2.0)
        if not (low < x < high and margin < y < height - margin):
            raise ValueError(
                f"flag_homes_m[{team}] must be in the team's half, with room for a vehicle at the walls: "
                f"x in ({low:g}, {high:g}) and y in ({margin:g}, {height - margin:g}), but is ({x:g}, {y:g})."
            )
    return blue, red


def _sizes(team_size: Any) -> tuple[int, int]:
    given = team_size if hasattr(team_size, "__len__") and not isinstance(team_size, str) else (team_size, team_size)
    if len(given) != 2:
        raise ValueError(f"team_size must be one number or two, of blue and of red, but is {team_size!r}.")
    sizes = _count("team_size", given[0]), _count("team_size", given[1])
    if max(sizes) > LARGEST_TEAM:
        raise ValueError(f"team_size must be at most {LARGEST_TEAM}, but is {max(sizes)}.")
    return sizes


def _word(name: str, value: Any) -> int:
    check_word(name, str(value), WORDS[name])  # a version may be given as a number
    return WORDS[name].index(str(value))


def _number(name: str, value: Any, zero_allowed: bool = False) -> float:
    try:
        number = float(value) if not isinstance(value, str | bool) else math.nan
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) or number < 0 or (number == 0 and not zero_allowed):
        allowed = "a finite number >= 0" if zero_allowed else "a finite number > 0"
        raise ValueError(f"{name} must be {allowed}, but is {value!r}.")
    return number


def _count(name: str, value: Any) -> int:
    try:
        count = int(value) if not isinstance(value, str | bool) else 0
    except (TypeError, ValueError, OverflowError):
        count = 0
    if count < 1 or count != value:
        raise ValueError(f"{name} must be a whole number >= 1, but is {value!r}.")
    return count


def _switch(name: str, value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} must be True or False, but is {value!r}.")
    return bool(value)
