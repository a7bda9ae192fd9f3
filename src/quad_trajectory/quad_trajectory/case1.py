"""Case 1 of the paper: a square of 10 m flown at 0.5 m/s, yaw pi/3 then 0 (eqs. 61-64).

Eq. 61 prints ``0 <= x < 40``; x is t (eq. 65 has it right). Velocity steps at the corners, as printed.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Choice, Real
from quad_core.types import TrajectoryPoint, VehicleState
from quad_core.vehicle import Vehicle
from quad_trajectory.approach import Approach, held, no_approach, plan_approach, point, sample_approach
from quad_trajectory.limits import PRINTED, SMOOTH, MotionLimits, yaw_turn
from quad_trajectory.polynomial import Motion

Plan = Approach

APPROACH = 0


class Parameters(NamedTuple):
    """Case 1: how it is entered, how long and how large it is flown."""

    start: Annotated[
        int,
        Choice(
            ("approach", "printed"),
            "approach: a smooth way from where the vehicle is; printed: a step to the curve at take-off",
            "eqs. 61-64",
        ),
    ] = APPROACH
    duration: Annotated[float, Real("s", "flight time from t = 0", 0.01, 1e5, "eqs. 61-64", live=False)] = 80.0
    position_scale: Annotated[float, Real("", "factor on all lengths", 0.001, 100.0, "eqs. 62-64", live=False)] = 1.0
    time_scale: Annotated[float, Real("", "factor on all times; 2 is half as fast", 0.01, 100.0, "", live=False)] = 1.0
    yaw_shaping: Annotated[
        int, Choice(("smooth", "printed"), "smooth: a turn within the yaw limits; printed: steps", "Eq. 61")
    ] = SMOOTH
    limits: MotionLimits = MotionLimits()


def plan(parameters: Parameters, vehicle: Vehicle, start: VehicleState) -> Plan:
    """Return how the curve is reached from ``start``."""
    if parameters.start == PRINTED:
        return no_approach()
    return plan_approach(parameters.limits, vehicle.gravity, start, curve(parameters, 0.0))


def duration(parameters: Parameters, plan: Plan) -> float:
    """Return the end of the flight in s since take-off."""
    return plan.duration + parameters.duration


def sample(parameters: Parameters, plan: Plan, time: float) -> TrajectoryPoint:
    """Return the reference at ``time`` s since take-off; at rest on the last point once the flight is over."""
    t = time - plan.duration
    if t < 0.0:
        return sample_approach(plan, time)
    if t >= parameters.duration:
        return held(curve(parameters, parameters.duration), t)
    return curve(parameters, t)


def curve(parameters: Parameters, t: float) -> TrajectoryPoint:
    """Return the point of eqs. 61-64 at ``t`` s >= 0, yaw shaped as told; at rest from the end of the square on."""
    x, y = square(t / parameters.time_scale)
    length = parameters.position_scale
    speed = length / parameters.time_scale
    return point(
        t,
        Motion(length * x.p, speed * x.v, 0.0, 0.0, 0.0),
        Motion(length * y.p, speed * y.v, 0.0, 0.0, 0.0),
        Motion(length * 11.0, 0.0, 0.0, 0.0, 0.0),
        yaw_turn(parameters.limits, parameters.yaw_shaping, math.pi / 3.0, 0.0, t - 40.0 * parameters.time_scale),
    )


def square(t: float) -> tuple[Motion, Motion]:
    """Return x and y of eqs. 62 and 63 at ``t`` s >= 0; at rest from 80 s on."""
    if t < 20.0:
        return Motion(5.0 + 0.5 * t, 0.5, 0.0, 0.0, 0.0), Motion(5.0, 0.0, 0.0, 0.0, 0.0)
    if t < 40.0:
        return Motion(15.0, 0.0, 0.0, 0.0, 0.0), Motion(5.0 + 0.5 * (t - 20.0), 0.5, 0.0, 0.0, 0.0)
    if t < 60.0:
        return Motion(15.0 - 0.5 * (t - 40.0), -0.5, 0.0, 0.0, 0.0), Motion(15.0, 0.0, 0.0, 0.0, 0.0)
    if t < 80.0:
        return Motion(5.0, 0.0, 0.0, 0.0, 0.0), Motion(15.0 - 0.5 * (t - 60.0), -0.5, 0.0, 0.0, 0.0)
    return Motion(5.0, 0.0, 0.0, 0.0, 0.0), Motion(5.0, 0.0, 0.0, 0.0, 0.0)
