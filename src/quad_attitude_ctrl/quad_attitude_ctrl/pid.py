"""Cascaded attitude PID as common autopilots fly it: angle P, rate PID, feed-forward; a ``quad.attitude_law`` plug-in.

    omega_d = body rates of (x_d' - K_a (x - x_d))                                rad/s
    a       = K_f w_d' + I - K_p (omega - omega_d) - K_d omega', low-passed       body acceleration, rad/s^2
    I'      = -K_i (omega - omega_d), |I| <= max                                  I part, rad/s^2
    torque  = J a                                                                 N m

Source: the multicopter attitude and rate controllers of the PX4 and ArduPilot autopilots: the angle error in proportion
gives rates on top of those fed forward, the error of the body rates gives angular accelerations through P and I, the D
part acts on the measured angular acceleration, the desired acceleration is fed forward. The error is that of the Z-Y-X
angles. Torque = nominal inertia times acceleration; no gyroscopic term, as flown there.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import FilterStates, Shaping, desired, filters_at_rest, next_filters
from quad_attitude_ctrl.torque import (
    AntiWindup,
    TorqueLimits,
    body_acceleration,
    integrals_frozen,
    internals_of,
    limited_torque,
    torque_for,
)
from quad_core.geometry import (
    ZERO,
    add,
    body_rates,
    clamp,
    euler_from_quaternion,
    low_passed,
    scale,
    slope,
    subtract,
    wrap_angle,
)
from quad_core.parameters import Real
from quad_core.types import AttitudeInputs, AttitudeInternals, Vec3, Wrench
from quad_core.vehicle import Vehicle

Internals = AttitudeInternals


class Gains(NamedTuple):
    """Gains of one axis."""

    angle: Annotated[float, Real("1/s", "P of the angle; larger: stiffer", 0.0, 1e3)] = 10.0
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
    shaping: Shaping = Shaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filters, I part and filtered angular acceleration in rad/s^2, body rates of the last step in rad/s."""

    filters: FilterStates = FilterStates()
    integral: Vec3 = Vec3()
    acceleration: Vec3 = Vec3()
    omega_b: Vec3 = Vec3()
    initialised: bool = False


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no I part."""
    return Memory(filters=filters_at_rest(ZERO), integral=ZERO, acceleration=ZERO, omega_b=ZERO, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``rate_error`` is that of the body rates; ``equivalent_control`` the feed-forward,
    ``reaching_control`` the PID, both as body accelerations in rad/s^2.
    """
    angles = euler_from_quaternion(inputs.state.q_wb)
    omega_b = inputs.state.omega_b
    filters = memory.filters if memory.initialised else filters_at_rest(angles)
    goal = desired(parameters.shaping.command, filters, inputs.setpoint)
    error = Vec3(wrap_angle(angles.x - goal.angles.x), angles.y - goal.angles.y, wrap_angle(angles.z - goal.angles.z))
    roll, pitch, yaw = parameters.roll, parameters.pitch, parameters.yaw
    euler_rates_d = Vec3(
        goal.rates.x - roll.angle * error.x, goal.rates.y - pitch.angle * error.y, goal.rates.z - yaw.angle * error.z
    )
    rate_error = subtract(omega_b, body_rates(angles, euler_rates_d))
    measured = memory.acceleration
    if memory.initialised:
        measured = low_passed(measured, slope(memory.omega_b, omega_b, dt), parameters.derivative_bandwidth, dt)

    desired_acceleration = body_acceleration(angles, goal.rates, goal.accelerations)
    feed_forward = scale(parameters.acceleration_feed_forward, desired_acceleration)
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
    next_states = next_filters(parameters.shaping, filters, inputs.setpoint, dt)
    next_memory = Memory(next_states, integral, measured, omega_b, True)
    internals = internals_of(goal, error, rate_error, feed_forward, feedback, torque, frozen)
    return Wrench(inputs.setpoint.thrust, torque.torque), next_memory, internals


def _integrated(gains: Gains, part: float, rate_error: float, frozen: bool, dt: float) -> float:
    """Return the I part in rad/s^2 after a step of ``dt`` s."""
    if frozen:
        return part
    return clamp(part - gains.integral * rate_error * dt, -gains.max_integral, gains.max_integral)
