"""Case 2 of the paper: a helix of radius 10 m, 0.5 rad/s and 0.5 m/s climb, yaw pi/3 then 0 (eqs. 65-68)."""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Real
from quad_core.types import TrajectoryPoint
from quad_trajectory.approach import Approach, Entry, Start, entered
from quad_trajectory.limits import MotionLimits, YawShaping, yaw_turn
from quad_trajectory.polynomial import AxisPoint, point

Plan = Approach


class Parameters(NamedTuple):
    """Case 2: how it is entered, how long and how large it is flown."""

    start: Entry = Start.APPROACH.value
    duration: Annotated[float, Real("s", "flight time from t = 0", 0.01, 1e5, "Eq. 65")] = 80.0
    position_scale: Annotated[float, Real("", "factor on all lengths", 0.001, 100.0, "eqs. 66-68")] = 1.0
    time_scale: Annotated[float, Real("", "factor on all times; 2 is half as fast", 0.01, 100.0, "")] = 1.0
    yaw_shaping: Annotated[
        int, Choice(YawShaping, "smooth: a turn within the yaw limits; printed: steps", "Eq. 65")
    ] = YawShaping.SMOOTH.value
    limits: MotionLimits = MotionLimits(6.5, 3.5, 5.0, 0.4, 1.0, 2.0)


def curve(parameters: Parameters, t: float) -> TrajectoryPoint:
    """Return the point of eqs. 65-68 and its derivatives at ``t`` s >= 0, yaw shaped."""
    rate = 0.5 / parameters.time_scale
    rate2 = rate * rate
    radius = 10.0 * parameters.position_scale
    climb = 0.5 * parameters.position_scale / parameters.time_scale
    cosine = radius * math.cos(rate * t)
    sine = radius * math.sin(rate * t)
    return point(
        t,
        AxisPoint(cosine, -rate * sine, -rate2 * cosine, rate * rate2 * sine, rate2 * rate2 * cosine),
        AxisPoint(sine, rate * cosine, -rate2 * sine, -rate * rate2 * cosine, rate2 * rate2 * sine),
        AxisPoint(radius + climb * t, climb, 0.0, 0.0, 0.0),
        yaw_turn(parameters.limits, parameters.yaw_shaping, math.pi / 3.0, 0.0, t - 40.0 * parameters.time_scale),
    )


plan, duration, sample = entered(curve)
