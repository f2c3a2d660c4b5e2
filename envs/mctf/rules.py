"""The numbers and switches of one kind of game, as the kernels read them.

``make_rules`` is the border: what it returns is valid, and no kernel checks it again.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

PROFILES = ("pyquaticus-2024-06",)

ACTIONS = 17
"""Number of discrete actions: 8 turns at full speed, 8 at half speed, and stop."""

BLUE, RED = 0, 1
"""Teams. Blue is on the right and has the vehicles 0..n-1, red is on the left with n..2n-1."""


class Rules(NamedTuple):
    """Constants of a game; plain numbers, so that a compiled kernel takes them as one argument.

    Every switch is True where the game is as the original was.

    Attributes:
        team_size: n, vehicles of a team.
        width_m: extent of the field in x.
        height_m: extent of the field in y.
        agent_radius_m: a vehicle bounces when its centre is nearer to a wall than this.
        catch_radius_m: nearer than this a flag is grabbed and an opponent tagged.
        untag_radius_m: nearer than this to the own flag's home a tagged vehicle is free again.
        flag_keepout_m: a vehicle is pushed out of this circle around its own flag; 0 for none.
        max_speed: m/s.
        tau_s: length of a sub-step.
        substeps: k, sub-steps of an environment step.
        max_time_s: the game is over when its clock reaches this.
        max_score: captures that win the game.
        tagging_cooldown_s: time from a tag to the next one of the same vehicle.
        oob_counts_as_tag: a wall hit counts as a tag of the opponents' team.
        accel_overshoots: an acceleration above 1 m/s² is increased instead of limited.
        turn_loss_subtracts: the rudder takes speed away in m/s instead of as a share of the speed.
        stale_side: the own-side test of a step's events is one sub-step old.
        capture_first_only: of several carriers home in one step only the lowest id scores.
        pid_reset: a reset forgets the last heading error, as a new environment object did.
        float32_emulation: rounds where the original computed in single precision.
    """

    team_size: int
    width_m: float
    height_m: float
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
    oob_counts_as_tag: bool
    accel_overshoots: bool
    turn_loss_subtracts: bool
    stale_side: bool
    capture_first_only: bool
    pid_reset: bool
    float32_emulation: bool


def make_rules(
    team_size: int = 2,
    world_size_m: Sequence[float] = (200.0, 100.0),
    flag_keepout_m: float = 5.0,
    catch_radius_m: float = 10.0,
    agent_radius_m: float = 2.0,
    max_speed: float = 1.5,
    tau_s: float = 0.1,
    substeps: int = 10,
    max_time_s: float = 420.0,
    max_score: int = 1,
    tagging_cooldown_s: float = 30.0,
    untag_radius_m: float | None = None,
    oob_counts_as_tag: bool = True,
    accel_overshoots: bool = True,
    turn_loss_subtracts: bool = True,
    stale_side: bool = True,
    capture_first_only: bool = True,
    pid_reset: bool = True,
    float32_emulation: bool = True,
    profile: str = "pyquaticus-2024-06",
) -> Rules:
    """Returns checked rules. Its arguments are those of ``Rules``, described there, except for the following.

    ``world_size_m`` is width and height of the field, ``untag_radius_m`` is None for the catch radius, and
    ``profile`` the version whose behaviour is reproduced, one of ``PROFILES``.

    Raises:
        ValueError: an argument is not allowed; the message names it, what is allowed and what was given.
    """
    if profile not in PROFILES:
        raise ValueError(f"profile must be one of {PROFILES}, but is {profile!r}.")
    if isinstance(world_size_m, str) or not hasattr(world_size_m, "__len__") or len(world_size_m) != 2:
        raise ValueError(f"world_size_m must be two numbers, width and height, but is {world_size_m!r}.")
    agent_radius = _number("agent_radius_m", agent_radius_m, zero_allowed=True)
    catch_radius = _number("catch_radius_m", catch_radius_m)
    keepout = _number("flag_keepout_m", flag_keepout_m, zero_allowed=True)
    width = _number("world_size_m[0]", world_size_m[0])
    height = _number("world_size_m[1]", world_size_m[1])
    # The keep-out circle pushes to 0.1 m outside itself; that point must be inside the walls on every side.
    margin = agent_radius + (keepout + 0.1 if keepout > 0 else 0.0)
    for name, extent, homes in (("world_size_m[0]", width, 8), ("world_size_m[1]", height, 2)):
        if not extent / homes > margin:
            raise ValueError(
                f"{name} must be > {homes * margin:g}, {homes} times agent_radius_m and the keep-out circle, "
                f"so that a vehicle fits between its flag and the wall, but is {extent:g}."
            )
    return Rules(
        team_size=_count("team_size", team_size),
        width_m=width,
        height_m=height,
        agent_radius_m=agent_radius,
        catch_radius_m=catch_radius,
        untag_radius_m=catch_radius if untag_radius_m is None else _number("untag_radius_m", untag_radius_m),
        flag_keepout_m=keepout,
        max_speed=_number("max_speed", max_speed),
        tau_s=_number("tau_s", tau_s),
        substeps=_count("substeps", substeps),
        max_time_s=_number("max_time_s", max_time_s),
        max_score=_count("max_score", max_score),
        tagging_cooldown_s=_number("tagging_cooldown_s", tagging_cooldown_s),
        oob_counts_as_tag=_switch("oob_counts_as_tag", oob_counts_as_tag),
        accel_overshoots=_switch("accel_overshoots", accel_overshoots),
        turn_loss_subtracts=_switch("turn_loss_subtracts", turn_loss_subtracts),
        stale_side=_switch("stale_side", stale_side),
        capture_first_only=_switch("capture_first_only", capture_first_only),
        pid_reset=_switch("pid_reset", pid_reset),
        float32_emulation=_switch("float32_emulation", float32_emulation),
    )


def _number(name: str, value: float, zero_allowed: bool = False) -> float:
    try:
        number = float(value) if not isinstance(value, str | bool) else math.nan
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number) or number < 0 or (number == 0 and not zero_allowed):
        allowed = "a finite number >= 0" if zero_allowed else "a finite number > 0"
        raise ValueError(f"{name} must be {allowed}, but is {value!r}.")
    return number


def _count(name: str, value: int) -> int:
    try:
        count = int(value) if not isinstance(value, str | bool) else 0
    except (TypeError, ValueError, OverflowError):
        count = 0
    if count < 1 or count != value:
        raise ValueError(f"{name} must be a whole number >= 1, but is {value!r}.")
    return count


def _switch(name: str, value: bool) -> bool:
    if value not in (True, False):
        raise ValueError(f"{name} must be True or False, but is {value!r}.")
    return bool(value)
