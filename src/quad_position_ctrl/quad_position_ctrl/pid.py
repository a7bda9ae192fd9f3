"""Cascaded PID as common autopilots fly it: position P, velocity PID, a ``quad.position_law`` plug-in.

    v_d     = v_r - K_p (p - p_r), the correction bounded                                    velocity, m/s
    a       = a_r - K_v (v - v_d) + I - K_d dv/dt, low-passed, - a_7 v                       command, m/s^2
    I'      = -K_i (v - v_d), |I| <= max                                                     I part, m/s^2
    F_T     = m (a + g e_z) . b_z, and the attitude that points a + g e_z (Eq. 38)           thrust, N

Source: the multicopter position controller of the PX4 autopilot (``PositionControl``): the position error in proportion
gives a bounded velocity on top of the reference's, the velocity error gives an acceleration through P and I, the D part
acts on the measured acceleration, the reference's acceleration is fed forward, and thrust and attitude follow from the
acceleration (Eq. 38). Limits, set-up and drag term -a_7 v are those of AIBS (``speed_limit``, ``setpoint``).
"""

from typing import Annotated, NamedTuple

from quad_core.geometry import ZERO, add, body_z, clamp, euler_from_quaternion, low_passed, scale, slope, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeThrust, PositionInputs, PositionInternals, Vec3
from quad_core.vehicle import DragSign, Vehicle
from quad_position_ctrl.setpoint import (
    AntiWindup,
    FeedForward,
    LiftLimits,
    ThrustForm,
    attitude_setpoint,
    desired_angles,
    drag_model,
    integrals_frozen,
    internals_of,
    thrust_command,
)
from quad_position_ctrl.speed_limit import SpeedLimits, correction_vector, proportional_correction

Internals = PositionInternals


class Gains(NamedTuple):
    """Gains of one direction."""

    position: Annotated[float, Real("1/s", "P of the position; larger: stiffer", 0.01, 100.0)] = 2.5
    velocity: Annotated[float, Real("1/s", "P of the velocity; larger: more damped", 0.0, 1e3)] = 6.0
    integral: Annotated[float, Real("1/s^2", "I of the velocity; larger: offsets go faster; 0: off", 0.0, 1e3)] = 3.0
    derivative: Annotated[float, Real("", "D of the velocity, on the measured acceleration; 0: off", 0.0, 10.0)] = 0.05
    max_integral: Annotated[float, Real("m/s^2", "largest I part", 0.0, 1e3)] = 5.0


class Parameters(NamedTuple):
    """Parameters of the cascaded PID."""

    xy: Gains = Gains()
    z: Gains = Gains()
    derivative_bandwidth: Annotated[
        float, Real("rad/s", "low-pass of the D part's acceleration; larger: less lag, more noise", 0.1, 1e4)
    ] = 60.0
    anti_windup: AntiWindup = True
    speed: SpeedLimits = SpeedLimits()
    limits: LiftLimits = LiftLimits()
    feed_forward: FeedForward = False


class Memory(NamedTuple):
    """I part and filtered acceleration in m/s^2, velocity of the last step in m/s."""

    integral: Vec3 = Vec3()
    acceleration: Vec3 = Vec3()
    velocity: Vec3 = Vec3()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no I part."""
    return Memory(integral=ZERO, acceleration=ZERO, velocity=ZERO, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: PositionInputs, dt: float
) -> tuple[AttitudeThrust, Memory, Internals]:
    """Return setpoint, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    ``disturbance_estimate`` of the internals is minus the I part: what the law accepts d to be.
    """
    state, reference = inputs.state, inputs.reference
    xy, z = parameters.xy, parameters.z
    position_error = subtract(state.p_w, reference.p_w)
    correction = proportional_correction(position_error, xy.position, z.position, parameters.speed)
    desired_velocity = add(reference.v_w, correction_vector(correction))
    velocity_error = subtract(state.v_w, desired_velocity)
    acceleration = memory.acceleration
    if memory.initialised:
        acceleration = low_passed(
            acceleration, slope(memory.velocity, state.v_w, dt), parameters.derivative_bandwidth, dt
        )
    a_d, part, drag, v = reference.a_w, memory.integral, drag_model(vehicle, DragSign.CORRECTED), state.v_w
    command = Vec3(
        a_d.x - xy.velocity * velocity_error.x + part.x - xy.derivative * acceleration.x - drag * v.x,
        a_d.y - xy.velocity * velocity_error.y + part.y - xy.derivative * acceleration.y - drag * v.y,
        a_d.z - z.velocity * velocity_error.z + part.z - z.derivative * acceleration.z - drag * v.z,
    )
    thrust = thrust_command(command, vehicle, parameters.limits, body_z(state.q_wb), ThrustForm.PROJECTED)
    heading = euler_from_quaternion(state.q_wb).z
    angles = desired_angles(thrust.lift.lift, heading, reference.yaw)
    setpoint = attitude_setpoint(vehicle, reference, angles, thrust.thrust, heading, parameters.feed_forward)

    frozen = integrals_frozen(parameters.anti_windup, correction, thrust, inputs.actuation)
    integral = part
    if not frozen:
        integral = Vec3(
            _integrated(xy, part.x, velocity_error.x, dt),
            _integrated(xy, part.y, velocity_error.y, dt),
            _integrated(z, part.z, velocity_error.z, dt),
        )
    internals = internals_of(
        position_error, velocity_error, desired_velocity, command, scale(-1.0, part), correction, thrust, frozen
    )
    return setpoint, Memory(integral, acceleration, state.v_w, True), internals


def _integrated(gains: Gains, part: float, velocity_error: float, dt: float) -> float:
    """Return the I part in m/s^2 after a step of ``dt`` s."""
    return clamp(part - gains.integral * velocity_error * dt, -gains.max_integral, gains.max_integral)
