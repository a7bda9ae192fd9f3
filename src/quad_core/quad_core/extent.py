"""What a planned trajectory covers: the trajectory says it, arming judges it."""

from typing import NamedTuple

from quad_core.types import Vec3


class Extent(NamedTuple):
    """Corners m of the box around it (world frame), largest speed m/s, acceleration m/s^2, tilt rad; duration s."""

    low: Vec3
    high: Vec3
    speed: float
    acceleration: float
    tilt: float
    duration: float
