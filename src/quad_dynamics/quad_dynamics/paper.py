"""Plant ``paper``: Eq. 16, where Euler accelerations are taken for body accelerations (Eq. 14), RK4 at a fixed step.

Right for small angles only; angles are not wrapped and theta may pass 90 degrees, where Eq. 16 goes on regardless.
Eq. 16 has the external disturbance as acceleration; it comes in here as force and torque (Appendix A).
"""

import math
from typing import NamedTuple

from quad_core.rotations import body_rates, euler_rates, quaternion_from_euler
from quad_core.types import Actuation, Disturbance, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.allocation import allocate
from quad_dynamics.newton_euler import Body, angular_acceleration, linear_acceleration
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.uncertainty import check_true_body, lumped_uncertainty, true_body, true_thrust, true_torque

Parameters = PlantParameters
LARGEST_RATE = 1e6


class State(NamedTuple):
    """X of Eq. 16: (phi, phi', theta, theta', psi, psi', x, x', y, y', z, z') in rad, rad/s, m, m/s; also X'."""

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

    Raises ValueError if mass or inertia, errors included, are not positive.
    """
    check_true_body(parameters, vehicle)
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


def thrust_axis(phi: float, theta: float, psi: float) -> Vec3:
    """Return the body z axis in the world: third column of Eq. 4, as in Eq. 15; angles in rad."""
    sphi, cphi = math.sin(phi), math.cos(phi)
    stheta, ctheta = math.sin(theta), math.cos(theta)
    spsi, cpsi = math.sin(psi), math.cos(psi)
    return Vec3(
        cphi * stheta * cpsi + sphi * spsi,
        cphi * stheta * spsi - sphi * cpsi,
        cphi * ctheta,
    )


def derivative(body: Body, thrust: float, force_w: Vec3, torque_b: Vec3, state: State) -> State:
    """Return X' of Eq. 16 under thrust N, outer force N (world) and all torque N m.

    The rows for x2, x4, x6 are those of Eq. 1 with Euler rates for body rates: a1..a6, b1..b3 of Eq. 17.
    """
    axis = thrust_axis(state.x1, state.x3, state.x5)
    a = linear_acceleration(body, axis, thrust, Vec3(state.x8, state.x10, state.x12), force_w)
    alpha = angular_acceleration(body, Vec3(state.x2, state.x4, state.x6), torque_b)
    return State(state.x2, alpha.x, state.x4, alpha.y, state.x6, alpha.z, state.x8, a.x, state.x10, a.y, state.x12, a.z)


def moved(state: State, rate: State, h: float) -> State:
    """Return ``state`` + ``h`` * ``rate``."""
    return State(
        state.x1 + h * rate.x1,
        state.x2 + h * rate.x2,
        state.x3 + h * rate.x3,
        state.x4 + h * rate.x4,
        state.x5 + h * rate.x5,
        state.x6 + h * rate.x6,
        state.x7 + h * rate.x7,
        state.x8 + h * rate.x8,
        state.x9 + h * rate.x9,
        state.x10 + h * rate.x10,
        state.x11 + h * rate.x11,
        state.x12 + h * rate.x12,
    )


def mean_rate(k1: State, k2: State, k3: State, k4: State) -> State:
    """Return (k1 + 2 k2 + 2 k3 + k4) / 6, the weights of the classical Runge-Kutta method."""
    sixth = 1.0 / 6.0
    return State(
        sixth * (k1.x1 + 2.0 * (k2.x1 + k3.x1) + k4.x1),
        sixth * (k1.x2 + 2.0 * (k2.x2 + k3.x2) + k4.x2),
        sixth * (k1.x3 + 2.0 * (k2.x3 + k3.x3) + k4.x3),
        sixth * (k1.x4 + 2.0 * (k2.x4 + k3.x4) + k4.x4),
        sixth * (k1.x5 + 2.0 * (k2.x5 + k3.x5) + k4.x5),
        sixth * (k1.x6 + 2.0 * (k2.x6 + k3.x6) + k4.x6),
        sixth * (k1.x7 + 2.0 * (k2.x7 + k3.x7) + k4.x7),
        sixth * (k1.x8 + 2.0 * (k2.x8 + k3.x8) + k4.x8),
        sixth * (k1.x9 + 2.0 * (k2.x9 + k3.x9) + k4.x9),
        sixth * (k1.x10 + 2.0 * (k2.x10 + k3.x10) + k4.x10),
        sixth * (k1.x11 + 2.0 * (k2.x11 + k3.x11) + k4.x11),
        sixth * (k1.x12 + 2.0 * (k2.x12 + k3.x12) + k4.x12),
    )


def can_move(state: State) -> bool:
    """Return whether the Euler rates are finite and at most 1e6 rad/s, so that one more step cannot overflow."""
    return abs(state.x2) <= LARGEST_RATE and abs(state.x4) <= LARGEST_RATE and abs(state.x6) <= LARGEST_RATE


def step(
    parameters: PlantParameters,
    vehicle: Vehicle,
    state: State,
    wrench: Wrench,
    force_w: Vec3,
    torque_b: Vec3,
    dt: float,
) -> tuple[State, Actuation]:
    """Return X ``dt`` s later under a constant ``wrench`` and outer force N and torque N m, and the actuation.

    A state whose rates left all bounds stays as it is (the sine of infinity raises); the caller's check ends the flight.
    """
    actuation = allocate(vehicle, wrench)
    body = true_body(parameters, vehicle)
    thrust = true_thrust(parameters, actuation)
    torque = true_torque(parameters, actuation, torque_b)
    h = dt / parameters.substeps
    for _ in range(parameters.substeps):
        if not can_move(state):
            return state, actuation
        k1 = derivative(body, thrust, force_w, torque, state)
        k2 = derivative(body, thrust, force_w, torque, moved(state, k1, 0.5 * h))
        k3 = derivative(body, thrust, force_w, torque, moved(state, k2, 0.5 * h))
        k4 = derivative(body, thrust, force_w, torque, moved(state, k3, h))
        state = moved(state, mean_rate(k1, k2, k3, k4), h)
    return state, actuation


def observe(parameters: PlantParameters, vehicle: Vehicle, state: State) -> VehicleState:
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
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, force_w: Vec3, torque_b: Vec3
) -> Disturbance:
    """Return the outer force and torque and D_P, D_A of Eqs. 10-12 at ``state``; D_A adds to rows x2', x4', x6'."""
    return lumped_uncertainty(
        parameters,
        vehicle,
        thrust_axis(state.x1, state.x3, state.x5),
        Vec3(state.x8, state.x10, state.x12),
        Vec3(state.x2, state.x4, state.x6),
        wrench,
        force_w,
        torque_b,
    )
