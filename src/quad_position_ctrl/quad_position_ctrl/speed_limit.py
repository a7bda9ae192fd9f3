"""The bound on the virtual velocity of Eq. 23: no faster than what can be braked (an addition to the paper).

    |v_bounded| = min(|v|, sqrt(2 a d - (a/xi)^2), v_max)      with d = |v|/xi the distance and a the deceleration

Far from the reference Eq. 23 asks for a speed in proportion to the distance, so that the vehicle arrives faster than
it can stop, and with bounded thrust never settles. The bound is linear near the reference (Eq. 23 untouched), then the
speed of a constant deceleration a, then a constant speed. All laws of this package share this text. Source of the
shape: the square-root position controller of the ArduPilot autopilot (AC_PosControl, ``sqrt_controller``).
"""

import math
from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO
from quad_core.parameters import Real
from quad_core.types import Vec3


class SpeedLimits(NamedTuple):
    """How fast the vehicle may close in on the reference, relative to it (``printed``: out of reach)."""

    max_xy: Annotated[float, Real("m/s", "largest horizontal correction speed; 1e6: off", 0.01, 1e6, "addition")] = 8.0
    max_z: Annotated[float, Real("m/s", "largest vertical correction speed; 1e6: off", 0.01, 1e6, "addition")] = 5.0
    braking_xy: Annotated[
        float, Real("m/s^2", "horizontal braking near the goal; larger: later; 1e6: off", 0.01, 1e6, "addition")
    ] = 3.0
    braking_z: Annotated[
        float, Real("m/s^2", "vertical braking near the goal; larger: later; 1e6: off", 0.01, 1e6, "addition")
    ] = 3.0


class Shortening(NamedTuple):
    """Bounded correction: ``scale`` = bounded/unbounded length (1 = untouched), ``slope`` = its local derivative."""

    scale: float
    slope: float
    limited: bool


class AxisCorrection(NamedTuple):
    """A bounded correction along one axis: velocity m/s, its derivative m/s^2, ``scale`` as in ``Shortening``."""

    velocity: float
    rate: float
    scale: float
    limited: bool


class BoundedCorrection(NamedTuple):
    """Velocity towards the reference, bounded in the horizontal plane (x and y together) and along z."""

    x: AxisCorrection
    y: AxisCorrection
    z: AxisCorrection


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
) -> tuple[AxisCorrection, AxisCorrection]:
    """Return the correction (x, y) in m/s bounded by its length, with the time derivative of the bounded vector.

    ``rate_x``, ``rate_y`` in m/s^2 are the derivatives of x and y. The direction is kept. A single axis has y = 0.
    """
    speed = math.sqrt(x * x + y * y)
    limit = speed_limit(speed, gain, braking, max_speed)
    if not limit.limited:
        return AxisCorrection(x, rate_x, 1.0, False), AxisCorrection(y, rate_y, 1.0, False)
    along_x = x / speed
    along_y = y / speed
    along = along_x * rate_x + along_y * rate_y
    radial = (limit.slope - limit.scale) * along
    return (
        AxisCorrection(limit.scale * x, limit.scale * rate_x + radial * along_x, limit.scale, True),
        AxisCorrection(limit.scale * y, limit.scale * rate_y + radial * along_y, limit.scale, True),
    )


def bounded_correction(
    velocity: Vec3, rate: Vec3, gain_xy: float, gain_z: float, limits: SpeedLimits
) -> BoundedCorrection:
    """Return the correction ``velocity`` in m/s, horizontally bounded by its length, vertically by its size.

    ``rate`` is its derivative in m/s^2; ``gain_xy``, ``gain_z`` > 0 in 1/s are correction over distance.
    """
    x, y = bounded_pair(velocity.x, velocity.y, rate.x, rate.y, gain_xy, limits.braking_xy, limits.max_xy)
    z, _ = bounded_pair(velocity.z, 0.0, rate.z, 0.0, gain_z, limits.braking_z, limits.max_z)
    return BoundedCorrection(x, y, z)


def proportional_correction(error: Vec3, gain_xy: float, gain_z: float, limits: SpeedLimits) -> BoundedCorrection:
    """Return the bounded -gain times ``error`` (actual - desired, m); its rate is not needed and left at 0.

    ``gain_xy``, ``gain_z`` > 0 in 1/s.
    """
    velocity = Vec3(-gain_xy * error.x, -gain_xy * error.y, -gain_z * error.z)
    return bounded_correction(velocity, ZERO, gain_xy, gain_z, limits)


def correction_vector(correction: BoundedCorrection) -> Vec3:
    """Return the bounded correction in m/s, world frame."""
    return Vec3(correction.x.velocity, correction.y.velocity, correction.z.velocity)


def is_speed_limited(correction: BoundedCorrection) -> bool:
    """Return whether a bound was met, in the plane or along z."""
    return correction.x.limited or correction.z.limited
