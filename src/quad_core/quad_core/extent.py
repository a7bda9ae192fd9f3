"""What a planned trajectory covers: the trajectory says it, arming judges it; and when a vehicle cannot follow one."""

from typing import NamedTuple

from quad_core.types import PositionInternals, Vec3

INFEASIBLE_ERROR = 1.0  # m from the reference with the position law at a limit,
INFEASIBLE_TIME = 2.0  # for longer than this, s: it asks for more than the vehicle has
LIMIT_FLAGS = tuple(name for name in PositionInternals._fields if name.endswith("_limited"))


class Extent(NamedTuple):
    """Corners m of the box around it (world frame), largest speed m/s, acceleration m/s^2, tilt rad; duration s."""

    low: Vec3
    high: Vec3
    speed: float
    acceleration: float
    tilt: float
    duration: float
