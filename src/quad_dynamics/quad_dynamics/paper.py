"""Plant ``paper``: Eq. 16, where Euler accelerations are taken for body accelerations (Eq. 14), RK4 at a fixed step.

Right for small angles only; angles are not wrapped and theta may pass 90 degrees, where Eq. 16 goes on regardless.
Eq. 16 has the external disturbance as acceleration; it comes in here as force and torque (Appendix A). Of the
conditions it knows wind (as drag), rotors that fail, battery, and mass and moments of inertia of a payload, not its
lever. Its rotors are ideal, and it has no ground.
"""

import math
from typing import NamedTuple

from quad_core.conditions import as_disturbance
from quad_core.rotations import body_rates, euler_rates, quaternion_from_euler
from quad_core.types import Actuation, Conditions, Disturbance, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.allocation import allocate_within
from quad_dynamics.newton_euler import Body, Triple, angular_acceleration, linear_acceleration, wind_force
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.rotor_dynamics import Push, each, most_thrust, true_push
from quad_dynamics.uncertainty import check_true_body, nominal_acceleration, true_body

Parameters = PlantParameters
# a state or its derivative inside a step: plain tuples cost CPython a fifth of NamedTuples
Flat = tuple[float, float, float, float, float, float, float, float, float, float, float, float]
LARGEST_RATE = 1e6


class State(NamedTuple):
    """X of Eq. 16: (phi, phi', theta, theta', psi, psi', x, x', y, y', z, z') in rad, rad/s, m, m/s."""

    x1: float = 0.0
    x2: float = 0.0
    x3: float = 0.0
    x4: float = 0.0
    x5: float = 0.0
    x6: float = 0.0
    x7: float = 0.0
    x8: float = 0.0
    x9: float = 0.0
    x10: float = 0.0
    x11: float = 0.0
    x12: float = 0.0


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return X at step 0; the initial body rates become Euler rates by Eq. 13.

    Raises ValueError if mass or inertia, errors included, are not positive, or a ground is asked for.
    """
    check_true_body(parameters, vehicle)
    if parameters.ground.enabled:
        raise ValueError("ground.enabled: found true, expected false: plant paper has no ground")
    start = parameters.initial
    angles = Vec3(start.angles.phi, start.angles.theta, start.angles.psi)
    rates = euler_rates(angles, Vec3(start.omega.x, start.omega.y, start.omega.z))
    return State(
        angles.x,
        rates.x,
        angles.y,
        rates.y,
        angles.z,
        rates.z,
        start.p.x,
        start.v.x,
        start.p.y,
        start.v.y,
        start.p.z,
        start.v.z,
    )


def thrust_axis(phi: float, theta: float, psi: float) -> Triple:
    """Return the body z axis in the world: third column of Eq. 4, as in Eq. 15; angles in rad."""
    sphi, cphi = math.sin(phi), math.cos(phi)
    stheta, ctheta = math.sin(theta), math.cos(theta)
    spsi, cpsi = math.sin(psi), math.cos(psi)
    return cphi * stheta * cpsi + sphi * spsi, cphi * stheta * spsi - sphi * cpsi, cphi * ctheta


def derivative(body: Body, thrust: float, force_w: Triple, torque_b: Triple, s: Flat) -> Flat:
    """Return X' of Eq. 16 at X = ``s`` under thrust N, outer force N (world) and all torque N m.

    The rows for x2, x4, x6 are those of Eq. 1 with Euler rates for body rates: a1..a6, b1..b3 of Eq. 17.
    """
    x1, x2, x3, x4, x5, x6, _, x8, _, x10, _, x12 = s
    ax, ay, az = linear_acceleration(body, thrust_axis(x1, x3, x5), thrust, (x8, x10, x12), force_w)
    dx2, dx4, dx6 = angular_acceleration(body, (x2, x4, x6), torque_b)
    return x2, dx2, x4, dx4, x6, dx6, x8, ax, x10, ay, x12, az


def moved(s: Flat, k: Flat, h: float) -> Flat:
    """Return state ``s`` + ``h`` times its derivative ``k``."""
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
    )


def joined(s: Flat, k1: Flat, k2: Flat, k3: Flat, k4: Flat, h: float) -> Flat:
    """Return ``s`` + ``h`` (k1 + 2 k2 + 2 k3 + k4) / 6: the classical Runge-Kutta method."""
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
    )


def can_move(s: Flat) -> bool:
    """Return whether the Euler rates are finite and at most 1e6 rad/s, so that one more step cannot overflow."""
    return abs(s[1]) <= LARGEST_RATE and abs(s[3]) <= LARGEST_RATE and abs(s[5]) <= LARGEST_RATE


def acting(
    parameters: PlantParameters, vehicle: Vehicle, actuation: Actuation, body: Body, conditions: Conditions
) -> tuple[float, Triple, Triple]:
    """Return thrust N, outer force N (world) and all torque N m (body) that act over a step."""
    speeds = each(actuation.rotor_speed)
    push: Push = true_push(
        vehicle,
        parameters.effectiveness,
        conditions.rotor_effectiveness,
        each(actuation.rotor_thrust),
        speeds,
        speeds,
    )
    blown, force = wind_force(body, conditions.wind_w), conditions.force_w
    torque, outer = push.torque_b, conditions.torque_b
    return (
        push.thrust,
        (force.x + blown[0], force.y + blown[1], force.z + blown[2]),
        (torque[0] + outer.x, torque[1] + outer.y, torque[2] + outer.z),
    )


def step(
    parameters: PlantParameters,
    vehicle: Vehicle,
    state: State,
    wrench: Wrench,
    conditions: Conditions,
    dt: float,
) -> tuple[State, Actuation]:
    """Return X ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    A state whose rates left all bounds stays as it is (the sine of infinity raises); the caller ends the flight.
    """
    actuation = allocate_within(vehicle, wrench, most_thrust(vehicle, conditions))
    body = true_body(parameters, vehicle, conditions.payload)
    thrust, force_w, torque = acting(parameters, vehicle, actuation, body, conditions)
    h = dt / parameters.substeps
    s = (
        state.x1,
        state.x2,
        state.x3,
        state.x4,
        state.x5,
        state.x6,
        state.x7,
        state.x8,
        state.x9,
        state.x10,
        state.x11,
        state.x12,
    )
    for _ in range(parameters.substeps):
        if can_move(s):
            k1 = derivative(body, thrust, force_w, torque, s)
            k2 = derivative(body, thrust, force_w, torque, moved(s, k1, 0.5 * h))
            k3 = derivative(body, thrust, force_w, torque, moved(s, k2, 0.5 * h))
            k4 = derivative(body, thrust, force_w, torque, moved(s, k3, h))
            s = joined(s, k1, k2, k3, k4, h)
    return State(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11]), actuation


def observe(parameters: PlantParameters, vehicle: Vehicle, state: State) -> VehicleState:  # noqa: ARG001
    """Return the state as every stage sees it: the attitude of the angles, and the omega_b whose Euler rates are X's.

    omega_b comes from the inverse of Eq. 13, so a law that applies Eq. 13 gets x2, x4, x6 back to rounding.
    """
    angles = Vec3(state.x1, state.x3, state.x5)
    return VehicleState(
        Vec3(state.x7, state.x9, state.x11),
        Vec3(state.x8, state.x10, state.x12),
        quaternion_from_euler(angles),
        body_rates(angles, Vec3(state.x2, state.x4, state.x6)),
    )


def lumped(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions
) -> Disturbance:
    """Return what acts, and D_P, D_A of Eqs. 10-12 at ``state``; D_A adds to rows x2', x4', x6'."""
    actuation = allocate_within(vehicle, wrench, most_thrust(vehicle, conditions))
    body = true_body(parameters, vehicle, conditions.payload)
    thrust, force_w, torque = acting(parameters, vehicle, actuation, body, conditions)
    axis, v_w = thrust_axis(state.x1, state.x3, state.x5), (state.x8, state.x10, state.x12)
    rates = (state.x2, state.x4, state.x6)
    a = linear_acceleration(body, axis, thrust, v_w, force_w)
    alpha = angular_acceleration(body, rates, torque)
    (ax, ay, az), (bx, by, bz) = nominal_acceleration(parameters, vehicle, axis, v_w, rates, wrench)
    return as_disturbance(
        conditions, Vec3(a[0] - ax, a[1] - ay, a[2] - az), Vec3(alpha[0] - bx, alpha[1] - by, alpha[2] - bz)
    )
