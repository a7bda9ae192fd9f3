"""Plant ``rigid_body``: Eqs. 1-9 with a unit quaternion and no small-angle step, RK4 at a fixed step.

The wrench acts in the body frame and the outer force in the world frame; both are constant over a plant period.
"""

import math
from typing import NamedTuple

from quad_core.rotations import body_z, quaternion_from_euler
from quad_core.types import Actuation, Disturbance, Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.allocation import allocate
from quad_dynamics.newton_euler import Body, angular_acceleration, linear_acceleration, quaternion_rate
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.uncertainty import check_true_body, lumped_uncertainty, true_body, true_thrust, true_torque

Parameters = PlantParameters


class State(NamedTuple):
    """Position m and velocity m/s (world), attitude quaternion xyzw, body rates rad/s; also their derivatives.

    Flat, because building nested tuples would be most of the cost of a step in CPython.
    """

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


def derivative(body: Body, thrust: float, force_w: Vec3, torque_b: Vec3, state: State) -> State:
    """Return the time derivative of ``state`` (Eq. 1) under thrust N, outer force N (world) and all torque N m (body)."""
    q = Quat(state.qx, state.qy, state.qz, state.qw)
    omega = Vec3(state.wx, state.wy, state.wz)
    a = linear_acceleration(body, body_z(q), thrust, Vec3(state.vx, state.vy, state.vz), force_w)
    dq = quaternion_rate(q, omega)
    alpha = angular_acceleration(body, omega, torque_b)
    return State(state.vx, state.vy, state.vz, a.x, a.y, a.z, dq.x, dq.y, dq.z, dq.w, alpha.x, alpha.y, alpha.z)


def moved(state: State, rate: State, h: float) -> State:
    """Return ``state`` + ``h`` * ``rate``."""
    return State(
        state.px + h * rate.px,
        state.py + h * rate.py,
        state.pz + h * rate.pz,
        state.vx + h * rate.vx,
        state.vy + h * rate.vy,
        state.vz + h * rate.vz,
        state.qx + h * rate.qx,
        state.qy + h * rate.qy,
        state.qz + h * rate.qz,
        state.qw + h * rate.qw,
        state.wx + h * rate.wx,
        state.wy + h * rate.wy,
        state.wz + h * rate.wz,
    )


def mean_rate(k1: State, k2: State, k3: State, k4: State) -> State:
    """Return (k1 + 2 k2 + 2 k3 + k4) / 6, the weights of the classical Runge-Kutta method."""
    sixth = 1.0 / 6.0
    return State(
        sixth * (k1.px + 2.0 * (k2.px + k3.px) + k4.px),
        sixth * (k1.py + 2.0 * (k2.py + k3.py) + k4.py),
        sixth * (k1.pz + 2.0 * (k2.pz + k3.pz) + k4.pz),
        sixth * (k1.vx + 2.0 * (k2.vx + k3.vx) + k4.vx),
        sixth * (k1.vy + 2.0 * (k2.vy + k3.vy) + k4.vy),
        sixth * (k1.vz + 2.0 * (k2.vz + k3.vz) + k4.vz),
        sixth * (k1.qx + 2.0 * (k2.qx + k3.qx) + k4.qx),
        sixth * (k1.qy + 2.0 * (k2.qy + k3.qy) + k4.qy),
        sixth * (k1.qz + 2.0 * (k2.qz + k3.qz) + k4.qz),
        sixth * (k1.qw + 2.0 * (k2.qw + k3.qw) + k4.qw),
        sixth * (k1.wx + 2.0 * (k2.wx + k3.wx) + k4.wx),
        sixth * (k1.wy + 2.0 * (k2.wy + k3.wy) + k4.wy),
        sixth * (k1.wz + 2.0 * (k2.wz + k3.wz) + k4.wz),
    )


def with_unit_quaternion(state: State) -> State:
    """Return ``state`` with its quaternion scaled to length 1; one that overflowed is left for the caller's check.

    RK4 leaves the unit sphere by its local error; scaling moves the state by no more than that, so the order stays 4,
    and Eq. 4 stays a rotation for ever.
    """
    square = state.qx * state.qx + state.qy * state.qy + state.qz * state.qz + state.qw * state.qw
    scale = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
    return State(
        state.px,
        state.py,
        state.pz,
        state.vx,
        state.vy,
        state.vz,
        state.qx * scale,
        state.qy * scale,
        state.qz * scale,
        state.qw * scale,
        state.wx,
        state.wy,
        state.wz,
    )


def step(
    parameters: PlantParameters,
    vehicle: Vehicle,
    state: State,
    wrench: Wrench,
    force_w: Vec3,
    torque_b: Vec3,
    dt: float,
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under a constant ``wrench`` and outer force N and torque N m, and the actuation.

    From a flyable state (``quad_core.bounds``) and a finite wrench nothing is raised; overflow shows in the state.
    """
    actuation = allocate(vehicle, wrench)
    body = true_body(parameters, vehicle)
    thrust = true_thrust(parameters, actuation)
    torque = true_torque(parameters, actuation, torque_b)
    h = dt / parameters.substeps
    for _ in range(parameters.substeps):
        k1 = derivative(body, thrust, force_w, torque, state)
        k2 = derivative(body, thrust, force_w, torque, moved(state, k1, 0.5 * h))
        k3 = derivative(body, thrust, force_w, torque, moved(state, k2, 0.5 * h))
        k4 = derivative(body, thrust, force_w, torque, moved(state, k3, h))
        state = with_unit_quaternion(moved(state, mean_rate(k1, k2, k3, k4), h))
    return state, actuation


def observe(parameters: PlantParameters, vehicle: Vehicle, state: State) -> VehicleState:
    """Return the state as every stage sees it."""
    return VehicleState(
        Vec3(state.px, state.py, state.pz),
        Vec3(state.vx, state.vy, state.vz),
        Quat(state.qx, state.qy, state.qz, state.qw),
        Vec3(state.wx, state.wy, state.wz),
    )


def lumped(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, force_w: Vec3, torque_b: Vec3
) -> Disturbance:
    """Return the outer force and torque and D_P, D_A of Eqs. 10-12 at ``state`` under the commanded ``wrench``."""
    return lumped_uncertainty(
        parameters,
        vehicle,
        body_z(Quat(state.qx, state.qy, state.qz, state.qw)),
        Vec3(state.vx, state.vy, state.vz),
        Vec3(state.wx, state.wy, state.wz),
        wrench,
        force_w,
        torque_b,
    )
