"""Plant ``rigid_body``: Eqs. 1-9 with a unit quaternion and no small-angle step, RK4 at a fixed step.

Beyond the paper, each only where vehicle, parameters or conditions ask for it: rotors that lag behind their command,
their gyroscopic torque tau_G, the drag that they induce, wind, ground contact. The wrench acts in the body frame and
the outer force in the world frame; both are constant over a plant period.
"""

import math
from typing import NamedTuple

from quad_core.cycle import as_disturbance
from quad_core.geometry import add, body_z, quaternion_from_euler
from quad_core.types import Actuation, Conditions, Disturbance, Quat, Rotors, Vec3, VehicleState, Wrench, fresh
from quad_core.vehicle import Triple, Vehicle
from quad_dynamics.ground import contact, contact_height
from quad_dynamics.newton_euler import (
    Body,
    Flat,
    angular_acceleration,
    linear_acceleration,
    quaternion_rate,
    rk4,
    true_body,
    wind_force,
)
from quad_dynamics.parameters import Ground, PlantParameters
from quad_dynamics.rotors import (
    RotorWrench,
    allocate_within,
    decay,
    known_speeds,
    lagged,
    max_rotor_thrust,
    reached,
    rotor_lag,
    rotor_speed,
    rotor_thrusts,
    rotor_wrench,
)
from quad_dynamics.uncertainty import check_true_body, nominal_acceleration

Parameters = PlantParameters


class State(NamedTuple):
    """Motion of the body's centre of gravity, rotor speeds in rad/s, and those that `actuation` told."""

    motion: VehicleState = VehicleState()
    rotor_speed: Rotors = Rotors()  # [rad/s]
    known_speed: Rotors = Rotors()  # [rad/s]


class Surroundings(NamedTuple):
    """What is constant over a step: the vehicle and what acts on it apart from its rotors.

    ``body`` includes the mass of a payload. Outer force N (world, with the wind's part of the drag) and torque N m,
    wind m/s. ``extended``: whether anything acts that Eq. 1 does not know.
    """

    vehicle: Vehicle
    ground: Ground
    body: Body
    force_w: Vec3
    torque_b: Vec3
    wind_w: Vec3
    extended: bool


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0; rotors start at hover speed, or idle on the ground.

    Raises ValueError if mass, inertia, drag or lag, errors included, are not physical.
    """
    check_true_body(parameters, vehicle)
    p, v, angles, omega = parameters.initial
    speed = rotor_speed(vehicle, 0.25 * vehicle.mass * vehicle.gravity)
    if parameters.ground.enabled and p.z <= contact_height(parameters.ground, vehicle):
        speed = vehicle.rotor_speed_min
    q_wb = quaternion_from_euler(Vec3(angles.phi, angles.theta, angles.psi))
    motion = fresh(Vec3(p.x, p.y, p.z), Vec3(v.x, v.y, v.z), q_wb, Vec3(omega.x, omega.y, omega.z))
    speeds = Rotors(speed, speed, speed, speed)
    return State(motion, speeds, speeds)


def surroundings(parameters: PlantParameters, vehicle: Vehicle, conditions: Conditions) -> Surroundings:
    """Return what acts over a step under ``conditions``."""
    body = true_body(parameters, vehicle, conditions.payload_mass)
    return Surroundings(
        vehicle=vehicle,
        ground=parameters.ground,
        body=body,
        force_w=add(conditions.force_w, Vec3(*wind_force(body, conditions.wind_w))),
        torque_b=conditions.torque_b,
        wind_w=conditions.wind_w,
        extended=parameters.ground.enabled or vehicle.rotor_inertia > 0.0 or vehicle.rotor_drag_coefficient > 0.0,
    )


def derivative(around: Surroundings, rotors: RotorWrench, s: Flat) -> Flat:
    """Return the derivative of ``s`` (p, v, q, omega) under what the rotors do and all that is ``around``: Eq. 1."""
    _, _, height, vx, vy, vz, x, y, z, w, p, q, r = s
    v_w, q_wb, omega_b = (vx, vy, vz), Quat(x, y, z, w), (p, q, r)
    body, thrust, axis = around.body, rotors.thrust, body_z(q_wb)
    force, torque = around.force_w, add(rotors.torque_b, around.torque_b)
    if around.extended:
        force, torque = with_extensions(around, rotors, axis, height, v_w, q_wb, omega_b, torque)
    a = linear_acceleration(body, axis, thrust, v_w, force)
    alpha = angular_acceleration(body, omega_b, torque)
    dx, dy, dz, dw = quaternion_rate(q_wb, omega_b)
    return vx, vy, vz, a[0], a[1], a[2], dx, dy, dz, dw, alpha[0], alpha[1], alpha[2]


def with_extensions(
    around: Surroundings,
    rotors: RotorWrench,
    axis_w: Vec3,
    height: float,
    v_w: Triple,
    q_wb: Quat,
    omega_b: Triple,
    torque_b: Vec3,
) -> tuple[Vec3, Vec3]:
    """Return outer force N and torque N m with tau_G, the drag of the rotors and the ground added.

    tau_G is -Omega x (0, 0, spin); the drag is that of the air speed across the rotors' axis ``axis_w``.
    """
    force, wind, drag = around.force_w, around.wind_w, rotors.drag
    tx, ty, tz = torque_b.x - omega_b[1] * rotors.spin, torque_b.y + omega_b[0] * rotors.spin, torque_b.z
    ux, uy, uz = v_w[0] - wind.x, v_w[1] - wind.y, v_w[2] - wind.z
    along = ux * axis_w.x + uy * axis_w.y + uz * axis_w.z
    fx = force.x - drag * (ux - along * axis_w.x)
    fy = force.y - drag * (uy - along * axis_w.y)
    fz = force.z - drag * (uz - along * axis_w.z)
    if around.ground.enabled and height < contact_height(around.ground, around.vehicle):
        support, turning = contact(around.ground, around.vehicle, around.body, height, v_w, q_wb, omega_b)
        fx, fy, fz = fx + support[0], fy + support[1], fz + support[2]
        tx, ty, tz = tx + turning[0], ty + turning[1], tz + turning[2]
    return Vec3(fx, fy, fz), Vec3(tx, ty, tz)


def with_unit_quaternion(s: Flat) -> Flat:
    """Return ``s`` with its quaternion scaled to length 1; one that overflowed is left for the caller's check.

    RK4 leaves the unit sphere by its local error; scaling moves the state by no more than that, so the order stays 4,
    and Eq. 4 stays a rotation for ever.
    """
    px, py, pz, vx, vy, vz, qx, qy, qz, qw, wx, wy, wz = s
    square = qx * qx + qy * qy + qz * qz + qw * qw
    scale = 1.0 / math.sqrt(square) if square > 0.0 else 1.0
    return px, py, pz, vx, vy, vz, qx * scale, qy * scale, qz * scale, qw * scale, wx, wy, wz


def flat(motion: VehicleState) -> Flat:
    """Return p m, v m/s, q and omega rad/s as a plain tuple."""
    p, v, q, omega = motion.p_w, motion.v_w, motion.q_wb, motion.omega_b
    return p.x, p.y, p.z, v.x, v.y, v.z, q.x, q.y, q.z, q.w, omega.x, omega.y, omega.z


def nested(s: Flat) -> VehicleState:
    """Return the motion whose numbers are ``s``; inverse of ``flat``."""
    return fresh(Vec3(*s[:3]), Vec3(*s[3:6]), Quat(*s[6:10]), Vec3(*s[10:]))


def rotors_at_start(vehicle: Vehicle, state: State, actuation: Actuation, lag: float) -> tuple[Rotors, Rotors]:
    """Return speeds rad/s and thrusts N of the rotors as a step begins; those without ``lag`` are at their command."""
    if lag > 0.0:
        return state.rotor_speed, rotor_thrusts(vehicle, state.rotor_speed)
    return actuation.rotor_speed, actuation.rotor_thrust


def step(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions, dt: float
) -> tuple[State, Actuation]:
    """Return the state ``dt`` s later under a constant ``wrench`` and constant ``conditions``, and the actuation.

    From a flyable state (``cycle.is_flyable``) and a finite wrench nothing is raised; overflow shows in the state.
    """
    actuation = allocate_within(vehicle, wrench, max_rotor_thrust(vehicle, conditions))
    around = surroundings(parameters, vehicle, conditions)
    factor, working, commanded = parameters.effectiveness, conditions.rotor_effectiveness, actuation.rotor_speed
    lag = rotor_lag(parameters, vehicle)
    speeds, thrusts = rotors_at_start(vehicle, state, actuation, lag)
    first = middle = last = rotor_wrench(vehicle, factor, working, thrusts, speeds, commanded, lag)
    h = dt / parameters.substeps
    half_decay = decay(lag, 0.5 * h) if lag > 0.0 else 0.0
    s = flat(state.motion)
    for _ in range(parameters.substeps):
        if lag > 0.0:
            half = lagged(speeds, commanded, half_decay)
            speeds = lagged(speeds, commanded, half_decay * half_decay)
            middle = rotor_wrench(vehicle, factor, working, rotor_thrusts(vehicle, half), half, commanded, lag)
            last = rotor_wrench(vehicle, factor, working, rotor_thrusts(vehicle, speeds), speeds, commanded, lag)
        s = with_unit_quaternion(rk4(derivative, around, first, middle, last, s, h))
        first = last
    known = known_speeds(parameters, vehicle, state.known_speed, commanded, speeds, dt)
    if lag > 0.0 or parameters.lag_error != 0.0:
        actuation = reached(vehicle, actuation, known)
    return State(nested(s), speeds, known), actuation


def observe(parameters: PlantParameters, vehicle: Vehicle, state: State) -> VehicleState:  # noqa: ARG001
    """Return the state as every stage sees it."""
    return state.motion


def lumped(
    parameters: PlantParameters, vehicle: Vehicle, state: State, wrench: Wrench, conditions: Conditions
) -> Disturbance:
    """Return what acts, and D_P, D_A of Eqs. 10-12 at ``state`` under the commanded ``wrench``.

    All that the nominal model of Eq. 1 does not expect of the command is in them: rotor lag, wind and ground too.
    """
    actuation = allocate_within(vehicle, wrench, max_rotor_thrust(vehicle, conditions))
    lag = rotor_lag(parameters, vehicle)
    factor, working, commanded = parameters.effectiveness, conditions.rotor_effectiveness, actuation.rotor_speed
    speeds, thrusts = rotors_at_start(vehicle, state, actuation, lag)
    rotors = rotor_wrench(vehicle, factor, working, thrusts, speeds, commanded, lag)
    motion = state.motion
    true = derivative(surroundings(parameters, vehicle, conditions), rotors, flat(motion))
    (ax, ay, az), (bx, by, bz) = nominal_acceleration(
        parameters, vehicle, body_z(motion.q_wb), motion.v_w, motion.omega_b, wrench
    )
    return as_disturbance(
        conditions, Vec3(true[3] - ax, true[4] - ay, true[5] - az), Vec3(true[10] - bx, true[11] - by, true[12] - bz)
    )
