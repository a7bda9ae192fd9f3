"""The guard's own law: level attitude, controlled descent.

    tau = J (w^2 e - 2 D w omega) + omega x J omega,   e = b x d  (yaw: -J_zz k_r r),
    d along (-k_v v_x, -k_v v_y, g) within a tilt limit,
    f = m / s (g + a + k_z (v_ref - v_z) + lift) / b_z,   lift' = k_i (v_ref - v_z),   a = (v_z^2 - v_touch^2) / 2 h,

with b the body z axis, d its desired direction (both unit, world frame), w and D natural frequency and damping ratio,
s what a thrust gives over what it should give, h the height that is left; a acts on what sinks faster than v_touch.
It stops first and sinks then: v_ref is -descent_speed below walking pace and a quarter of it above. Without a heading
that can be trusted d is vertical and it sinks at once. With body rates alone f is a fixed share of the weight too.
Without any state it flies on the prediction. After 0.3 s it loses no time, for an unseen torque turns it with the
square of the time: it falls, unless it was off trim, and brakes late:

    v_ref = -sqrt(v_touch^2 + 2 a h),   a = BRAKE_SHARE of the largest deceleration.

Once an unseen torque may have turned it by WIDEST, thrust may as well push down, and there is none.

What torque the model does not explain, a failing rotor's above all, is taken off, and torque never buys thrust that was
not asked for (``quad_guard.unknown_torque``).

The law shares no text with the controllers, so that no mistake of theirs can be its own (Simplex: Sha, 2001).
"""

import math
from enum import IntEnum
from typing import NamedTuple

from quad_core.cycle import BODY_RATE_BOUND
from quad_core.geometry import ZERO, body_z, clamp, cross, dot, norm, rotate_inverse, rotated_by_vector, scale, subtract
from quad_core.node_parameters import ContactRule
from quad_core.types import Vec3, Wrench
from quad_core.vehicle import Vehicle, coupling_torque, max_thrust
from quad_guard.checks import BodyState
from quad_guard.unknown_torque import UnknownTorque, torque_at, within_rotors, within_thrust

ATTITUDE_BANDWIDTH, ATTITUDE_DAMPING, YAW_RATE_BANDWIDTH = 8.0, 0.9, 3.0
"""Natural frequency in rad/s and damping ratio of roll and pitch; bandwidth of the yaw rate in rad/s."""
VELOCITY_BANDWIDTH, VERTICAL_BANDWIDTH, VERTICAL_INTEGRAL = 1.2, 4.0, 2.0
"""Bandwidths of the horizontal and the vertical velocity in rad/s; integral gain of the latter in 1/s^2."""
BRAKE_TILT, LANDING_TILT, WALKING_PACE = 0.35, 0.15, 0.6
"""Largest tilt in rad above walking pace, and below it as at touchdown; walking pace in m/s."""
DESCENT_SPEED = 0.8  # m/s (PX4 MPC_LAND_SPEED)
BLIND_THRUST, LOWEST_THRUST, FALLING_THRUST = 0.94, 0.2, 0.05
"""Thrust over weight without a velocity that can be trusted (PX4), the least in the air, and in a fall."""
THRUST_SHARE = 0.9  # largest thrust over the largest there is: the rest makes torque
LEAST_SINK = 0.25
"""Share of the descent speed above walking pace: a wind that cannot be braked must not keep the vehicle up."""
BRAKE_SHARE, FALL_BANDWIDTH, TOUCH_SPEED, TOUCH_HEIGHT, LEAST_WAY = 0.7, 30.0, 0.8, 0.1, 0.02
"""A fall is braked with this share of the largest deceleration, within so many rad/s, to a speed in m/s so many m above
the ground; with a state, as the way in m that is left demands."""
PATIENCE = 0.3  # s without a body rate before a vehicle falls: a state back within 1 s finds it high enough to brake
OFF_TRIM = 0.04
"""Unknown roll and pitch torque, in hover torques of one rotor, beyond which a vehicle without state does not fall."""
UNSEEN_ACCELERATION, WIDEST = 2.0 / 3.0, math.radians(85.0)
"""rad/s^2 that turn a vehicle unseen (one standard deviation of the paper's), and the tilt in rad that ends thrust."""


class Sight(IntEnum):
    """What is seen of the vehicle, most first."""

    SEES = 0
    NO_HEADING = 1  # all but the heading
    TURNS = 2  # the attitude alone, by body rates
    BLIND = 3  # nothing but the prediction


LARGEST_LIFT = 0.4  # bound of the vertical integral over gravity

LEAST_COSINE = 0.5
RESTING_RAMP = 0.25
"""Share of thrust left on something that is not the ground: the motors turn until the operator disarms."""


class Known(NamedTuple):
    """What is known: ``sight`` (``Sight``), and the age of the newest body rate, ``unseen`` in s.

    ``unknown``: the torque that no wrench explains; ``strength``: what a thrust gives over what it should give;
    ``thrust``: the last one in N.
    """

    sight: int
    unseen: float
    unknown: UnknownTorque
    strength: float
    thrust: float


class Descent(NamedTuple):
    """What the backup law remembers: vertical integral m/s^2, time at rest s, share of thrust, motors stopped."""

    lift: float = 0.0
    rest_time: float = 0.0
    ramp: float = 1.0
    stopped: bool = False


FRESH_DESCENT = Descent()  # the memory of a descent that begins


def descend(
    rule: ContactRule, vehicle: Vehicle, memory: Descent, state: BodyState, height: float, known: Known, dt: float
) -> tuple[Wrench, Descent]:
    """Return the wrench of one step of ``dt`` s and the next memory; ``height`` in m above the ground."""
    sight = known.sight
    if memory.stopped or (sight == Sight.BLIND and 0.5 * UNSEEN_ACCELERATION * known.unseen * known.unseen > WIDEST):
        return Wrench(0.0, ZERO), memory
    knows_velocity = sight <= Sight.NO_HEADING
    up, direction, lift = body_z(state.q_wb), Vec3(0.0, 0.0, 1.0), memory.lift
    if not Sight.NO_HEADING <= sight <= Sight.TURNS:
        direction = desired_direction(vehicle, state)
    thrust = BLIND_THRUST * vehicle.mass * vehicle.gravity
    if sight != Sight.TURNS:
        thrust, lift = descent_thrust(vehicle, lift, state, height, known, up.z, dt)
    if up.z <= 0.0:  # thrust pushes down
        thrust = min(thrust, LOWEST_THRUST * vehicle.mass * vehicle.gravity)
    torque = level_torque(vehicle, state, up, direction)
    rest_time, ramp, stopped = contact(rule, memory, state, height, knows_velocity, dt)
    torque = within_thrust(
        vehicle, thrust, within_rotors(vehicle, subtract(torque, torque_at(vehicle, known.unknown, thrust)))
    )
    thrust, torque = ramp * thrust, scale(ramp, torque)
    if stopped:
        thrust, torque = 0.0, ZERO
    return Wrench(thrust, torque), Descent(lift, rest_time, ramp, stopped)


def slowness(state: BodyState) -> float:
    """Return 1 at or below walking pace, 0 from twice that on, linear between."""
    horizontal = math.sqrt(state.v_w.x * state.v_w.x + state.v_w.y * state.v_w.y)
    return clamp(2.0 - horizontal / WALKING_PACE, 0.0, 1.0)


def sink_speed(state: BodyState) -> float:
    """Return the descent speed in m/s that is asked for: full only when the vehicle moves slowly."""
    return DESCENT_SPEED * (LEAST_SINK + (1.0 - LEAST_SINK) * slowness(state))


def desired_direction(vehicle: Vehicle, state: BodyState) -> Vec3:
    """Return the direction of body z (unit, world) that brakes the horizontal velocity within the tilt limit."""
    limit = BRAKE_TILT + (LANDING_TILT - BRAKE_TILT) * slowness(state)
    x = -VELOCITY_BANDWIDTH * state.v_w.x / vehicle.gravity
    y = -VELOCITY_BANDWIDTH * state.v_w.y / vehicle.gravity
    tangent = math.sqrt(x * x + y * y)
    largest = math.tan(limit)
    if tangent > largest:
        x, y = x * (largest / tangent), y * (largest / tangent)
    factor = 1.0 / math.sqrt(1.0 + x * x + y * y)
    return Vec3(x * factor, y * factor, factor)


def descent_thrust(
    vehicle: Vehicle, lift: float, state: BodyState, height: float, known: Known, cosine: float, dt: float
) -> tuple[float, float]:
    """Return thrust in N and the next integral in m/s^2; ``cosine`` is that of the tilt."""
    weight, mass, fall = vehicle.mass * vehicle.gravity, vehicle.mass / known.strength, -state.v_w.z
    low, high = LOWEST_THRUST * weight, THRUST_SHARE * max_thrust(vehicle)
    left, braking, bandwidth = max(height - TOUCH_HEIGHT, LEAST_WAY), 0.0, VERTICAL_BANDWIDTH
    sinking = sink_speed(state) if known.sight == Sight.SEES else DESCENT_SPEED
    if known.sight == Sight.BLIND:
        # what was known of a large torque holds at the thrust of before; one about z tilts nothing
        unknown = known.unknown.torque
        tilting = math.sqrt(unknown.x * unknown.x + unknown.y * unknown.y)
        off_trim = tilting > OFF_TRIM * 0.25 * weight * vehicle.arm_length
        waits = off_trim or known.unseen < PATIENCE
        low = min(known.thrust, mass * vehicle.gravity) if waits else FALLING_THRUST * weight
        lift, bandwidth = 0.0, FALL_BANDWIDTH
        if height > TOUCH_HEIGHT:
            braking = BRAKE_SHARE * max(high / mass - vehicle.gravity, 0.0)
        sinking = math.sqrt(TOUCH_SPEED * TOUCH_SPEED + 2.0 * braking * left)
    elif fall > TOUCH_SPEED:
        braking = (fall * fall - TOUCH_SPEED * TOUCH_SPEED) / (2.0 * left)
    if cosine <= 0.0:
        return low, lift
    error = fall - sinking
    vertical = vehicle.gravity + braking + bandwidth * error + lift
    thrust = mass * vertical / (cosine if cosine > LEAST_COSINE else LEAST_COSINE)
    bounded = clamp(thrust, low, high)
    if bounded == thrust and known.sight != Sight.BLIND:
        bound = LARGEST_LIFT * vehicle.gravity
        lift = clamp(lift + dt * VERTICAL_INTEGRAL * error, -bound, bound)
    return bounded, lift


def level_torque(vehicle: Vehicle, state: BodyState, up: Vec3, direction: Vec3) -> Vec3:
    """Return the torque in N m, body frame, that turns body z ``up`` into ``direction`` and damps the body rates."""
    error = cross(up, direction)
    turn = rotate_inverse(state.q_wb, error)
    x, y = turn.x, turn.y
    if dot(up, direction) < 0.0:
        # beyond 90 deg the sine falls again: keep turning, upside down about body x
        sine = norm(error)
        x, y = (x / sine, y / sine) if sine > 1e-6 else (1.0, 0.0)
    stiffness = ATTITUDE_BANDWIDTH * ATTITUDE_BANDWIDTH
    damping = 2.0 * ATTITUDE_DAMPING * ATTITUDE_BANDWIDTH
    omega, coupling = state.omega_b, coupling_torque(vehicle, state.omega_b)
    return Vec3(
        vehicle.inertia_xx * (stiffness * x - damping * omega.x) - coupling[0],
        vehicle.inertia_yy * (stiffness * y - damping * omega.y) - coupling[1],
        -vehicle.inertia_zz * YAW_RATE_BANDWIDTH * omega.z - coupling[2],
    )


def contact(
    rule: ContactRule, memory: Descent, state: BodyState, height: float, knows_velocity: bool, dt: float
) -> tuple[float, float, bool]:
    """Return time at rest in s, share of thrust and whether the motors stop: at rest, asked to sink, on the ground."""
    v = state.v_w
    speed = rule.speed
    rests = knows_velocity and abs(v.x) < speed and abs(v.y) < speed and abs(v.z) < speed
    if not rests:
        return 0.0, 1.0, False
    rest_time = memory.rest_time + dt
    if rest_time < rule.time:
        return rest_time, memory.ramp, False
    low = height <= rule.stop_height
    ramp = clamp(memory.ramp - dt / rule.ramp, 0.0 if low else RESTING_RAMP, 1.0)
    return rest_time, ramp, low and ramp <= 0.0


def predict(vehicle: Vehicle, state: BodyState, wrench: Wrench, gyro: bool, dt: float) -> BodyState:
    """Return where the nominal vehicle is ``dt`` s after ``state`` (one Euler step of Eqs. 1 and 5).

    ``gyro``: the body rates are measured, not predicted.
    """
    p, v, q, omega = state.p_w, state.v_w, state.q_wb, state.omega_b
    thrust = clamp(wrench.thrust, 0.0, max_thrust(vehicle)) / vehicle.mass
    up, drag = body_z(q), vehicle.drag_coefficient / vehicle.mass
    return BodyState(
        Vec3(p.x + dt * v.x, p.y + dt * v.y, p.z + dt * v.z),
        Vec3(
            v.x + dt * (up.x * thrust - drag * v.x),
            v.y + dt * (up.y * thrust - drag * v.y),
            v.z + dt * (up.z * thrust - drag * v.z - vehicle.gravity),
        ),
        rotated_by_vector(q, scale(dt, omega)),
        omega if gyro else predicted_rates(vehicle, omega, wrench.torque_b, dt),
    )


def predicted_rates(vehicle: Vehicle, omega: Vec3, torque: Vec3, dt: float) -> Vec3:
    """Return the body rates in rad/s ``dt`` s later under ``torque`` N m, bounded."""
    coupling, bound = coupling_torque(vehicle, omega), BODY_RATE_BOUND
    return Vec3(
        clamp(omega.x + dt * (torque.x + coupling[0]) / vehicle.inertia_xx, -bound, bound),
        clamp(omega.y + dt * (torque.y + coupling[1]) / vehicle.inertia_yy, -bound, bound),
        clamp(omega.z + dt * (torque.z + coupling[2]) / vehicle.inertia_zz, -bound, bound),
    )
