"""From Euler-angle accelerations to body torque, and to the torque within its limits; shared by all attitude laws.

exact:    w' = d/dt (W(angles) rates) with W the inverse of Eq. 13,  torque = I w' + w x I w - tau_D   (1, 13)
printed:  torque from b U of Eq. 56 with w = rates                                                     (14)
limits:   torque = clamp(torque command, +-limit) per body axis; what an axis integrates rests while it is limited
"""

import math
from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import Desired
from quad_core.geometry import ZERO, body_rates, clamp
from quad_core.parameters import Flag, Real
from quad_core.types import Actuation, AttitudeInternals, AxisFlags, Vec3
from quad_core.vehicle import DragSign, Vehicle


class TorqueMapping(IntEnum):
    """Euler acceleration to torque: identity (Eq. 14), or Eq. 13 and Eq. 1 in full."""

    PRINTED = 0
    EXACT = 1


class Coefficients(NamedTuple):
    """a_1..a_6 and b_1..b_3 of Eq. 17; the drag coefficients a_2, a_4, a_6 are magnitudes in 1/rad."""

    a1: float
    a2: float
    a3: float
    a4: float
    a5: float
    a6: float
    b1: float
    b2: float
    b3: float


def coefficients(vehicle: Vehicle) -> Coefficients:
    """Return Eq. 17 of a vehicle. b_1, b_2 in 1/(kg m), b_3 in 1/(kg m^2)."""
    xx, yy, zz = vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz
    drag = vehicle.drag_torque_coefficient
    return Coefficients(
        a1=(yy - zz) / xx,
        a2=drag / xx,
        a3=(zz - xx) / yy,
        a4=drag / yy,
        a5=(xx - yy) / zz,
        a6=drag / zz,
        b1=vehicle.arm_length / xx,
        b2=vehicle.arm_length / yy,
        b3=1.0 / zz,
    )


def air_drag(coefficient: float, rate: float, drag_sign: int) -> float:
    """Return a_2 x_2^2 in rad/s^2 as printed, or -a_2 |x_2| x_2, which opposes the motion."""
    if drag_sign == DragSign.PRINTED:
        return coefficient * rate * rate
    return -coefficient * abs(rate) * rate


def model_acceleration(a: Coefficients, rates: Vec3, drag_sign: int) -> Vec3:
    """Return a_1 x_4 x_6 + a_2 x_2^2, pitch and yaw alike, in rad/s^2: Eq. 16 without control (terms of Eq. 52)."""
    return Vec3(
        a.a1 * rates.y * rates.z + air_drag(a.a2, rates.x, drag_sign),
        a.a3 * rates.x * rates.z + air_drag(a.a4, rates.y, drag_sign),
        a.a5 * rates.x * rates.y + air_drag(a.a6, rates.z, drag_sign),
    )


def body_acceleration(angles: Vec3, rates: Vec3, accelerations: Vec3) -> Vec3:
    """Return the derivative of the body rates in rad/s^2 for given Euler angles, rates and accelerations.

    The time derivative of the inverse of Eq. 13, where Eq. 14 puts the identity.
    """
    sphi, cphi = math.sin(angles.x), math.cos(angles.x)
    stheta, ctheta = math.sin(angles.y), math.cos(angles.y)
    turned = body_rates(angles, accelerations)
    return Vec3(
        turned.x - ctheta * rates.y * rates.z,
        turned.y - sphi * rates.x * rates.y + cphi * ctheta * rates.x * rates.z - sphi * stheta * rates.y * rates.z,
        turned.z - sphi * ctheta * rates.x * rates.z - cphi * stheta * rates.y * rates.z - cphi * rates.x * rates.y,
    )


def inverse_dynamics(vehicle: Vehicle, omega_b: Vec3, acceleration_b: Vec3, drag_sign: int) -> Vec3:
    """Return the torque in N m that gives the body acceleration (Eq. 1): I w' + w x I w - tau_D (eqs. 6, 7, 9)."""
    xx, yy, zz = vehicle.inertia_xx, vehicle.inertia_yy, vehicle.inertia_zz
    drag = vehicle.drag_torque_coefficient
    return Vec3(
        xx * acceleration_b.x + (zz - yy) * omega_b.y * omega_b.z - air_drag(drag, omega_b.x, drag_sign),
        yy * acceleration_b.y + (xx - zz) * omega_b.z * omega_b.x - air_drag(drag, omega_b.y, drag_sign),
        zz * acceleration_b.z + (yy - xx) * omega_b.x * omega_b.y - air_drag(drag, omega_b.z, drag_sign),
    )


def torque_for(vehicle: Vehicle, acceleration_b: Vec3) -> Vec3:
    """Return J a in N m for a body acceleration in rad/s^2, the nominal inertia alone."""
    x, y, z = acceleration_b.x, acceleration_b.y, acceleration_b.z
    return Vec3(vehicle.inertia_xx * x, vehicle.inertia_yy * y, vehicle.inertia_zz * z)


class TorqueLimits(NamedTuple):
    """Largest torque about each body axis."""

    roll: Annotated[float, Real("N m", "largest torque about body x; 1e6: off", 0.0, 1e6, "addition")] = 0.5
    pitch: Annotated[float, Real("N m", "largest torque about body y; 1e6: off", 0.0, 1e6, "addition")] = 0.5
    yaw: Annotated[float, Real("N m", "largest torque about body z; 1e6: off", 0.0, 1e6, "addition")] = 0.5


AntiWindup = Annotated[
    bool,
    Flag("integrals and estimates of an axis rest while its torque is limited, here or in `actuation`", "addition"),
]


class LimitedTorque(NamedTuple):
    """Torque in N m within its limits, and on which axes a limit was met."""

    torque: Vec3
    limited: AxisFlags


def limited_torque(command: Vec3, limits: TorqueLimits) -> LimitedTorque:
    """Return ``command`` in N m (body axes), each axis within its limit."""
    torque = Vec3(
        clamp(command.x, -limits.roll, limits.roll),
        clamp(command.y, -limits.pitch, limits.pitch),
        clamp(command.z, -limits.yaw, limits.yaw),
    )
    return LimitedTorque(torque, AxisFlags(torque.x != command.x, torque.y != command.y, torque.z != command.z))


def integrals_frozen(anti_windup: bool, limited: AxisFlags, actuation: Actuation) -> AxisFlags:
    """Return on which axes what the law integrates must rest: a limit is met in the law, or was met by the vehicle."""
    return AxisFlags(
        anti_windup and (limited.x or actuation.roll_limited),
        anti_windup and (limited.y or actuation.pitch_limited),
        anti_windup and (limited.z or actuation.yaw_limited),
    )


def internals_of(
    goal: Desired,
    angle_error: Vec3,
    rate_error: Vec3,
    feed_forward: Vec3,
    feedback: Vec3,
    torque: LimitedTorque,
    frozen: AxisFlags,
    sliding: Vec3 = ZERO,
    integral: Vec3 = ZERO,
    exponent: Vec3 = ZERO,
) -> AttitudeInternals:
    """Return the internals of a law without adaptation, 0 for what it has not.

    ``angle_error`` rad, ``rate_error`` rad/s, ``feed_forward`` and ``feedback`` in rad/s^2; ``frozen``: its integrals
    rested. Of a sliding surface: ``sliding`` s and ``integral`` in rad/s, its ``exponent``.
    """
    return AttitudeInternals(
        desired_angles=goal.angles,
        desired_rates=goal.rates,
        desired_accelerations=goal.accelerations,
        angle_error=angle_error,
        rate_error=rate_error,
        sliding_variable=sliding,
        surface_integral=integral,
        surface_exponent=exponent,
        adaptive_constant=ZERO,
        adaptive_angle=ZERO,
        adaptive_rate=ZERO,
        equivalent_control=feed_forward,
        reaching_control=feedback,
        lyapunov=ZERO,
        lyapunov_rate=ZERO,
        torque_limited=torque.limited,
        adaptation_frozen=frozen,
    )
