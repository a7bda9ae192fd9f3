"""A body with a payload fixed to it: mass, centre and inertia of both, and the motion of the body's own centre.

The state of a plant stays that of the body's own centre of gravity O; the common centre lies at c from it. With the
force F and the torque t about O (gravity apart), M and J of both about the common centre::

    J Omega' = t - c x F - Omega x J Omega        P'' = F / M + g - (Omega' x c + Omega x (Omega x c))
"""

from typing import NamedTuple

from quad_core.rotations import rotate, rotate_inverse
from quad_core.types import Payload, Quat, Vec3
from quad_dynamics.newton_euler import Body, Triple

LEAST_DETERMINANT = 1e-30


class Load(NamedTuple):
    """Common mass kg, common centre m (body), and inertia about it kg m^2: xx, yy, zz and the elements yz, xz, xy."""

    mass: float
    centre: Triple
    moments: Triple
    products: Triple


NO_LOAD = Load(1.0, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))


def is_loaded(payload: Payload) -> bool:
    """Return whether ``payload`` shifts the centre of gravity or turns the axes of inertia."""
    m, p = payload.moment_b, payload.products_b
    return m.x != 0.0 or m.y != 0.0 or m.z != 0.0 or p.x != 0.0 or p.y != 0.0 or p.z != 0.0


def loaded(body: Body, payload: Payload) -> Load:
    """Return mass, centre and inertia of ``body``, which has the payload's mass and moments already, by Steiner."""
    mass = body.mass
    x, y, z = payload.moment_b.x / mass, payload.moment_b.y / mass, payload.moment_b.z / mass
    products = payload.products_b
    return Load(
        mass,
        (x, y, z),
        (
            body.inertia_xx - mass * (y * y + z * z),
            body.inertia_yy - mass * (x * x + z * z),
            body.inertia_zz - mass * (x * x + y * y),
        ),
        (mass * y * z - products.x, mass * x * z - products.y, mass * x * y - products.z),
    )


def angular(load: Load, torque: Triple) -> Vec3:
    """Return J^-1 ``torque`` (N m to rad/s^2), by cofactors; zero where J is singular."""
    a, b, c = load.moments
    f, e, d = load.products
    xx, yy, zz = b * c - f * f, a * c - e * e, a * b - d * d
    xy, xz, yz = e * f - c * d, d * f - b * e, d * e - a * f
    determinant = a * xx + d * xy + e * xz
    if abs(determinant) < LEAST_DETERMINANT:
        return Vec3(0.0, 0.0, 0.0)
    tx, ty, tz = torque
    return Vec3(
        (xx * tx + xy * ty + xz * tz) / determinant,
        (xy * tx + yy * ty + yz * tz) / determinant,
        (xz * tx + yz * ty + zz * tz) / determinant,
    )


def cross(a: Triple, b: Triple) -> Vec3:
    """Return the vector product."""
    return Vec3(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def accelerations(
    load: Load, gravity: float, q_wb: Quat, omega_b: Triple, force_w: Triple, torque_b: Triple
) -> tuple[Triple, Triple]:
    """Return P'' of O in m/s^2 (world) and Omega' in rad/s^2 (body) under all force N at O and torque N m about O."""
    push = rotate_inverse(q_wb, Vec3(force_w[0], force_w[1], force_w[2]))
    lever = cross(load.centre, push)
    a, b, c = load.moments
    f, e, d = load.products
    p, q, r = omega_b
    momentum = (a * p + d * q + e * r, d * p + b * q + f * r, e * p + f * q + c * r)
    turn = cross(omega_b, momentum)
    alpha = angular(
        load, (torque_b[0] - lever.x - turn.x, torque_b[1] - lever.y - turn.y, torque_b[2] - lever.z - turn.z)
    )
    swing, pull = cross(alpha, load.centre), cross(omega_b, cross(omega_b, load.centre))
    offset = rotate(q_wb, Vec3(swing.x + pull.x, swing.y + pull.y, swing.z + pull.z))
    mass = load.mass
    linear = (force_w[0] / mass - offset.x, force_w[1] / mass - offset.y, force_w[2] / mass - offset.z - gravity)
    return linear, (alpha.x, alpha.y, alpha.z)
