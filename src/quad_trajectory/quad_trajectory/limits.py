"""What the approach and shaped yaw turns keep within."""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_trajectory.polynomial import PEAK_ACCELERATION, PEAK_RATE, Motion, smooth_step


class MotionLimits(NamedTuple):
    """Limits of the approach and of shaped yaw turns.

    Where the start or the curve itself asks for more, the approach may use 1.25 times of that.
    """

    speed: Annotated[float, Real("m/s", "speed limit of the approach", 0.01, 100.0, live=False)] = 3.0
    acceleration: Annotated[float, Real("m/s^2", "acceleration limit of the approach", 0.01, 100.0, live=False)] = 2.5
    jerk: Annotated[float, Real("m/s^3", "jerk limit of the approach", 0.01, 1e4, live=False)] = 5.0
    tilt: Annotated[
        float,
        Real("rad", "tilt limit of the approach: atan(horizontal / vertical specific force)", 0.01, 1.4, live=False),
    ] = 0.3
    yaw_rate: Annotated[float, Real("rad/s", "rate limit of shaped yaw turns", 0.01, 20.0, live=False)] = 1.0
    yaw_acceleration: Annotated[
        float, Real("rad/s^2", "acceleration limit of shaped yaw turns", 0.01, 100.0, live=False)
    ] = 2.0


SMOOTH = 0
PRINTED = 1
SHORTEST_TURN = 1e-3


def turn_duration(limits: MotionLimits, angle: float) -> float:
    """Return the shortest time in s for a smooth turn by ``angle`` rad within the yaw limits; never 0."""
    by_rate = PEAK_RATE * abs(angle) / limits.yaw_rate
    by_acceleration = math.sqrt(PEAK_ACCELERATION * abs(angle) / limits.yaw_acceleration)
    duration = by_rate if by_rate > by_acceleration else by_acceleration
    return duration if duration > SHORTEST_TURN else SHORTEST_TURN


def yaw_turn(limits: MotionLimits, shaping: int, low: float, high: float, time: float) -> Motion:
    """Return yaw (rad) and its derivatives at ``time`` s after a turn from ``low`` to ``high`` was due.

    ``shaping`` PRINTED: the step of eqs. 61 and 65, derivatives 0. SMOOTH: begins then, within the yaw limits.
    """
    if shaping == PRINTED:
        return Motion(low if time < 0.0 else high, 0.0, 0.0, 0.0, 0.0)
    return smooth_step(low, high, turn_duration(limits, high - low), time)
