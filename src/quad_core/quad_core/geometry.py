"""Vectors and rotations on plain floats.

Both vectors of a call are in one frame; the result is in it too. Quaternions are xyzw, body to world; Euler angles are
Z-Y-X: (phi, theta, psi).
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from quad_core.types import Quat, Vec3

ZERO = Vec3(0.0, 0.0, 0.0)


def clamp(value: float, low: float, high: float) -> float:
    """Return ``value`` moved into [``low``, ``high``] (same unit, low <= high); a NaN stays a NaN."""
    if value < low:
        return low
    if value > high:
        return high
    return value


def add(a: Vec3, b: Vec3) -> Vec3:
    """Return a + b (same unit)."""
    return Vec3(a.x + b.x, a.y + b.y, a.z + b.z)


def total(vectors: Iterable[Vec3]) -> Vec3:
    """Return the sum of all ``vectors``, zero of none."""
    found = ZERO
    for vector in vectors:
        found = add(found, vector)
    return found


def subtract(a: Vec3, b: Vec3) -> Vec3:
    """Return a - b (same unit)."""
    return Vec3(a.x - b.x, a.y - b.y, a.z - b.z)


def scale(factor: float, v: Vec3) -> Vec3:
    """Return ``factor`` times v."""
    return Vec3(factor * v.x, factor * v.y, factor * v.z)


def dot(a: Vec3, b: Vec3) -> float:
    """Return a . b, summed from x to z."""
    return a.x * b.x + a.y * b.y + a.z * b.z


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return a x b."""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


def norm(v: Vec3) -> float:
    """Return the length of v in the unit of its components; squares beyond 1e308 overflow to infinity."""
    return math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z)


def wrap_angle(angle: float) -> float:
    """Return ``angle`` (rad) moved by whole turns into (-pi, pi]."""
    turns = math.floor((math.pi - angle) / (2.0 * math.pi))
    return angle + 2.0 * math.pi * turns


def euler_from_quaternion(q: Quat) -> Vec3:
    """Return (phi, theta, psi) in rad of a unit quaternion (inverse of Eq. 4)."""
    sine = 2.0 * (q.w * q.y - q.z * q.x)
    if sine > 1.0:
        sine = 1.0
    if sine < -1.0:
        sine = -1.0
    phi = math.atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
    psi = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return Vec3(phi, math.asin(sine), psi)


def quaternion_from_euler(angles: Vec3) -> Quat:
    """Return the unit quaternion of (phi, theta, psi) in rad (Eq. 4)."""
    cr, sr = math.cos(0.5 * angles.x), math.sin(0.5 * angles.x)
    cp, sp = math.cos(0.5 * angles.y), math.sin(0.5 * angles.y)
    cy, sy = math.cos(0.5 * angles.z), math.sin(0.5 * angles.z)
    return Quat(
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def normalized(q: Quat) -> Quat:
    """Return ``q`` scaled to length 1; its length must not be 0."""
    scale = 1.0 / math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
    return Quat(q.x * scale, q.y * scale, q.z * scale, q.w * scale)


def rotate(q: Quat, v_b: Vec3) -> Vec3:
    """Return the world components of a body vector: R_B^E v (Eq. 4)."""
    tx = 2.0 * (q.y * v_b.z - q.z * v_b.y)
    ty = 2.0 * (q.z * v_b.x - q.x * v_b.z)
    tz = 2.0 * (q.x * v_b.y - q.y * v_b.x)
    return Vec3(
        v_b.x + q.w * tx + q.y * tz - q.z * ty,
        v_b.y + q.w * ty + q.z * tx - q.x * tz,
        v_b.z + q.w * tz + q.x * ty - q.y * tx,
    )


def rotate_inverse(q: Quat, v_w: Vec3) -> Vec3:
    """Return the body components of a world vector: transpose of Eq. 4 times v."""
    return rotate(Quat(-q.x, -q.y, -q.z, q.w), v_w)


def relative_attitude(base: Quat, q: Quat) -> Quat:
    """Return base^-1 q: the attitude ``q`` as seen from ``base``, the quaternion of R_base^T R."""
    x, y, z, w = -base.x, -base.y, -base.z, base.w
    return Quat(
        w * q.x + x * q.w + y * q.z - z * q.y,
        w * q.y - x * q.z + y * q.w + z * q.x,
        w * q.z + x * q.y - y * q.x + z * q.w,
        w * q.w - x * q.x - y * q.y - z * q.z,
    )


def rotated_by_vector(q: Quat, turn: Vec3) -> Quat:
    """Return q exp(turn): ``q`` turned by the rotation vector ``turn`` in rad about its own axes."""
    x, y, z = 0.5 * turn.x, 0.5 * turn.y, 0.5 * turn.z
    angle = norm(Vec3(x, y, z))
    cosine, sine = 1.0, 1.0
    if angle > 1e-9:
        cosine, sine = math.cos(angle), math.sin(angle) / angle
    x, y, z = sine * x, sine * y, sine * z
    return normalized(
        Quat(
            q.w * x + q.x * cosine + q.y * z - q.z * y,
            q.w * y - q.x * z + q.y * cosine + q.z * x,
            q.w * z + q.x * y - q.y * x + q.z * cosine,
            q.w * cosine - q.x * x - q.y * y - q.z * z,
        )
    )


def body_z(q: Quat) -> Vec3:
    """Return the body z axis in the world: third column of Eq. 4."""
    return Vec3(2.0 * (q.x * q.z + q.w * q.y), 2.0 * (q.y * q.z - q.w * q.x), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))


def tilt(q: Quat) -> float:
    """Return the angle in rad, 0 to pi, between body z and the vertical."""
    cosine = 1.0 - 2.0 * (q.x * q.x + q.y * q.y)
    if cosine >= 1.0:
        return 0.0
    return math.acos(cosine) if cosine > -1.0 else math.pi


def euler_rates(angles: Vec3, omega_b: Vec3) -> Vec3:
    """Return Euler angle rates from body rates, rad/s (Eq. 13, full 3x3).

    Singular at theta = +-90 deg; cos(theta) is clamped to 1e-6 in magnitude there, so the result is finite.
    """
    sphi, cphi = math.sin(angles.x), math.cos(angles.x)
    stheta, ctheta = math.sin(angles.y), math.cos(angles.y)
    ctheta = math.copysign(max(abs(ctheta), 1e-6), ctheta)
    turn = sphi * omega_b.y + cphi * omega_b.z
    return Vec3(omega_b.x + turn * stheta / ctheta, cphi * omega_b.y - sphi * omega_b.z, turn / ctheta)


def body_rates(angles: Vec3, rates: Vec3) -> Vec3:
    """Return body rates (p, q, r) from Euler angle rates, rad/s (inverse of Eq. 13)."""
    sphi, cphi = math.sin(angles.x), math.cos(angles.x)
    ctheta = math.cos(angles.y)
    return Vec3(
        rates.x - math.sin(angles.y) * rates.z,
        cphi * rates.y + sphi * ctheta * rates.z,
        cphi * ctheta * rates.z - sphi * rates.y,
    )


def low_passed(before: Vec3, value: Vec3, bandwidth: float, dt: float) -> Vec3:
    """Return a first-order lag of ``bandwidth`` rad/s after a step of ``dt`` s with the input ``value``."""
    gain = 1.0 - math.exp(-bandwidth * dt)
    return Vec3(
        before.x + gain * (value.x - before.x),
        before.y + gain * (value.y - before.y),
        before.z + gain * (value.z - before.z),
    )


class TwoLags(NamedTuple):
    """A vector behind the first and behind both poles of H(s) = (b / (s + b))^2."""

    first: Vec3 = Vec3()
    second: Vec3 = Vec3()


def low_passed_twice(state: TwoLags, value: Vec3, bandwidth: float, dt: float) -> TwoLags:
    """Return H(s) after a step of ``dt`` s with the input ``value``: two first-order lags of ``bandwidth`` rad/s."""
    first = low_passed(state.first, value, bandwidth, dt)
    return TwoLags(first, low_passed(state.second, first, bandwidth, dt))


def slope(before: Vec3, now: Vec3, dt: float) -> Vec3:
    """Return the change per s over a step of ``dt`` s."""
    return Vec3((now.x - before.x) / dt, (now.y - before.y) / dt, (now.z - before.z) / dt)
