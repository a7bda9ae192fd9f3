"""Cascaded PID as common autopilots fly it: position P, velocity PID, a ``quad.position_law`` plug-in.

Source: the multicopter position controller of the PX4 autopilot (``PositionControl``): the position error in proportion
gives a bounded velocity on top of the reference's, the velocity error gives an acceleration through P and I, the D part
acts on the measured acceleration, the reference's acceleration is fed forward, and thrust and attitude follow from the
acceleration (``thrust_vector``). The bound on the velocity is that of AIBS (``speed_limit``).
"""

import math
from typing import Annotated, NamedTuple

from quad_core.parameters import Flag, Real
from quad_core.rotations import body_z, euler_from_quaternion
from quad_core.types import AttitudeThrust, PositionInputs, Vec3
from quad_core.vehicle import Vehicle
from quad_position_ctrl.aibs import Internals
from quad_position_ctrl.cascade import approach, difference, is_limited, plain_internals, reach, setpoint
from quad_position_ctrl.speed_limit import SpeedLimits
from quad_position_ctrl.thrust_vector import Limits, clamped, desired_angles


class Gains(NamedTuple):
    """Gains of one direction."""

    position: Annotated[float, Real("1/s", "P of the position", 0.01, 100.0)] = 2.5
    velocity: Annotated[float, Real("1/s", "P of the velocity", 0.0, 1e3)] = 6.0
    integral: Annotated[float, Real("1/s^2", "I of the velocity", 0.0, 1e3)] = 3.0
    derivative: Annotated[float, Real("", "D of the velocity, on the measured acceleration", 0.0, 10.0)] = 0.05
    max_integral: Annotated[float, Real("m/s^2", "bound of the I part", 0.0, 1e3)] = 5.0


class Parameters(NamedTuple):
    """Parameters of the cascaded PID."""

    xy: Gains = Gains()
    z: Gains = Gains()
    derivative_bandwidth: Annotated[
        float, Real("rad/s", "low-pass of the acceleration that the D part sees", 0.1, 1e4)
    ] = 60.0
    anti_windup: Annotated[bool, Flag("the I part rests while a limit is met, here or in `actuation`")] = True
    speed: SpeedLimits = SpeedLimits()
    limits: Limits = Limits()


class Memory(NamedTuple):
    """I part and filtered acceleration in m/s^2, velocity of the last step in m/s."""

    integral: Vec3 = Vec3()
    acceleration: Vec3 = Vec3()
    velocity: Vec3 = Vec3()
    initialised: float = 0.0


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no I part."""
    zero = Vec3(0.0, 0.0, 0.0)
    return Memory(zero, zero, zero, 0.0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    ``disturbance_estimate`` of the internals is minus the I part: what the law believes d to be.
    """
    state, reference = inputs.state, inputs.reference
    xy, z = parameters.xy, parameters.z
    error = difference(state.p_w, reference.p_w)
    wanted = approach(xy.position, z.position, error, parameters.speed)
    v_d = Vec3(
        reference.v_w.x + wanted.velocity.x, reference.v_w.y + wanted.velocity.y, reference.v_w.z + wanted.velocity.z
    )
    error_v = difference(state.v_w, v_d)
    acceleration = _acceleration(parameters.derivative_bandwidth, memory, state.v_w, dt)
    a_d, part = reference.a_w, memory.integral
    command = Vec3(
        a_d.x - xy.velocity * error_v.x + part.x - xy.derivative * acceleration.x,
        a_d.y - xy.velocity * error_v.y + part.y - xy.derivative * acceleration.y,
        a_d.z - z.velocity * error_v.z + part.z - z.derivative * acceleration.z,
    )
    reached = reach(command, vehicle, parameters.limits, body_z(state.q_wb))
    heading = euler_from_quaternion(state.q_wb).z
    angles = desired_angles(reached.limits.lift, heading, reference.yaw)
    answer = setpoint(vehicle, reference, angles, reached.thrust)

    frozen = parameters.anti_windup and is_limited(reached, wanted.limited, inputs.actuation)
    integral = part
    if not frozen:
        integral = Vec3(
            _integrated(xy, part.x, error_v.x, dt),
            _integrated(xy, part.y, error_v.y, dt),
            _integrated(z, part.z, error_v.z, dt),
        )
    kept = Memory(integral, acceleration, state.v_w, 1.0)
    estimate = Vec3(-part.x, -part.y, -part.z)
    return answer, kept, plain_internals(error, error_v, v_d, command, estimate, wanted, reached, frozen)


def _acceleration(bandwidth: float, memory: Memory, velocity: Vec3, dt: float) -> Vec3:
    """Return the low-passed acceleration in m/s^2 from the change of velocity over the last step."""
    if memory.initialised <= 0.0:
        return memory.acceleration
    gain = 1.0 - math.exp(-bandwidth * dt)
    before, last = memory.acceleration, memory.velocity
    return Vec3(
        before.x + gain * ((velocity.x - last.x) / dt - before.x),
        before.y + gain * ((velocity.y - last.y) / dt - before.y),
        before.z + gain * ((velocity.z - last.z) / dt - before.z),
    )


def _integrated(gains: Gains, part: float, velocity_error: float, dt: float) -> float:
    """Return the I part in m/s^2 after a step of ``dt`` s."""
    return clamped(part - gains.integral * velocity_error * dt, -gains.max_integral, gains.max_integral)
