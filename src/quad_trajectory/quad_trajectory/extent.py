"""What a planned trajectory covers, sampled: for the checks before a flight."""

import math
from types import ModuleType
from typing import Any

from quad_core.extent import Extent
from quad_core.geometry import norm
from quad_core.types import Vec3

_SAMPLES = 400


def extent_of(module: ModuleType, parameters: Any, plan: Any, length: float, gravity: float) -> Extent:
    """Return what ``plan`` of a trajectory plug-in covers in its ``length`` s, at 400 instants; gravity in m/s^2."""
    points = [module.sample(parameters, plan, length * index / _SAMPLES) for index in range(_SAMPLES)]
    low, high = (Vec3(*map(side, zip(*(point.p_w for point in points), strict=True))) for side in (min, max))
    return Extent(
        low,
        high,
        max(norm(point.v_w) for point in points),
        max(norm(point.a_w) for point in points),
        max(math.atan2(math.hypot(point.a_w.x, point.a_w.y), gravity + point.a_w.z) for point in points),
        length,
    )
