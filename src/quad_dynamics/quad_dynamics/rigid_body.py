"""Plant ``rigid_body``: Eqs. 1-9 with a unit quaternion and no small-angle step, RK4 at a fixed step.

The wrench acts in the body frame and the outer force in the world frame; both are constant over a plant period.
"""

import math
from typing import NamedTuple

from quad_core.rotations import body_z, quaternion_from_euler
from quad_core.types import Actuation, Conditions, Disturbance, Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.allocation import allocate
from quad_dynamics.newton_euler import Body, Triple, angular_acceleration, linear_acceleration, quaternion_rate
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.uncertainty import check_true_body, lumped_uncertainty, true_body, true_thrust, true_torque

Parameters = PlantParameters
# a state or its derivative inside a step: plain tuples cost CPython a fifth of NamedTuples
Flat = tuple[float, float, float, float, float, float, float, float, float, float, float, float, float]


class State(NamedTuple):
    """Position m and velocity m/s (world), attitude quaternion xyzw, body rates rad/s."""

    px: float = 0.0
    py: float = 0.0
    pz: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    vz: float = 0.0
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    qw: float = 1.0
    wx: float = 0.0
    wy: float = 0.0
    wz: float = 0.0


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0.

    Raises ValueError if mass or inertia, errors included, are not positive.
    """
    check_true_body(parameters, vehicle)
    start = parameters.initial
    q = quaternion_from_euler(Vec3(start.angles.phi, start.angles.theta, start.angles.psi))
    return State(
        start.p.x,
        start.p.y,
        start.p.z,
        start.v.x,
        start.v.y,
        start.v.z,
        q.x,
        q.y,
        q.z,
        q.w,
        start.omega.x,
        start.omega.y,
        start.omega.z,
    )


def derivative(body: Body, thrust: float, force_w: Triple, torque_b: Triple, s: Flat) -> Flat:
    """Return the derivative of state ``s`` (Eq. 1) under thrust N, outer force N (world), all torque N m (body)."""
    _, _, _, vx, vy, vz, qx, qy, qz, qw, wx, wy, wz = s
    omega = (wx, wy, wz)
    ax, ay, az = linear_acceleration(body, body_z(Quat(qx, qy, qz, qw)), thrust, (vx, vy, vz), force_w)
    dqx, dqy, dqz, dqw = quaternion_rate((qx, qy, qz, qw), omega)
    dwx, dwy, dwz = angular_acceleration(body, omega, torque_b)
    return vx, vy, vz, ax, ay, az, dqx, dqy, dqz, dqw, dwx, dwy, dwz


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
        s[12] + h * k[12],
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
        s[12] + g * (k1[12] + 2.0 * (k2[12] + k3[12]) + k4[12]),
    )


def with_unit_quaternion(s: Flat) -> Flat:
    """Return ``s`` with its quaternion scaled to length 1; one that overflowed is left for the caller's check.

    RK4 leaves the unit sphere by its local error; scaling moves the state by no more than that, so the order stays 4,
    and Eq. 4 stays a rotation for ever.
    """
    px, py, pz, vx, vy, vz, qx, qy, qz, qw, wx, wy, wz = s
    square = qx * qx + qy * qy + qz * qz + qw * qw
    scale = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
    return px, py, pz, vx, vy, vz, qx * scale, qy * scale, qz * scale, qw * scale, wx, wy, wz


def flat(state: State) -> Flat:
    """Return the numbers of ``state`` as a plain tuple."""
    return (
        state.px,
        state.py,
        state.pz,
        state.vx,
        state.vy,
        state.vz,
        state.qx,
        state.qy,
        state.qz,
        state.qw,
        state.wx,
        state.wy,
        state.wz,
    )


def step(
    parameters: PlantParameters,
    vehicle: Vehicle,
    state: State,
    wrench: Wrench,
    conditions: Conditions,
    dt: float,
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    From a flyable state (``quad_core.bounds``) and a finite wrench nothing is raised; overflow shows in the state.
    """
    actuation = allocate(vehicle, wrench)
    body = true_body(parameters, vehicle)
    thrust = true_thrust(parameters, actuation)
    torque = true_torque(parameters, actuation, conditions.torque_b)
    force_w = conditions.force_w
    h = dt / parameters.substeps
    s = flat(state)
    for _ in range(parameters.substeps):
        k1 = derivative(body, thrust, force_w, torque, s)
        k2 = derivative(body, thrust, force_w, torque, moved(s, k1, 0.5 * h))
        k3 = derivative(body, thrust, force_w, torque, moved(s, k2, 0.5 * h))
        k4 = derivative(body, thrust, force_w, torque, moved(s, k3, h))
        s = with_unit_quaternion(joined(s, k1, k2, k3, k4, h))
    return State(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11], s[12]), actuation


def observe(parameters: PlantParameters, vehicle: Vehicle, state: State) -> VehicleState:  # noqa: ARG001
    """Return the state as every stage sees it."""
    return VehicleState(
        Vec3(state.px, state.py, state.pz),
        Vec3(state.vx, state.vy, state.vz),
        Quat(state.qx, state.qy, state.qz, state.qw),
        Vec3(state.wx, state.wy, state.wz),
    )


def lumped(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions
) -> Disturbance:
    """Return what acts, and D_P, D_A of Eqs. 10-12 at ``state`` under the commanded ``wrench``."""
    return lumped_uncertainty(
        parameters,
        vehicle,
        body_z(Quat(state.qx, state.qy, state.qz, state.qw)),
        Vec3(state.vx, state.vy, state.vz),
        Vec3(state.wx, state.wy, state.wz),
        wrench,
        conditions,
    )
