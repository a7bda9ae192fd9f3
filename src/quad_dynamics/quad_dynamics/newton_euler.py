"""Terms of the Newton-Euler equations (Eq. 1), one function each; both plants are made of them.

Body frame FLU, world frame ENU, inertia diagonal (Eq. 6). The gyroscopic torque of the rotors, tau_G, is
zero here: the paper never defines it and drops it from Eq. 16.
"""

from typing import NamedTuple

from quad_core.types import Quat, Vec3


class Body(NamedTuple):
    """Mass properties and drag of one body: the nominal one or the true one (m + dm, I + dI of Eq. 10)."""

    mass: float
    gravity: float
    inertia_xx: float
    inertia_yy: float
    inertia_zz: float
    drag_coefficient: float
    drag_torque_coefficient: float
    printed_drag: bool


def thrust_force(axis_w: Vec3, thrust: float) -> Vec3:
    """Return F_A in N, world frame (Eq. 2); ``axis_w`` is the body z axis in the world, ``thrust`` F_T in N."""
    return Vec3(axis_w.x * thrust, axis_w.y * thrust, axis_w.z * thrust)


def drag_force(body: Body, v_w: Vec3) -> Vec3:
    """Return F_D in N, world frame (Eq. 5): -k_F v, or +k_F v where the printed sign is asked for."""
    k = body.drag_coefficient if body.printed_drag else -body.drag_coefficient
    return Vec3(k * v_w.x, k * v_w.y, k * v_w.z)


def drag_torque(body: Body, omega_b: Vec3) -> Vec3:
    """Return tau_D in N m, body frame (Eq. 9): -k_T abs(omega) omega per axis, or the printed +k_T omega^2."""
    k = body.drag_torque_coefficient
    if body.printed_drag:
        return Vec3(k * omega_b.x * omega_b.x, k * omega_b.y * omega_b.y, k * omega_b.z * omega_b.z)
    return Vec3(
        -k * abs(omega_b.x) * omega_b.x,
        -k * abs(omega_b.y) * omega_b.y,
        -k * abs(omega_b.z) * omega_b.z,
    )


def coupling_torque(body: Body, omega_b: Vec3) -> Vec3:
    """Return -Omega x (I Omega) in N m, body frame (Eqs. 1, 6, 7)."""
    return Vec3(
        (body.inertia_yy - body.inertia_zz) * omega_b.y * omega_b.z,
        (body.inertia_zz - body.inertia_xx) * omega_b.x * omega_b.z,
        (body.inertia_xx - body.inertia_yy) * omega_b.x * omega_b.y,
    )


def linear_acceleration(body: Body, axis_w: Vec3, thrust: float, v_w: Vec3, force_w: Vec3) -> Vec3:
    """Return the acceleration in m/s^2, world frame (Eq. 1, first row) under thrust, weight, drag and ``force_w`` (N)."""
    lift = thrust_force(axis_w, thrust)
    drag = drag_force(body, v_w)
    return Vec3(
        (lift.x + drag.x + force_w.x) / body.mass,
        (lift.y + drag.y + force_w.y) / body.mass,
        (lift.z + drag.z + force_w.z) / body.mass - body.gravity,
    )


def angular_acceleration(body: Body, omega_b: Vec3, torque_b: Vec3) -> Vec3:
    """Return the angular acceleration in rad/s^2, body frame (Eq. 1, second row) under ``torque_b`` (N m) and drag."""
    coupling = coupling_torque(body, omega_b)
    drag = drag_torque(body, omega_b)
    return Vec3(
        (coupling.x + torque_b.x + drag.x) / body.inertia_xx,
        (coupling.y + torque_b.y + drag.y) / body.inertia_yy,
        (coupling.z + torque_b.z + drag.z) / body.inertia_zz,
    )


def quaternion_rate(q: Quat, omega_b: Vec3) -> Quat:
    """Return the derivative in 1/s of the attitude: q (x) (omega_b, 0) / 2, in place of Eq. 13, never singular."""
    hx, hy, hz = 0.5 * omega_b.x, 0.5 * omega_b.y, 0.5 * omega_b.z
    return Quat(
        q.w * hx + q.y * hz - q.z * hy,
        q.w * hy + q.z * hx - q.x * hz,
        q.w * hz + q.x * hy - q.y * hx,
        -q.x * hx - q.y * hy - q.z * hz,
    )
