"""Lemniscate of Gerono (a level figure of eight along x), with its largest speed at the crossing.

    p(t) = centre + w (sin(theta), sin(2 theta) / 2, 0),    theta = speed / (sqrt(2) w) t

with half the width w. The speed is ``speed`` at the crossing, where the
acceleration is 0, and 1/sqrt(2) of it at the tips. The acceleration is largest between: 17/16 speed^2 / w.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Real
from quad_core.types import TrajectoryPoint, Vec3
from quad_trajectory.approach import Approach, Entry, Start, entered
from quad_trajectory.hover import Position
from quad_trajectory.limits import MotionLimits

Plan = Approach

SQRT_2 = math.sqrt(2.0)


class Parameters(NamedTuple):
    """Lemniscate: how it is entered, how long, how fast, how large and where it is flown."""

    start: Entry = Start.APPROACH.value
    duration: Annotated[float, Real("s", "flight time from t = 0", 0.01, 1e5)] = 60.0
    speed: Annotated[float, Real("m/s", "largest speed, at the crossing", 0.01, 100.0)] = 3.0
    half_width: Annotated[float, Real("m", "distance from the crossing to a tip", 0.1, 1000.0)] = 5.0
    centre: Position = Position(0.0, 0.0, 5.0)
    yaw: Annotated[float, Real("rad", "heading of the vehicle", -6.3, 6.3)] = 0.0
    limits: MotionLimits = MotionLimits()


def curve(parameters: Parameters, t: float) -> TrajectoryPoint:
    """Return the point of the lemniscate and its derivatives at ``t`` s >= 0."""
    width = parameters.half_width
    rate = parameters.speed / (SQRT_2 * width)
    sine, cosine = math.sin(rate * t), math.cos(rate * t)
    sine2, cosine2 = math.sin(2.0 * rate * t), math.cos(2.0 * rate * t)
    velocity = width * rate
    acceleration = velocity * rate
    jerk = acceleration * rate
    snap = jerk * rate
    centre = parameters.centre
    return TrajectoryPoint(
        t,
        Vec3(centre.x + width * sine, centre.y + 0.5 * width * sine2, centre.z),
        Vec3(velocity * cosine, velocity * cosine2, 0.0),
        Vec3(-acceleration * sine, -2.0 * acceleration * sine2, 0.0),
        Vec3(-jerk * cosine, -4.0 * jerk * cosine2, 0.0),
        Vec3(snap * sine, 8.0 * snap * sine2, 0.0),
        parameters.yaw,
        0.0,
        0.0,
    )


plan, duration, sample = entered(curve)
