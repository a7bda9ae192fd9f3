"""Equations of motion (Eq. 1), a function per term, and the Runge-Kutta step; both plants are made of them.

::

    m P''     = F_A + F_G + F_D + f        Omega' = I^-1 (-Omega x I Omega + tau_A + tau_D + t)
    F_A = R (0, 0, F_T)   F_D = -k_F P'    tau_D = -k_T abs(Omega) Omega        q' = q (x) (Omega, 0) / 2

with outer force f and torque t. Body frame FLU, world frame ENU, inertia diagonal (Eq. 6). The gyroscopic torque of the
rotors, tau_G, the paper never defines and drops from Eq. 16; plant ``rigid_body`` has it where a vehicle has rotor
inertia.

A step of h s of x' = f(u, x) is the classical Runge-Kutta method of order 4::

    k1 = f(u(0), x)    k2 = f(u(h/2), x + h/2 k1)    k3 = f(u(h/2), x + h/2 k2)    k4 = f(u(h), x + h k3)
    x(h) = x + h/6 (k1 + 2 k2 + 2 k3 + k4)

A state is 13 plain floats; a plant with fewer fills up with zeros, since Numba makes no tuple of a length that it does
not know. Vectors go in as any triple of floats (a ``Vec3`` is one) and come out as plain ones: building a NamedTuple
for each term would be most of the cost of a step in CPython.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeVar

from quad_core.vehicle import DragSign, Triple, Vehicle, coupling_torque
from quad_dynamics.parameters import PlantParameters

Quadruple = tuple[float, float, float, float]
Flat = tuple[float, float, float, float, float, float, float, float, float, float, float, float, float]
Constant = TypeVar("Constant")
Input = TypeVar("Input")


class Body(NamedTuple):
    """Mass properties and drag of one body: the nominal one or the true one (m + dm, I + dI of Eq. 10), in SI units."""

    mass: float
    gravity: float
    inertia_xx: float
    inertia_yy: float
    inertia_zz: float
    drag_coefficient: float
    drag_torque_coefficient: float
    printed_drag: bool


def nominal_body(parameters: PlantParameters, vehicle: Vehicle) -> Body:
    """Return the body as the laws know it: m, I, k_F of Table 1."""
    return Body(
        vehicle.mass,
        vehicle.gravity,
        vehicle.inertia_xx,
        vehicle.inertia_yy,
        vehicle.inertia_zz,
        vehicle.drag_coefficient,
        vehicle.drag_torque_coefficient,
        parameters.drag_sign == DragSign.PRINTED,
    )


def true_body(parameters: PlantParameters, vehicle: Vehicle, payload_mass: float) -> Body:
    """Return the body as it is: m + dm, I + dI (Eq. 10), with a payload of ``payload_mass`` kg at its centre."""
    error = parameters.inertia_error
    return Body(
        vehicle.mass + parameters.mass_error + payload_mass,
        vehicle.gravity,
        vehicle.inertia_xx + error.xx,
        vehicle.inertia_yy + error.yy,
        vehicle.inertia_zz + error.zz,
        vehicle.drag_coefficient + parameters.drag_error,
        vehicle.drag_torque_coefficient,
        parameters.drag_sign == DragSign.PRINTED,
    )


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


def rk4(
    rate: Callable[[Constant, Input, Flat], Flat],
    constant: Constant,
    start: Input,
    middle: Input,
    end: Input,
    s: Flat,
    h: float,
) -> Flat:
    """Return the state ``h`` s after ``s`` of the system ``rate(constant, input, state)``.

    ``start``, ``middle`` and ``end`` are the input at the beginning, in the middle and at the end of the step.
    """
    k1 = rate(constant, start, s)
    k2 = rate(constant, middle, moved(s, k1, 0.5 * h))
    k3 = rate(constant, middle, moved(s, k2, 0.5 * h))
    k4 = rate(constant, end, moved(s, k3, h))
    return combined(s, k1, k2, k3, k4, h)


def moved(s: Flat, k: Flat, h: float) -> Flat:
    """Return s + h k: the state after ``h`` s at the rate ``k``."""
    return (
        s[0] + h * k[0],
        s[1] + h * k[1],
        s[2] + h * k[2],
        s[3] + h * k[3],
        s[4] + h * k[4],
        s[5] + h * k[5],
        s[6] + h * k[6],
        s[7] + h * k[7],
        s[8] + h * k[8],
        s[9] + h * k[9],
        s[10] + h * k[10],
        s[11] + h * k[11],
        s[12] + h * k[12],
    )


def combined(s: Flat, k1: Flat, k2: Flat, k3: Flat, k4: Flat, h: float) -> Flat:
    """Return s + h/6 (k1 + 2 k2 + 2 k3 + k4)."""
    g = h / 6.0
    return (
        s[0] + g * (k1[0] + 2.0 * (k2[0] + k3[0]) + k4[0]),
        s[1] + g * (k1[1] + 2.0 * (k2[1] + k3[1]) + k4[1]),
        s[2] + g * (k1[2] + 2.0 * (k2[2] + k3[2]) + k4[2]),
        s[3] + g * (k1[3] + 2.0 * (k2[3] + k3[3]) + k4[3]),
        s[4] + g * (k1[4] + 2.0 * (k2[4] + k3[4]) + k4[4]),
        s[5] + g * (k1[5] + 2.0 * (k2[5] + k3[5]) + k4[5]),
        s[6] + g * (k1[6] + 2.0 * (k2[6] + k3[6]) + k4[6]),
        s[7] + g * (k1[7] + 2.0 * (k2[7] + k3[7]) + k4[7]),
        s[8] + g * (k1[8] + 2.0 * (k2[8] + k3[8]) + k4[8]),
        s[9] + g * (k1[9] + 2.0 * (k2[9] + k3[9]) + k4[9]),
        s[10] + g * (k1[10] + 2.0 * (k2[10] + k3[10]) + k4[10]),
        s[11] + g * (k1[11] + 2.0 * (k2[11] + k3[11]) + k4[11]),
        s[12] + g * (k1[12] + 2.0 * (k2[12] + k3[12]) + k4[12]),
    )
