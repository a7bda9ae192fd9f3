"""From wanted Euler-angle accelerations to body torque: as printed, or without the small-angle step of Eq. 14."""

import math
from typing import NamedTuple

from quad_core.rotations import body_rates
from quad_core.types import Vec3
from quad_core.vehicle import Vehicle


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
        (yy - zz) / xx,
        drag / xx,
        (zz - xx) / yy,
        drag / yy,
        (xx - yy) / zz,
        drag / zz,
        vehicle.arm_length / xx,
        vehicle.arm_length / yy,
        1.0 / zz,
    )


def air_drag(coefficient: float, rate: float, drag_sign: int) -> float:
    """Return a_2 x_2^2 in rad/s^2 as printed (``drag_sign`` 1), or -a_2 |x_2| x_2, which opposes the motion (0)."""
    if drag_sign == 1:
        return coefficient * rate * rate
    return -coefficient * abs(rate) * rate


def model_acceleration(a: Coefficients, rates: Vec3, drag_sign: int) -> Vec3:
    """Return a_1 x_4 x_6 + a_2 x_2^2 and its likes in rad/s^2: what Eq. 16 does without control (terms of Eq. 52)."""
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
