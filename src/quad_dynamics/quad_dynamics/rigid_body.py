"""Plant ``rigid_body``: Eqs. 1-9 with a unit quaternion and no small-angle step, RK4 at a fixed step.

Beyond the paper, each only where vehicle, parameters or conditions ask for it: rotors that lag behind their command,
their gyroscopic torque tau_G, the drag that they induce, wind, a payload off the centre, ground contact. The wrench
acts in the body frame and the outer force in the world frame; both are constant over a plant period.
"""

import math
from typing import NamedTuple

from quad_core.conditions import as_disturbance
from quad_core.rotations import body_z, quaternion_from_euler
from quad_core.types import Actuation, Conditions, Disturbance, Quat, Vec3, VehicleState, Wrench
from quad_core.vehicle import Vehicle
from quad_dynamics.allocation import allocate_within
from quad_dynamics.ground import contact, reach
from quad_dynamics.load import NO_LOAD, Load, accelerations, is_loaded, loaded
from quad_dynamics.newton_euler import (
    Body,
    Triple,
    drag_force,
    drag_torque,
    quaternion_rate,
    thrust_force,
    wind_force,
)
from quad_dynamics.parameters import Ground, PlantParameters
from quad_dynamics.rotor_dynamics import (
    Push,
    each,
    follow,
    is_lagging,
    most_thrust,
    reported,
    share_left,
    thrusts_of,
    true_push,
)
from quad_dynamics.rotors import rotor_speed
from quad_dynamics.uncertainty import check_true_body, nominal_acceleration, true_body

Parameters = PlantParameters
# a state or its derivative inside a step: plain tuples cost CPython a fifth of NamedTuples
Flat = tuple[float, float, float, float, float, float, float, float, float, float, float, float, float]


class State(NamedTuple):
    """Position m and velocity m/s (world), attitude quaternion xyzw, body rates rad/s, rotor speeds rad/s."""

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
    r1: float = 0.0
    r2: float = 0.0
    r3: float = 0.0
    r4: float = 0.0


class Surroundings(NamedTuple):
    """What acts over a whole step: body, load, wind m/s, outer force N (world, with the wind's drag) and torque N m.

    ``extended``: whether anything acts that ``derivative`` alone does not know.
    """

    body: Body
    force_w: Triple
    torque_b: Triple
    wind_w: Triple
    carries: bool
    load: Load
    extended: bool


def init(parameters: PlantParameters, vehicle: Vehicle) -> State:
    """Return the state at step 0; rotors turn as hover wants them, on the ground at their least speed.

    Raises ValueError if mass or inertia, errors included, are not positive.
    """
    check_true_body(parameters, vehicle)
    start = parameters.initial
    q = quaternion_from_euler(Vec3(start.angles.phi, start.angles.theta, start.angles.psi))
    turning = rotor_speed(vehicle, 0.25 * vehicle.mass * vehicle.gravity)
    if parameters.ground.enabled and start.p.z <= reach(parameters.ground, vehicle):
        turning = vehicle.rotor_speed_min
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
        turning,
        turning,
        turning,
        turning,
    )


def derivative(body: Body, thrust: float, force_w: Triple, torque_b: Triple, s: Flat) -> Flat:
    """Return the derivative of state ``s`` (Eq. 1) under thrust N, outer force N (world), all torque N m (body).

    The terms of ``newton_euler`` and Eq. 4 written out: calls would be two thirds of a step. A test holds both to the
    same bits.
    """
    _, _, _, vx, vy, vz, x, y, z, w, p, q, r = s
    mass, gravity, xx, yy, zz, k, k_t, printed = body
    fx, fy, fz = force_w
    tx, ty, tz = torque_b
    if printed:
        dx, dy, dz = k_t * p * p, k_t * q * q, k_t * r * r
    else:
        k = -k
        dx, dy, dz = -k_t * abs(p) * p, -k_t * abs(q) * q, -k_t * abs(r) * r
    hp, hq, hr = 0.5 * p, 0.5 * q, 0.5 * r
    return (
        vx,
        vy,
        vz,
        (2.0 * (x * z + w * y) * thrust + k * vx + fx) / mass,
        (2.0 * (y * z - w * x) * thrust + k * vy + fy) / mass,
        ((1.0 - 2.0 * (x * x + y * y)) * thrust + k * vz + fz) / mass - gravity,
        w * hp + y * hr - z * hq,
        w * hq + z * hp - x * hr,
        w * hr + x * hq - y * hp,
        -x * hp - y * hq - z * hr,
        ((yy - zz) * q * r + tx + dx) / xx,
        ((zz - xx) * p * r + ty + dy) / yy,
        ((xx - yy) * p * q + tz + dz) / zz,
    )


def rate(ground: Ground, vehicle: Vehicle, around: Surroundings, push: Push, s: Flat) -> Flat:
    """Return the derivative of state ``s`` under what the rotors do and all that is ``around``."""
    body, (fx, fy, fz), (ox, oy, oz), wind, carries, load, extended = around
    thrust, (tx, ty, tz), spin, drag = push
    tx, ty, tz = tx + ox, ty + oy, tz + oz
    if not extended:
        return derivative(body, thrust, (fx, fy, fz), (tx, ty, tz), s)
    _, _, height, vx, vy, vz, x, y, z, w, p, q, r = s
    # tau_G = -Omega x (0, 0, spin), and the rotors' drag across their axis
    tx, ty = tx - q * spin, ty + p * spin
    ax, ay, az = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
    ux, uy, uz = vx - wind[0], vy - wind[1], vz - wind[2]
    along = ux * ax + uy * ay + uz * az
    fx, fy, fz = fx - drag * (ux - along * ax), fy - drag * (uy - along * ay), fz - drag * (uz - along * az)
    if ground.enabled and height < reach(ground, vehicle):
        held, turned = contact(ground, vehicle, body, height, (vx, vy, vz), Quat(x, y, z, w), (p, q, r))
        fx, fy, fz = fx + held[0], fy + held[1], fz + held[2]
        tx, ty, tz = tx + turned[0], ty + turned[1], tz + turned[2]
    if carries:
        return loaded_rate(body, load, thrust, (fx, fy, fz), (tx, ty, tz), s)
    return derivative(body, thrust, (fx, fy, fz), (tx, ty, tz), s)


def loaded_rate(body: Body, load: Load, thrust: float, force_w: Triple, torque_b: Triple, s: Flat) -> Flat:
    """Return the derivative of state ``s`` of a body whose payload shifts its centre of gravity (``load``)."""
    _, _, _, vx, vy, vz, x, y, z, w, p, q, r = s
    omega, q_wb = (p, q, r), Quat(x, y, z, w)
    lift = thrust_force(body_z(q_wb), thrust)
    drag, damping = drag_force(body, (vx, vy, vz)), drag_torque(body, omega)
    force = (lift[0] + drag[0] + force_w[0], lift[1] + drag[1] + force_w[1], lift[2] + drag[2] + force_w[2])
    torque = (torque_b[0] + damping[0], torque_b[1] + damping[1], torque_b[2] + damping[2])
    a, alpha = accelerations(load, body.gravity, q_wb, omega, force, torque)
    dx, dy, dz, dw = quaternion_rate((x, y, z, w), omega)
    return vx, vy, vz, a[0], a[1], a[2], dx, dy, dz, dw, alpha[0], alpha[1], alpha[2]


def surroundings(parameters: PlantParameters, vehicle: Vehicle, conditions: Conditions) -> Surroundings:
    """Return what acts over a step under ``conditions``."""
    payload = conditions.payload
    body = true_body(parameters, vehicle, payload)
    blown = wind_force(body, conditions.wind_w)
    force = conditions.force_w
    carries = is_loaded(payload)
    return Surroundings(
        body,
        (force.x + blown[0], force.y + blown[1], force.z + blown[2]),
        conditions.torque_b,
        conditions.wind_w,
        carries,
        loaded(body, payload) if carries else NO_LOAD,
        carries or parameters.ground.enabled or vehicle.rotor_inertia > 0.0 or vehicle.rotor_drag_coefficient > 0.0,
    )


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
    actuation = allocate_within(vehicle, wrench, most_thrust(vehicle, conditions))
    around = surroundings(parameters, vehicle, conditions)
    factor, working, ground = parameters.effectiveness, conditions.rotor_effectiveness, parameters.ground
    wanted = each(actuation.rotor_speed)
    lagging = is_lagging(vehicle)
    speeds = (state.r1, state.r2, state.r3, state.r4) if lagging else wanted
    thrusts = thrusts_of(vehicle, speeds) if lagging else each(actuation.rotor_thrust)
    first = middle = last = true_push(vehicle, factor, working, thrusts, speeds, wanted)
    h = dt / parameters.substeps
    s = flat(state)
    left = share_left(vehicle, 0.5 * h) if lagging else 0.0
    for _ in range(parameters.substeps):
        if lagging:
            half, speeds = follow(speeds, wanted, left), follow(speeds, wanted, left * left)
            middle = true_push(vehicle, factor, working, thrusts_of(vehicle, half), half, wanted)
            thrusts = thrusts_of(vehicle, speeds)
            last = true_push(vehicle, factor, working, thrusts, speeds, wanted)
        k1 = rate(ground, vehicle, around, first, s)
        k2 = rate(ground, vehicle, around, middle, moved(s, k1, 0.5 * h))
        k3 = rate(ground, vehicle, around, middle, moved(s, k2, 0.5 * h))
        k4 = rate(ground, vehicle, around, last, moved(s, k3, h))
        s = with_unit_quaternion(joined(s, k1, k2, k3, k4, h))
        first = last
    if lagging:
        actuation = reported(vehicle, actuation, speeds, thrusts)
    px, py, pz, vx, vy, vz, qx, qy, qz, qw, wx, wy, wz = s
    after = State(px, py, pz, vx, vy, vz, qx, qy, qz, qw, wx, wy, wz, speeds[0], speeds[1], speeds[2], speeds[3])
    return after, actuation


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
    """Return what acts, and D_P, D_A of Eqs. 10-12 at ``state`` under the commanded ``wrench``.

    All that the nominal model of Eq. 1 does not expect of the command is in them: rotor lag, wind, ground and load too.
    """
    allocated = allocate_within(vehicle, wrench, most_thrust(vehicle, conditions))
    wanted = each(allocated.rotor_speed)
    lagging = is_lagging(vehicle)
    speeds = (state.r1, state.r2, state.r3, state.r4) if lagging else wanted
    thrusts = thrusts_of(vehicle, speeds) if lagging else each(allocated.rotor_thrust)
    push = true_push(vehicle, parameters.effectiveness, conditions.rotor_effectiveness, thrusts, speeds, wanted)
    s = flat(state)
    true = rate(parameters.ground, vehicle, surroundings(parameters, vehicle, conditions), push, s)
    expected = nominal_acceleration(
        parameters, vehicle, body_z(Quat(state.qx, state.qy, state.qz, state.qw)), s[3:6], s[10:13], wrench
    )
    (ax, ay, az), (bx, by, bz) = expected
    return as_disturbance(
        conditions,
        Vec3(true[3] - ax, true[4] - ay, true[5] - az),
        Vec3(true[10] - bx, true[11] - by, true[12] - bz),
    )
