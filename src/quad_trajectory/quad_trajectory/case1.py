"""Case 1 of the paper: a square of 10 m flown at 0.5 m/s, yaw pi/3 then 0 (eqs. 61-64).

Eq. 61 prints ``0 <= x < 40``; x is t (eq. 65 has it right). Velocity steps at the corners, as printed.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Real
from quad_core.types import TrajectoryPoint
from quad_trajectory.approach import Approach, Entry, Start, entered
from quad_trajectory.limits import MotionLimits, YawShaping, yaw_turn
from quad_trajectory.polynomial import AxisPoint, point

Plan = Approach


class Parameters(NamedTuple):
    """Case 1: how it is entered, how long and how large it is flown."""

    start: Entry = Start.APPROACH.value
    duration: Annotated[float, Real("s", "flight time from t = 0", 0.01, 1e5, "eqs. 61-64")] = 80.0
    position_scale: Annotated[float, Real("", "factor on all lengths", 0.001, 100.0, "eqs. 62-64")] = 1.0
    time_scale: Annotated[float, Real("", "factor on all times; 2 is half as fast", 0.01, 100.0, "")] = 1.0
    yaw_shaping: Annotated[
        int, Choice(YawShaping, "smooth: a turn within the yaw limits; printed: steps", "Eq. 61")
    ] = YawShaping.SMOOTH.value
    limits: MotionLimits = MotionLimits()


def curve(parameters: Parameters, t: float) -> TrajectoryPoint:
    """Return the point of eqs. 61-64 at ``t`` s >= 0, yaw shaped; at rest from the end of the square on."""
    x, y = square(t / parameters.time_scale)
    length = parameters.position_scale
    speed = length / parameters.time_scale
    return point(
        t,
        AxisPoint(length * x.p, speed * x.v, 0.0, 0.0, 0.0),
        AxisPoint(length * y.p, speed * y.v, 0.0, 0.0, 0.0),
        AxisPoint(length * 11.0, 0.0, 0.0, 0.0, 0.0),
        yaw_turn(parameters.limits, parameters.yaw_shaping, math.pi / 3.0, 0.0, t - 40.0 * parameters.time_scale),
    )


def square(t: float) -> tuple[AxisPoint, AxisPoint]:
    """Return x and y of eqs. 62 and 63 at ``t`` s >= 0; at rest from 80 s on."""
    if t < 20.0:
        return AxisPoint(5.0 + 0.5 * t, 0.5, 0.0, 0.0, 0.0), AxisPoint(5.0, 0.0, 0.0, 0.0, 0.0)
    if t < 40.0:
        return AxisPoint(15.0, 0.0, 0.0, 0.0, 0.0), AxisPoint(5.0 + 0.5 * (t - 20.0), 0.5, 0.0, 0.0, 0.0)
    if t < 60.0:
        return AxisPoint(15.0 - 0.5 * (t - 40.0), -0.5, 0.0, 0.0, 0.0), AxisPoint(15.0, 0.0, 0.0, 0.0, 0.0)
    if t < 80.0:
        return AxisPoint(5.0, 0.0, 0.0, 0.0, 0.0), AxisPoint(15.0 - 0.5 * (t - 60.0), -0.5, 0.0, 0.0, 0.0)
    return AxisPoint(5.0, 0.0, 0.0, 0.0, 0.0), AxisPoint(5.0, 0.0, 0.0, 0.0, 0.0)


plan, duration, sample = entered(curve)
