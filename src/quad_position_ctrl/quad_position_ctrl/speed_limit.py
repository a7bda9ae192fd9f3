"""The bound on the virtual velocity of Eq. 23: no faster than what can be braked (an addition to the paper).

Far from the reference Eq. 23 asks for a speed in proportion to the distance, so that the vehicle arrives faster than
it can stop, and with bounded thrust never settles. The bound is linear near the reference (Eq. 23 untouched), then
v = sqrt(2 a distance) as for a constant deceleration a, then a constant speed. Source of the shape: the square-root
position controller of the ArduPilot autopilot (AC_PosControl, ``sqrt_controller``).
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Real


class SpeedLimits(NamedTuple):
    """How fast the vehicle may close in on the reference, relative to it (``printed``: out of reach)."""

    max_xy: Annotated[float, Real("m/s", "largest horizontal correction speed; 1e6: off", 0.01, 1e6, "addition")] = 8.0
    max_z: Annotated[float, Real("m/s", "largest vertical correction speed; 1e6: off", 0.01, 1e6, "addition")] = 5.0
    braking_xy: Annotated[
        float, Real("m/s^2", "horizontal deceleration counted on when closing in; 1e6: off", 0.01, 1e6, "addition")
    ] = 3.0
    braking_z: Annotated[
        float, Real("m/s^2", "vertical deceleration counted on when closing in; 1e6: off", 0.01, 1e6, "addition")
    ] = 3.0


class Shortening(NamedTuple):
    """Bounded correction: ``scale`` = bounded/unbounded length (1 = untouched), ``slope`` = its local derivative."""

    scale: float
    slope: float
    limited: bool


class BoundedPair(NamedTuple):
    """Two components of a bounded correction velocity, m/s, and of its time derivative, m/s^2."""

    x: float
    y: float
    rate_x: float
    rate_y: float
    scale: float
    limited: bool


def speed_limit(speed: float, gain: float, braking: float, max_speed: float) -> Shortening:
    """Return how the correction of length ``speed`` >= 0 in m/s is bounded.

    ``gain`` is xi_7 > 0 in 1/s (``speed / gain`` is the distance), ``braking`` > 0 in m/s^2, ``max_speed`` > 0 in m/s.
    """
    linear = braking / gain
    if speed <= linear and speed <= max_speed:
        return Shortening(1.0, 1.0, False)
    bounded = speed
    slope = 1.0
    if speed > linear:
        bounded = math.sqrt(linear * (2.0 * speed - linear))
        slope = linear / bounded
    if bounded > max_speed:
        bounded = max_speed
        slope = 0.0
    return Shortening(bounded / speed, slope, True)


def bounded_pair(
    x: float, y: float, rate_x: float, rate_y: float, gain: float, braking: float, max_speed: float
) -> BoundedPair:
    """Return the correction (x, y) in m/s bounded by its length, and the time derivative of the bounded vector.

    ``rate_x``, ``rate_y`` in m/s^2 are the derivatives of x and y. The direction is kept. A single axis has y = 0.
    """
    speed = math.sqrt(x * x + y * y)
    limit = speed_limit(speed, gain, braking, max_speed)
    if not limit.limited:
        return BoundedPair(x, y, rate_x, rate_y, 1.0, False)
    along_x = x / speed
    along_y = y / speed
    along = along_x * rate_x + along_y * rate_y
    radial = (limit.slope - limit.scale) * along
    return BoundedPair(
        limit.scale * x,
        limit.scale * y,
        limit.scale * rate_x + radial * along_x,
        limit.scale * rate_y + radial * along_y,
        limit.scale,
        True,
    )
