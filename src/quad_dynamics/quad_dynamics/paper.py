"""Plant ``paper``: Eq. 16, where Euler accelerations are taken for body accelerations (Eq. 14), RK4 at a fixed step.

Right for small angles only; angles are not wrapped and theta may pass 90 degrees, where Eq. 16 goes on regardless.
Eq. 16 has the external disturbance as acceleration; it comes in here as force and torque (Appendix A). Of the
conditions it knows wind (as drag), rotors that fail, battery and the mass of a payload. Its rotors are ideal, and it
has no ground.
"""

import math
from typing import NamedTuple

from quad_core.cycle import as_disturbance
from quad_core.geometry import add, body_rates, euler_rates, quaternion_from_euler
from quad_core.types import Actuation, Conditions, Disturbance, Vec3, VehicleState, Wrench, fresh
from quad_core.vehicle import Triple, Vehicle
from quad_dynamics.newton_euler import Body, Flat, angular_acceleration, linear_acceleration, rk4, true_body, wind_force
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.rotors import allocate_within, max_rotor_thrust, rotor_wrench
from quad_dynamics.uncertainty import check_true_body, nominal_acceleration

Parameters = PlantParameters
LARGEST_RATE = 1e6


class State(NamedTuple):
    """X of Eq. 16: (phi, phi', theta, theta', psi, psi', x, x', y, y', z, z') in rad, rad/s, m, m/s."""

    x1: float = 0.0  # [rad]
    x2: float = 0.0  # [rad/s]
    x3: float = 0.0  # [rad]
    x4: float = 0.0  # [rad/s]
    x5: float = 0.0  # [rad]
    x6: float = 0.0  # [rad/s]
    x7: float = 0.0  # [m]
    x8: float = 0.0  # [m/s]
    x9: float = 0.0  # [m]
    x10: float = 0.0  # [m/s]
    x11: float = 0.0  # [m]
    x12: float = 0.0  # [m/s]


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return X at step 0; the initial body rates become Euler rates by Eq. 13.

    Raises ValueError if mass, inertia or drag, errors included, are not physical, or a ground or lag is asked for.
    """
    check_true_body(parameters, vehicle)
    if parameters.ground.enabled:
        raise ValueError("ground.enabled: found true, expected false: plant paper has no ground")
    if parameters.lag_error != 0.0:
        raise ValueError(f"lag_error: found {parameters.lag_error:g} s, expected 0: plant paper has ideal rotors")
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


class Acting(NamedTuple):
    """What acts over a step: thrust N, outer force N (world) and all torque N m (body)."""

    thrust: float
    force_w: Vec3
    torque_b: Vec3


def derivative(body: Body, acting: Acting, s: Flat) -> Flat:
    """Return X' of Eq. 16 at X = the first twelve numbers of ``s``.

    The rows for x2, x4, x6 are those of Eq. 1 with Euler rates for body rates: a1..a6, b1..b3 of Eq. 17.
    """
    x1, x2, x3, x4, x5, x6, _, x8, _, x10, _, x12, _ = s
    ax, ay, az = linear_acceleration(body, thrust_axis(x1, x3, x5), acting.thrust, (x8, x10, x12), acting.force_w)
    dx2, dx4, dx6 = angular_acceleration(body, (x2, x4, x6), acting.torque_b)
    return x2, dx2, x4, dx4, x6, dx6, x8, ax, x10, ay, x12, az, 0.0


def can_move(s: Flat) -> bool:
    """Return whether the Euler rates are finite and at most 1e6 rad/s, so that one more step cannot overflow."""
    return abs(s[1]) <= LARGEST_RATE and abs(s[3]) <= LARGEST_RATE and abs(s[5]) <= LARGEST_RATE


def acting_on(
    parameters: PlantParameters, vehicle: Vehicle, wrench: Wrench, conditions: Conditions
) -> tuple[Actuation, Body, Acting]:
    """Return what the rotors make of ``wrench``, the true body, and what acts over a step under ``conditions``."""
    actuation = allocate_within(vehicle, wrench, max_rotor_thrust(vehicle, conditions))
    body = true_body(parameters, vehicle, conditions.payload_mass)
    factor, working, speeds = parameters.effectiveness, conditions.rotor_effectiveness, actuation.rotor_speed
    rotors = rotor_wrench(vehicle, factor, working, actuation.rotor_thrust, speeds, speeds, 0.0)
    force_w = add(conditions.force_w, Vec3(*wind_force(body, conditions.wind_w)))
    return actuation, body, Acting(rotors.thrust, force_w, add(rotors.torque_b, conditions.torque_b))


def step(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions, dt: float
) -> tuple[State, Actuation]:
    """Return X ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    A state whose rates left all bounds stays as it is (the sine of infinity raises); the caller ends the flight.
    """
    actuation, body, acting = acting_on(parameters, vehicle, wrench, conditions)
    h = dt / parameters.substeps
    x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12 = state
    s = (x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, 0.0)
    for _ in range(parameters.substeps):
        if can_move(s):
            s = rk4(derivative, body, acting, acting, acting, s, h)
    return State(*s[:12]), actuation


def observe(parameters: PlantParameters, vehicle: Vehicle, state: State) -> VehicleState:  # noqa: ARG001
    """Return the state as every stage sees it: the attitude of the angles, and the omega_b whose Euler rates are X's.

    omega_b comes from the inverse of Eq. 13, so a law that applies Eq. 13 gets x2, x4, x6 back to rounding.
    """
    angles = Vec3(state.x1, state.x3, state.x5)
    return fresh(
        Vec3(state.x7, state.x9, state.x11),
        Vec3(state.x8, state.x10, state.x12),
        quaternion_from_euler(angles),
        body_rates(angles, Vec3(state.x2, state.x4, state.x6)),
    )


def lumped(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions
) -> Disturbance:
    """Return what acts, and D_P, D_A of Eqs. 10-12 at ``state``; D_A adds to rows x2', x4', x6'."""
    _, body, acting = acting_on(parameters, vehicle, wrench, conditions)
    axis, v_w = thrust_axis(state.x1, state.x3, state.x5), (state.x8, state.x10, state.x12)
    rates = (state.x2, state.x4, state.x6)
    a = linear_acceleration(body, axis, acting.thrust, v_w, acting.force_w)
    alpha = angular_acceleration(body, rates, acting.torque_b)
    (ax, ay, az), (bx, by, bz) = nominal_acceleration(parameters, vehicle, axis, v_w, rates, wrench)
    return as_disturbance(
        conditions, Vec3(a[0] - ax, a[1] - ay, a[2] - az), Vec3(alpha[0] - bx, alpha[1] - by, alpha[2] - bz)
    )
