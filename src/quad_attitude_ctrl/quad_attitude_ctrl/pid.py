"""Cascaded attitude PID as common autopilots fly it: angle P, rate PID, feed-forward; a ``quad.attitude_law`` plug-in.

    e       = minus the way from q_wb to q_d: tilt about body x and y, then turn about z      rad
    omega_d = R^T R_d Omega_d - K_a e                                                         rad/s
    a       = K_f R^T R_d Omega_d' + I - K_p (omega - omega_d) - K_d omega', low-passed       rad/s^2
    I'      = -K_i (omega - omega_d), |I| <= max                                              I part, rad/s^2
    torque  = J a                                                                             N m

Source: the multicopter attitude and rate controllers of the PX4 and ArduPilot autopilots: the attitude error, the
shortest turn that points the thrust and what is left about it, gives in proportion rates on top of those fed forward.
The error of the body rates gives angular accelerations through P and I, the D part acts on the measured angular
acceleration, the desired acceleration is fed forward. Torque = nominal inertia times acceleration; no gyroscopic term,
as flown there. q_d, Omega_d and Omega_d' come from ``rotation_filter``.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.rotation_filter import (
    NO_ROTATION,
    RotationShaping,
    RotationState,
    as_angles,
    filter_and_goal,
    next_rotation,
    swing_twist,
)
from quad_attitude_ctrl.torque import (
    AntiWindup,
    TorqueLimits,
    integrals_frozen,
    internals_of,
    limited_torque,
    torque_for,
)
from quad_core.geometry import ZERO, add, clamp, low_passed, relative_attitude, rotate_inverse, scale, slope, subtract
from quad_core.parameters import Real
from quad_core.types import AttitudeInputs, AttitudeInternals, Vec3, Wrench
from quad_core.vehicle import Vehicle

Internals = AttitudeInternals


class Gains(NamedTuple):
    """Gains of one axis."""

    angle: Annotated[float, Real("1/s", "P of the attitude; larger: stiffer", 0.0, 1e3)] = 10.0
    rate: Annotated[float, Real("1/s", "P of the body rate; larger: more damped", 0.0, 1e4)] = 30.0
    integral: Annotated[float, Real("1/s^2", "I of the body rate; larger: offsets go faster; 0: off", 0.0, 1e5)] = 50.0
    derivative: Annotated[float, Real("", "D of the body rate, on the measured acceleration; 0: off", 0.0, 10.0)] = 0.0
    max_integral: Annotated[float, Real("rad/s^2", "largest I part", 0.0, 1e4)] = 20.0


class Parameters(NamedTuple):
    """Parameters of the cascaded attitude PID."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    derivative_bandwidth: Annotated[
        float, Real("rad/s", "low-pass of the D part's angular acceleration; larger: less lag, more noise", 0.1, 1e5)
    ] = 300.0
    acceleration_feed_forward: Annotated[
        float, Real("", "share of the desired angular acceleration that is fed forward; 0: off", 0.0, 1.0)
    ] = 1.0
    anti_windup: AntiWindup = True
    shaping: RotationShaping = RotationShaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filter, I part and filtered angular acceleration in rad/s^2, body rates of the last step in rad/s."""

    filter: RotationState = RotationState()
    integral: Vec3 = Vec3()
    acceleration: Vec3 = Vec3()
    omega_b: Vec3 = Vec3()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no I part."""
    return Memory(filter=NO_ROTATION, integral=ZERO, acceleration=ZERO, omega_b=ZERO, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``rate_error`` is that of the body rates; ``equivalent_control`` the feed-forward,
    ``reaching_control`` the PID, both as body accelerations in rad/s^2.
    """
    setpoint, q_wb, omega_b = inputs.setpoint, inputs.state.q_wb, inputs.state.omega_b
    filtered, goal = filter_and_goal(parameters.shaping, memory.filter, memory.initialised, q_wb, setpoint)
    apart = relative_attitude(goal.attitude, q_wb)
    error = scale(-1.0, swing_twist(relative_attitude(q_wb, goal.attitude)))
    roll, pitch, yaw = parameters.roll, parameters.pitch, parameters.yaw
    correction = Vec3(-roll.angle * error.x, -pitch.angle * error.y, -yaw.angle * error.z)
    rate_error = subtract(omega_b, add(rotate_inverse(apart, goal.rates), correction))
    measured = memory.acceleration
    if memory.initialised:
        measured = low_passed(measured, slope(memory.omega_b, omega_b, dt), parameters.derivative_bandwidth, dt)

    feed_forward = scale(parameters.acceleration_feed_forward, rotate_inverse(apart, goal.accelerations))
    old = memory.integral
    feedback = Vec3(
        old.x - roll.rate * rate_error.x - roll.derivative * measured.x,
        old.y - pitch.rate * rate_error.y - pitch.derivative * measured.y,
        old.z - yaw.rate * rate_error.z - yaw.derivative * measured.z,
    )
    torque = limited_torque(torque_for(vehicle, add(feed_forward, feedback)), parameters.torque)
    frozen = integrals_frozen(parameters.anti_windup, torque.limited, inputs.actuation)
    integral = Vec3(
        _integrated(roll, old.x, rate_error.x, frozen.x, dt),
        _integrated(pitch, old.y, rate_error.y, frozen.y, dt),
        _integrated(yaw, old.z, rate_error.z, frozen.z, dt),
    )
    next_filter = next_rotation(parameters.shaping, filtered, setpoint, dt)
    next_memory = Memory(next_filter, integral, measured, omega_b, True)
    internals = internals_of(as_angles(goal), error, rate_error, feed_forward, feedback, torque, frozen)
    return Wrench(setpoint.thrust, torque.torque), next_memory, internals


def _integrated(gains: Gains, part: float, rate_error: float, frozen: bool, dt: float) -> float:
    """Return the I part in rad/s^2 after a step of ``dt`` s."""
    if frozen:
        return part
    return clamp(part - gains.integral * rate_error * dt, -gains.max_integral, gains.max_integral)
