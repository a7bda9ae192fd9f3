"""What the approach and shaped yaw turns keep within, and which polynomial does first."""

import math
from collections.abc import Callable
from enum import IntEnum
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quad_core.geometry import norm
from quad_core.parameters import Real
from quad_core.types import TrajectoryPoint, VehicleState
from quad_trajectory.polynomial import (
    PEAK_ACCELERATION,
    PEAK_RATE,
    AxisPoint,
    Polynomial,
    Segment,
    axes_at,
    smooth_step,
)


class MotionLimits(NamedTuple):
    """Limits of the approach and of shaped yaw turns.

    Where the start or the curve's first point itself asks for more, the approach may use 1.25 times that.
    """

    speed: Annotated[float, Real("m/s", "speed limit of the approach", 0.01, 100.0)] = 3.0
    acceleration: Annotated[float, Real("m/s^2", "acceleration limit of the approach", 0.01, 100.0)] = 2.5
    jerk: Annotated[float, Real("m/s^3", "jerk limit of the approach", 0.01, 1e4)] = 5.0
    tilt: Annotated[
        float, Real("rad", "tilt limit of the approach: atan(horizontal / vertical specific force)", 0.01, 1.4)
    ] = 0.3
    yaw_rate: Annotated[float, Real("rad/s", "rate limit of shaped yaw turns", 0.01, 20.0)] = 1.0
    yaw_acceleration: Annotated[float, Real("rad/s^2", "acceleration limit of shaped yaw turns", 0.01, 100.0)] = 2.0


class YawShaping(IntEnum):
    """How yaw changes: by a turn within the yaw limits, or by the steps that the paper prints."""

    SMOOTH = 0
    PRINTED = 1


SHORTEST_TURN = 1e-3  # s


def turn_duration(limits: MotionLimits, angle: float) -> float:
    """Return the shortest time in s for a smooth turn by ``angle`` rad within the yaw limits; never 0."""
    by_rate = PEAK_RATE * abs(angle) / limits.yaw_rate
    by_acceleration = math.sqrt(PEAK_ACCELERATION * abs(angle) / limits.yaw_acceleration)
    duration = by_rate if by_rate > by_acceleration else by_acceleration
    return duration if duration > SHORTEST_TURN else SHORTEST_TURN


def yaw_turn(limits: MotionLimits, shaping: int, first: float, last: float, time: float) -> AxisPoint:
    """Return yaw (rad) and its derivatives at ``time`` s after a turn from ``first`` to ``last`` was due.

    ``shaping`` PRINTED: the step of eqs. 61 and 65, derivatives 0. SMOOTH: begins then, within the yaw limits.
    """
    if shaping == YawShaping.PRINTED:
        return AxisPoint(first if time < 0.0 else last, 0.0, 0.0, 0.0, 0.0)
    return smooth_step(first, last, turn_duration(limits, last - first), time)


SAMPLES = 100
BLOCK = 16  # durations that are judged at once
Durations = NDArray[np.float64]
Motion = Callable[[Any], tuple[Polynomial, ...]]

END_MARGIN = 1.25  # factor on what the ends of the approach ask for themselves, where that is above a limit

SAMPLING_MARGIN = 0.995  # factor on the limits, for what lies between two samples


class Allowed(NamedTuple):
    """Limits of a search: speed m/s, acceleration m/s^2, jerk m/s^3, tangent of tilt, gravity m/s^2."""

    speed: float
    acceleration: float
    jerk: float
    tilt_tangent: float
    gravity: float


def allowed_between(limits: MotionLimits, gravity: float, start: VehicleState, first: TrajectoryPoint) -> Allowed:
    """Return ``limits``, raised to END_MARGIN times of what ``start`` and ``first`` themselves ask for."""
    end_speed = max(norm(first.v_w), norm(start.v_w))
    lift = max(0.1 * gravity, gravity + first.a_w.z)
    end_tangent = horizontal(first.a_w.x, first.a_w.y) / lift
    return Allowed(
        max(END_MARGIN * end_speed, limits.speed),
        max(END_MARGIN * norm(first.a_w), limits.acceleration),
        max(END_MARGIN * norm(first.jerk_w), limits.jerk),
        max(END_MARGIN * end_tangent, math.tan(limits.tilt)),
        gravity,
    )


def first_within(allowed: Allowed, durations: Durations, motion: Motion) -> Segment | None:
    """Return the first of the motions that last ``durations`` s which keeps the limits, None if none does.

    ``motion`` gives x, y and z over a duration, or over an array of them.
    """
    for begin in range(0, len(durations), BLOCK):
        block: Any = durations[begin : begin + BLOCK, None]
        good = np.flatnonzero(are_within(allowed, Segment(block, *motion(block))))
        if len(good):
            duration = float(block[good[0], 0])
            return Segment(duration, *motion(duration))
    return None


def are_within(allowed: Allowed, segments: Segment) -> Any:
    """Return whether all samples of each of ``segments`` keep the limits; a number that is not finite keeps none."""
    speed = SAMPLING_MARGIN * allowed.speed
    acceleration = SAMPLING_MARGIN * allowed.acceleration
    jerk = SAMPLING_MARGIN * allowed.jerk
    with np.errstate(all="ignore"):
        times: Any = segments.duration * np.arange(SAMPLES + 1.0) / SAMPLES
        x, y, z = axes_at(segments, times)
        good = x.v * x.v + y.v * y.v + z.v * z.v <= speed * speed
        good &= x.a * x.a + y.a * y.a + z.a * z.a <= acceleration * acceleration
        good &= x.jerk * x.jerk + y.jerk * y.jerk + z.jerk * z.jerk <= jerk * jerk
        good &= np.sqrt(x.a * x.a + y.a * y.a) <= SAMPLING_MARGIN * allowed.tilt_tangent * (allowed.gravity + z.a)
    return good.all(axis=1)


def horizontal(x: float, y: float) -> float:
    """Return the length of the horizontal part of a vector."""
    return math.sqrt(x * x + y * y)
