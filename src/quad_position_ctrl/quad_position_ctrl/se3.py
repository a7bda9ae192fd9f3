"""Position part of geometric tracking control on SE(3), a ``quad.position_law`` plug-in.

    F   = m (-k_x e_x - k_v e_v + g e_3 + a_d - a_7 v)         force, N; e_x, e_v position and velocity error
    f   = F . R e_3                                            collective thrust, N
    b_3 = F/|F|,  b_2 = b_3 x b_1d / |b_3 x b_1d|,  b_1 = b_2 x b_3      desired body axes, b_1d the heading

Source: Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), CDC 2010, position mode.
Written for a world with z up; gains are divided by the mass. It has no integral, as in the source. Added: the limits
and the drag term -a_7 v of AIBS, k_x e_x bounded as its virtual velocity is. The rates that the source derives from
b_3 are left to the attitude law's command filter. ``geometric_pid``, ``indi`` and ``l1`` begin with this law.
"""

import math
from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, add, body_z, clamp, cross, norm, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals, Vec3
from quad_core.vehicle import DragSign, Vehicle
from quad_position_ctrl.setpoint import (
    FeedForward,
    LiftLimits,
    ThrustCommand,
    ThrustForm,
    attitude_setpoint,
    desired_angles,
    drag_model,
    internals_of,
    thrust_command,
)
from quad_position_ctrl.speed_limit import BoundedCorrection, SpeedLimits, correction_vector, proportional_correction

Internals = PositionInternals


class Gains(NamedTuple):
    """Gains of one direction."""

    position: Annotated[float, Real("1/s^2", "position gain k_x / m; larger: stiffer", 0.01, 1e4, "Lee 2010")] = 16.0
    velocity: Annotated[float, Real("1/s", "velocity gain k_v / m; larger: more damped", 0.01, 1e3, "Lee 2010")] = 6.0


class Parameters(NamedTuple):
    """Parameters of the position part."""

    xy: Gains = Gains()
    z: Gains = Gains()
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    feed_forward: FeedForward = False


class Memory(NamedTuple):
    """The law keeps nothing; Numba wants a field."""

    steps: float = 0.0


class Tracking(NamedTuple):
    """e_x in m, e_v in m/s, k_x/k_v e_x bounded in m/s, and what they ask for with drag counted: U in m/s^2, world."""

    position_error: Vec3
    velocity_error: Vec3
    correction: BoundedCorrection
    command: Vec3


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step."""
    return Memory(0.0)


def step(
    parameters: Parameters,
    vehicle: Vehicle,
    memory: Memory,
    inputs: PositionInputs,
    dt: float,  # noqa: ARG001 (the law has no dynamics)
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step. Raises nothing on flyable inputs."""
    xy, z = parameters.xy, parameters.z
    found = tracking(xy.position, xy.velocity, z.position, z.velocity, parameters.speed, vehicle, inputs)
    thrust, setpoint = pointed(parameters.limits, parameters.feed_forward, vehicle, inputs, found.command)
    internals = shown(found, inputs, found.command, ZERO, thrust, False)
    return setpoint, Memory(memory.steps + 1.0), internals


def tracking(
    position_xy: float,
    velocity_xy: float,
    position_z: float,
    velocity_z: float,
    speed: SpeedLimits,
    vehicle: Vehicle,
    inputs: PositionInputs,
) -> Tracking:
    """Return -k_x e_x - k_v e_v + a_d - a_7 v and its parts; gains over mass, k_x > 0 in 1/s^2 and k_v > 0 in 1/s."""
    state, reference = inputs.state, inputs.reference
    position_error = subtract(state.p_w, reference.p_w)
    velocity_error = subtract(state.v_w, reference.v_w)
    # k_x e_x = k_v (k_x/k_v e_x): the inner factor is a velocity, bounded like that of the other laws
    correction = proportional_correction(position_error, position_xy / velocity_xy, position_z / velocity_z, speed)
    correcting = correction_vector(correction)
    drag, v = drag_model(vehicle, DragSign.CORRECTED), state.v_w
    command = Vec3(
        reference.a_w.x + velocity_xy * (correcting.x - velocity_error.x) - drag * v.x,
        reference.a_w.y + velocity_xy * (correcting.y - velocity_error.y) - drag * v.y,
        reference.a_w.z + velocity_z * (correcting.z - velocity_error.z) - drag * v.z,
    )
    return Tracking(position_error, velocity_error, correction, command)


def pointed(
    limits: LiftLimits, feed_forward: bool, vehicle: Vehicle, inputs: PositionInputs, command: Vec3
) -> tuple[ThrustCommand, AttitudeThrust]:
    """Return thrust and attitude setpoint that come nearest to an acceleration U, ``command`` in m/s^2, world frame.

    Gravity is not counted in it. A law stops integrating where the first value is ``thrust_limited``, or its ``lift``
    ``thrust_limited``, ``acceleration_limited``, ``tilt_limited`` or ``descent_limited``. ``feed_forward``: the
    setpoint leads by the reference's jerk and snap. f = F . R e_3, and the source's axes b_1, b_2, b_3.
    """
    reference = inputs.reference
    thrust = thrust_command(command, vehicle, limits, body_z(inputs.state.q_wb), ThrustForm.PROJECTED)
    lift = thrust.lift.lift
    if feed_forward and lift.z > 0.0:
        angles = desired_angles(lift, reference.yaw, reference.yaw)  # the chain differentiates these
    else:
        angles = desired_attitude(lift, reference.yaw)
    return thrust, attitude_setpoint(vehicle, reference, angles, thrust.thrust, angles.z, feed_forward)


def shown(
    found: Tracking, inputs: PositionInputs, command: Vec3, estimate: Vec3, thrust: ThrustCommand, frozen: bool
) -> Internals:
    """Return the internals; ``command`` U and ``estimate`` of the disturbance in m/s^2."""
    virtual = add(inputs.reference.v_w, correction_vector(found.correction))
    return internals_of(
        found.position_error, found.velocity_error, virtual, command, estimate, found.correction, thrust, frozen
    )


def desired_attitude(lift: Vec3, yaw: float) -> Vec3:
    """Return (phi, theta, psi) in rad of Lee's desired axes for ``lift`` (m/s^2, world) and heading ``yaw`` in rad.

    The heading vector is projected on the plane normal to the thrust, so that psi differs a little from ``yaw`` when
    tilted to the side. Without lift, or with lift along the heading vector, the answer is the untilted attitude.
    """
    length = norm(lift)
    if length < 1e-9:
        return Vec3(0.0, 0.0, yaw)
    b3 = Vec3(lift.x / length, lift.y / length, lift.z / length)
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    across = Vec3(-b3.z * sin_yaw, b3.z * cos_yaw, b3.x * sin_yaw - b3.y * cos_yaw)
    width = norm(across)
    if width < 1e-9:
        return Vec3(0.0, 0.0, yaw)
    b2 = Vec3(across.x / width, across.y / width, across.z / width)
    b1 = cross(b2, b3)
    return Vec3(math.atan2(b2.z, b3.z), -math.asin(clamp(b1.z, -1.0, 1.0)), math.atan2(b1.y, b1.x))
