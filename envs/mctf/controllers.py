"""Controllers and hulls: from what is wanted of a vehicle to its thrust, speed and turn in one sub-step."""

from mctf.compiled import part
from mctf.rules import HERON, HERON_2024, Rules

SPEED_FACTOR = 20.0  # thrust per m/s of speed error, of the vehicle of 2024
TURN_LOSS = 0.85
MAX_RUDDER = 100.0
SLOWEST_TURN = 0.5  # m/s; slower than this the vehicle of 2024 does not turn


@part
def speed_from(thrust: float, dynamics: int) -> float:
    """Returns the speed in m/s that ``thrust`` holds, linear between measured points."""
    if dynamics == HERON_2024:
        return heron_2024_speed(thrust)
    return heron_speed(thrust) if dynamics == HERON else surveyor_speed(thrust)


@part
def heron_2024_speed(thrust: float) -> float:
    """Returns m/s: linear between (-100, -2) (0, 0) (60, 3) (80, 5)."""
    if thrust < 0.0:
        return 0.02 * (thrust + 100.0) - 2.0
    if thrust < 20.0:
        return 0.05 * thrust
    if thrust < 40.0:
        return 0.05 * (thrust - 20.0) + 1.0
    if thrust < 60.0:
        return 0.05 * (thrust - 40.0) + 2.0
    return min(0.1 * (thrust - 60.0) + 3.0, 5.0)


@part
def heron_speed(thrust: float) -> float:
    """Returns m/s: linear between (0, 0) (40, 1) (100, 2)."""
    if thrust < 40.0:
        return thrust / 40.0
    return (thrust - 40.0) / 60.0 + 1.0


@part
def surveyor_speed(thrust: float) -> float:
    """Returns m/s: linear between (0, 0) (20, 1) (40, 1.5) (60, 2) (70, 2.25) (100, 3); 0.025 for one from 20 on."""
    if thrust < 20.0:
        return 0.05 * thrust
    return 0.025 * (thrust - 20.0) + 1.0


@part
def heading_gains(dynamics: int) -> tuple[float, float]:
    """Returns proportional and derivative gain of the heading controller."""
    if dynamics == HERON_2024:
        return 0.35, 0.07
    return (0.9, 0.6) if dynamics == HERON else (1.2, 3.0)


@part
def acceleration_limits(dynamics: int) -> tuple[float, float]:
    """Returns largest acceleration and deceleration in m/s²; infinite for none."""
    if dynamics == HERON_2024:
        return 1.0, 1.0
    return (float("inf"), 0.5) if dynamics == HERON else (0.15, 0.25)


@part
def new_thrust(thrust: float, speed_error: float, dynamics: int) -> float:
    """Returns the thrust after one sub-step; it accumulates. Only the vehicle of 2024 thrusts backwards."""
    if dynamics == HERON_2024:
        return min(max(thrust + SPEED_FACTOR * speed_error, -70.0), 70.0)
    thrust += speed_error if dynamics == HERON else 0.5 * speed_error
    return 0.0 if thrust < 0.01 else min(thrust, 100.0)


@part
def rudder_for(error: float, error_prev: float, known: bool, rules: Rules) -> float:
    """Returns the rudder in [-100, 100] for a heading error in deg and the one of the sub-step before."""
    proportional, derivative = heading_gains(rules.dynamics)
    kick = 0.0
    if error != error_prev and (known or rules.first_kick):
        kick = derivative * ((error - error_prev) / rules.tau_s)
    return min(max(proportional * error + kick, -MAX_RUDDER), MAX_RUDDER)


@part
def new_speed_of(thrust: float, rudder: float, speed: float, rules: Rules) -> float:
    """Returns the speed in m/s after one sub-step.

    Args:
        thrust: after this sub-step.
        rudder: in [-100, 100].
        speed: before, m/s.
        rules: the game's constants.
    """
    turn_loss = TURN_LOSS * (abs(rudder) / 100.0)
    held = speed_from(thrust, rules.dynamics)
    new_speed = held - turn_loss if rules.turn_loss_subtracts else held * (1.0 - turn_loss)
    new_speed = min(new_speed, rules.max_speed)
    fastest, hardest = acceleration_limits(rules.dynamics)
    if (new_speed - speed) / rules.tau_s > fastest:
        new_speed = (new_speed if rules.accel_overshoots else speed) + fastest * rules.tau_s
    elif (speed - new_speed) / rules.tau_s > hardest:
        new_speed = (new_speed if rules.accel_overshoots else speed) - hardest * rules.tau_s
    return new_speed


@part
def turn_of(thrust: float, rudder: float, speed: float, new_speed: float, rules: Rules) -> float:
    """Returns the turn in deg, clockwise positive, of one sub-step; arguments as of ``new_speed_of``."""
    if rules.dynamics == HERON_2024:
        if (new_speed + speed) / 2.0 < SLOWEST_TURN:
            return 0.0
        turn = rudder * (70.0 / 100.0) * rules.tau_s * (1.0 + (abs(thrust) - 50.0) / 50.0)
        return -turn if thrust < 0.0 and rules.reverse_steering else turn
    if new_speed == 0.0:
        return 0.0
    rate = 60.0 if rules.dynamics == HERON else 10.0
    return rudder * rate / 100.0 * rules.tau_s * abs(thrust) / 50.0
