"""Lemniscate of Gerono (a figure of eight) in an inclined plane, with its largest speed at the crossing.

    p(t) = centre + w sin(theta) e_1 + (w / 2) sin(2 theta) e_2,    theta = speed / (sqrt(2) w) t

with half the width w, e_1 along the figure and e_2 across it. The speed is ``speed`` at the crossing, where the
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
    """Lemniscate: how it is entered, how long, how fast, how large, where and in which plane it is flown."""

    start: Entry = Start.APPROACH.value
    duration: Annotated[float, Real("s", "flight time from t = 0", 0.01, 1e5)] = 60.0
    speed: Annotated[float, Real("m/s", "largest speed, at the crossing", 0.01, 100.0)] = 3.0
    half_width: Annotated[float, Real("m", "distance from the crossing to a tip", 0.1, 1000.0)] = 5.0
    centre: Position = Position(0.0, 0.0, 5.0)
    heading: Annotated[float, Real("rad", "direction of the figure's length, from east to north", -6.3, 6.3)] = 0.0
    inclination: Annotated[float, Real("rad", "tilt of its plane about its length; 0: horizontal", -1.6, 1.6, "")] = 0.0
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
    offset = in_plane(parameters, width * sine, 0.5 * width * sine2)
    return TrajectoryPoint(
        t,
        Vec3(centre.x + offset.x, centre.y + offset.y, centre.z + offset.z),
        in_plane(parameters, velocity * cosine, velocity * cosine2),
        in_plane(parameters, -acceleration * sine, -2.0 * acceleration * sine2),
        in_plane(parameters, -jerk * cosine, -4.0 * jerk * cosine2),
        in_plane(parameters, snap * sine, 8.0 * snap * sine2),
        parameters.yaw,
        0.0,
        0.0,
    )


def in_plane(parameters: Parameters, along: float, across: float) -> Vec3:
    """Return ``along`` e_1 + ``across`` e_2 in the world frame."""
    cosine, sine = math.cos(parameters.heading), math.sin(parameters.heading)
    horizontal = across * math.cos(parameters.inclination)
    return Vec3(
        along * cosine - horizontal * sine,
        along * sine + horizontal * cosine,
        across * math.sin(parameters.inclination),
    )


plan, duration, sample = entered(curve)
