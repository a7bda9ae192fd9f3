"""Hover: hold one point and heading, reached like any other curve."""

from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO
from quad_core.parameters import Real
from quad_core.types import TrajectoryPoint, Vec3
from quad_trajectory.approach import Approach, Entry, Start, entered
from quad_trajectory.limits import MotionLimits

Plan = Approach


class Position(NamedTuple):
    """A point of the world."""

    x: Annotated[float, Real("m", "east position", -1e4, 1e4)] = 0.0
    y: Annotated[float, Real("m", "north position", -1e4, 1e4)] = 0.0
    z: Annotated[float, Real("m", "height above the world's origin", -1e4, 1e4)] = 2.0


class Parameters(NamedTuple):
    """Hover: where, with which heading, for how long."""

    start: Entry = Start.APPROACH.value
    duration: Annotated[float, Real("s", "flight time from the end of the approach", 0.01, 1e5, "")] = 20.0
    position: Position = Position()
    yaw: Annotated[float, Real("rad", "heading", -6.3, 6.3, "")] = 0.0
    limits: MotionLimits = MotionLimits()


def curve(parameters: Parameters, t: float) -> TrajectoryPoint:
    """Return the point held; ``t`` in s since the end of the approach."""
    p = parameters.position
    return TrajectoryPoint(t, Vec3(p.x, p.y, p.z), ZERO, ZERO, ZERO, ZERO, parameters.yaw, 0.0, 0.0)


plan, duration, sample = entered(curve)
