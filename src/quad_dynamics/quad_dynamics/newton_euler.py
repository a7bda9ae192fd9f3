"""Terms of the Newton-Euler equations (Eq. 1), one function each; both plants are made of them.

Body frame FLU, world frame ENU, inertia diagonal (Eq. 6). The gyroscopic torque of the rotors, tau_G, the paper never
defines and drops from Eq. 16; plant ``rigid_body`` has it where a vehicle has rotor inertia.

Vectors go in as any triple of floats (a ``Vec3`` is one) and come out as plain ones: building a NamedTuple for each
term would be most of the cost of a step in CPython.
"""

from typing import NamedTuple

Triple = tuple[float, float, float]
Quadruple = tuple[float, float, float, float]


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


def thrust_force(axis_w: Triple, thrust: float) -> Triple:
    """Return F_A in N, world frame (Eq. 2); ``axis_w`` is the body z axis in the world, ``thrust`` F_T in N."""
    return axis_w[0] * thrust, axis_w[1] * thrust, axis_w[2] * thrust


def drag_force(body: Body, v_w: Triple) -> Triple:
    """Return F_D in N, world frame (Eq. 5): -k_F v, or +k_F v where the printed sign is asked for."""
    k = body.drag_coefficient if body.printed_drag else -body.drag_coefficient
    return k * v_w[0], k * v_w[1], k * v_w[2]


def drag_torque(body: Body, omega_b: Triple) -> Triple:
    """Return tau_D in N m, body frame (Eq. 9): -k_T abs(omega) omega per axis, or the printed +k_T omega^2."""
    k = body.drag_torque_coefficient
    p, q, r = omega_b
    if body.printed_drag:
        return k * p * p, k * q * q, k * r * r
    return -k * abs(p) * p, -k * abs(q) * q, -k * abs(r) * r


def coupling_torque(body: Body, omega_b: Triple) -> Triple:
    """Return -Omega x (I Omega) in N m, body frame (Eqs. 1, 6, 7)."""
    p, q, r = omega_b
    xx, yy, zz = body.inertia_xx, body.inertia_yy, body.inertia_zz
    return (yy - zz) * q * r, (zz - xx) * p * r, (xx - yy) * p * q


def wind_force(body: Body, wind_w: Triple) -> Triple:
    """Return what wind in m/s adds to F_D in N, world frame: Eq. 5 with the velocity through the air, v - wind."""
    k = -body.drag_coefficient if body.printed_drag else body.drag_coefficient
    return k * wind_w[0], k * wind_w[1], k * wind_w[2]


def linear_acceleration(body: Body, axis_w: Triple, thrust: float, v_w: Triple, force_w: Triple) -> Triple:
    """Return the acceleration in m/s^2, world frame: Eq. 1, first row, with the outer ``force_w`` in N."""
    lift = thrust_force(axis_w, thrust)
    drag = drag_force(body, v_w)
    mass = body.mass
    return (
        (lift[0] + drag[0] + force_w[0]) / mass,
        (lift[1] + drag[1] + force_w[1]) / mass,
        (lift[2] + drag[2] + force_w[2]) / mass - body.gravity,
    )


def angular_acceleration(body: Body, omega_b: Triple, torque_b: Triple) -> Triple:
    """Return the angular acceleration in rad/s^2, body frame: Eq. 1, second row, under ``torque_b`` (N m) and drag."""
    coupling = coupling_torque(body, omega_b)
    drag = drag_torque(body, omega_b)
    return (
        (coupling[0] + torque_b[0] + drag[0]) / body.inertia_xx,
        (coupling[1] + torque_b[1] + drag[1]) / body.inertia_yy,
        (coupling[2] + torque_b[2] + drag[2]) / body.inertia_zz,
    )


def quaternion_rate(q_wb: Quadruple, omega_b: Triple) -> Quadruple:
    """Return the derivative in 1/s of the attitude xyzw: q (x) (omega_b, 0) / 2, in place of Eq. 13, never singular."""
    x, y, z, w = q_wb
    p, q, r = 0.5 * omega_b[0], 0.5 * omega_b[1], 0.5 * omega_b[2]
    return w * p + y * r - z * q, w * q + z * p - x * r, w * r + x * q - y * p, -x * p - y * q - z * r
