"""From the acceleration command to thrust and attitude: Eq. 38, and the limits that the paper leaves out.

``lift`` is U + g e_z in m/s^2, world frame: the thrust vector over the mass.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Flag, Real
from quad_core.types import Vec3


class Limits(NamedTuple):
    """What the law may ask of the vehicle; none of it is in the paper (``printed``: all out of reach)."""

    acceleration_xy: Annotated[
        float, Real("m/s^2", "longest horizontal part of U; 1e6: off", 0.1, 1e6, "addition to Eq. 30")
    ] = 12.0
    acceleration_z: Annotated[
        float, Real("m/s^2", "largest vertical part of U, both ways; 1e6: off", 0.1, 1e6, "addition to Eq. 30")
    ] = 7.0
    min_lift: Annotated[
        float,
        Real(
            "",
            "floor of U_z + g as a fraction of g (Eq. 38 commands upright and thrust up below 0); -1e6: off",
            -1e6,
            1.0,
            "addition to Eq. 38",
        ),
    ] = 0.3
    tilt: Annotated[
        float, Real("rad", "largest angle between desired thrust and vertical; >= 1.57: off", 0.05, 1.58, "addition")
    ] = 0.87
    thrust: Annotated[
        float, Real("", "largest thrust as a fraction of the vehicle's largest; 1e6: off", 0.1, 1e6, "addition")
    ] = 1.0
    min_thrust: Annotated[
        float, Real("", "smallest thrust as a fraction of the vehicle's largest", 0.0, 0.5, "addition")
    ] = 0.02
    vertical_priority: Annotated[
        bool, Flag("thrust that cannot be had is taken from the horizontal part first; false: in proportion")
    ] = True


class LimitedLift(NamedTuple):
    """A lift that the vehicle can have, and what had to be changed for it."""

    lift: Vec3
    acceleration_limited: bool
    descent_limited: bool
    thrust_limited: bool
    tilt_limited: bool


class LimitedThrust(NamedTuple):
    """Collective thrust in N inside the vehicle's range."""

    thrust: float
    limited: bool


def clamped(value: float, low: float, high: float) -> float:
    """Return ``value`` moved into [low, high]."""
    if value < low:
        return low
    if value > high:
        return high
    return value


def thrust_norm(mass: float, lift: Vec3) -> float:
    """Return F_T = m |U + g e_z| in N (Eq. 38, first line, as printed)."""
    return mass * math.sqrt(lift.x * lift.x + lift.y * lift.y + lift.z * lift.z)


def thrust_projected(mass: float, lift: Vec3, thrust_axis: Vec3) -> float:
    """Return m (U + g e_z) . b_z in N: Eq. 38 when the attitude is not yet the desired one; equal to it when it is.

    ``thrust_axis`` is the actual body z axis in the world. Source: Lee, Leok and McClamroch, CDC 2010, eq. 19.
    """
    return mass * (lift.x * thrust_axis.x + lift.y * thrust_axis.y + lift.z * thrust_axis.z)


def desired_angles(lift: Vec3, heading: float, yaw: float) -> Vec3:
    """Return (phi_d, theta_d, psi_d) in rad (Eq. 38, second and third line; the printed psi_d of the third is phi_d).

    ``heading`` is the yaw in whose frame the thrust is tilted (psi_d as printed), ``yaw`` is the psi_d handed on.
    """
    vertical = lift.z
    if abs(vertical) < 1e-9:
        vertical = 1e-9
    cos_heading = math.cos(heading)
    sin_heading = math.sin(heading)
    theta = math.atan((cos_heading * lift.x + sin_heading * lift.y) / vertical)
    phi = math.atan(math.cos(theta) * (sin_heading * lift.x - cos_heading * lift.y) / vertical)
    return Vec3(phi, theta, yaw)


def limited_lift(command: Vec3, gravity: float, max_lift: float, limits: Limits) -> LimitedLift:
    """Return the lift that comes nearest to U (``command``, m/s^2) within what the vehicle can have.

    In this order: bound the command (length in xy, size in z), keep the vertical part at or above ``min_lift`` g
    (Eq. 38 turns upright with full thrust below 0), keep the length within ``max_lift`` (m/s^2; vertical part first if
    ``vertical_priority``, else all in proportion), then the angle to the vertical within ``tilt`` (rad) by shortening
    the horizontal part.
    """
    x = command.x
    y = command.y
    wanted_z = clamped(command.z, -limits.acceleration_z, limits.acceleration_z)
    acceleration_limited = wanted_z != command.z
    horizontal = math.sqrt(x * x + y * y)
    if horizontal > limits.acceleration_xy:
        x = x * limits.acceleration_xy / horizontal
        y = y * limits.acceleration_xy / horizontal
        horizontal = limits.acceleration_xy
        acceleration_limited = True

    z = wanted_z + gravity
    descent_limited = z < limits.min_lift * gravity
    if descent_limited:
        z = limits.min_lift * gravity

    room = horizontal
    thrust_limited = horizontal * horizontal + z * z > max_lift * max_lift
    if thrust_limited and limits.vertical_priority:
        z = clamped(z, -max_lift, max_lift)
        room = math.sqrt(clamped(max_lift * max_lift - z * z, 0.0, max_lift * max_lift))
    elif thrust_limited:
        length = math.sqrt(horizontal * horizontal + z * z)
        z = z * max_lift / length
        room = horizontal * max_lift / length

    cone = room
    if limits.tilt < 1.57:
        cone = clamped(z, 0.0, abs(z)) * math.tan(limits.tilt)
    tilt_limited = room > cone
    if tilt_limited:
        room = cone
    if horizontal > room:
        x = x * room / horizontal
        y = y * room / horizontal
    return LimitedLift(Vec3(x, y, z), acceleration_limited, descent_limited, thrust_limited, tilt_limited)


def limited_thrust(thrust: float, min_thrust: float, max_thrust: float) -> LimitedThrust:
    """Return ``thrust`` in N held in [``min_thrust``, ``max_thrust``]."""
    held = clamped(thrust, min_thrust, max_thrust)
    return LimitedThrust(held, held != thrust)
