"""Cascaded attitude PID as common autopilots fly it: angle P, rate PID, feed-forward; a ``quad.attitude_law`` plug-in.

Source: the multicopter attitude and rate controllers of the PX4 and ArduPilot autopilots: the angle error in proportion
gives rates on top of those fed forward, the error of the body rates gives angular accelerations through P and I, the D
part acts on the measured angular acceleration, the desired acceleration is fed forward. The error is that of the Z-Y-X
angles. Torque = nominal inertia times acceleration; no gyroscopic term, as flown there.
"""

import math
from typing import Annotated, NamedTuple

from quad_attitude_ctrl.abfnitsm import Internals
from quad_attitude_ctrl.body_torque import body_acceleration
from quad_attitude_ctrl.shaping import (
    Commands,
    Shaping,
    TorqueLimits,
    commands_at,
    desired,
    held,
    held_torque,
    next_commands,
    resting,
    surfaceless_internals,
)
from quad_core.parameters import Flag, Real
from quad_core.rotations import body_rates, euler_from_quaternion, wrap_angle
from quad_core.types import AttitudeInputs, Vec3, Wrench
from quad_core.vehicle import Vehicle


class Gains(NamedTuple):
    """Gains of one axis."""

    angle: Annotated[float, Real("1/s", "P of the angle", 0.0, 1e3)] = 10.0
    rate: Annotated[float, Real("1/s", "P of the body rate", 0.0, 1e4)] = 30.0
    integral: Annotated[float, Real("1/s^2", "I of the body rate", 0.0, 1e5)] = 50.0
    derivative: Annotated[float, Real("", "D of the body rate, on the measured acceleration", 0.0, 10.0)] = 0.0
    max_integral: Annotated[float, Real("rad/s^2", "bound of the I part", 0.0, 1e4)] = 20.0


class Parameters(NamedTuple):
    """Parameters of the cascaded attitude PID."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    derivative_bandwidth: Annotated[
        float, Real("rad/s", "low-pass of the angular acceleration that the D part sees", 0.1, 1e5)
    ] = 300.0
    acceleration_feed_forward: Annotated[
        float, Real("", "share of the desired angular acceleration that is fed forward", 0.0, 1.0)
    ] = 1.0
    anti_windup: Annotated[
        bool, Flag("the I part of an axis rests while its torque is limited, here or in `actuation`")
    ] = True
    shaping: Shaping = Shaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filters, I part and filtered angular acceleration in rad/s^2, body rates of the last step in rad/s."""

    commands: Commands = Commands()
    integral: Vec3 = Vec3()
    acceleration: Vec3 = Vec3()
    omega_b: Vec3 = Vec3()
    initialised: float = 0.0


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step: no I part."""
    zero = Vec3(0.0, 0.0, 0.0)
    return Memory(commands_at(zero), zero, zero, zero, 0.0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs.

    In the internals ``rate_error`` is that of the body rates; ``equivalent_control`` the feed-forward,
    ``reaching_control`` the PID, both as body accelerations in rad/s^2.
    """
    angles = euler_from_quaternion(inputs.state.q_wb)
    omega_b = inputs.state.omega_b
    commands = memory.commands
    if memory.initialised <= 0.0:
        commands = commands_at(angles)
    goal = desired(parameters.shaping, commands, inputs.setpoint)
    error = Vec3(angles.x - goal.angles.x, angles.y - goal.angles.y, wrap_angle(angles.z - goal.angles.z))
    roll, pitch, yaw = parameters.roll, parameters.pitch, parameters.yaw
    wanted_rates = Vec3(
        goal.rates.x - roll.angle * error.x, goal.rates.y - pitch.angle * error.y, goal.rates.z - yaw.angle * error.z
    )
    omega_d = body_rates(angles, wanted_rates)
    error_rate = Vec3(omega_b.x - omega_d.x, omega_b.y - omega_d.y, omega_b.z - omega_d.z)
    measured = _acceleration(parameters.derivative_bandwidth, memory, omega_b, dt)

    share = parameters.acceleration_feed_forward
    fed = body_acceleration(angles, goal.rates, goal.accelerations)
    ahead = Vec3(share * fed.x, share * fed.y, share * fed.z)
    old = memory.integral
    pid = Vec3(
        old.x - roll.rate * error_rate.x - roll.derivative * measured.x,
        old.y - pitch.rate * error_rate.y - pitch.derivative * measured.y,
        old.z - yaw.rate * error_rate.z - yaw.derivative * measured.z,
    )
    torque = Vec3(
        vehicle.inertia_xx * (ahead.x + pid.x),
        vehicle.inertia_yy * (ahead.y + pid.y),
        vehicle.inertia_zz * (ahead.z + pid.z),
    )
    bounded = held_torque(torque, parameters.torque)
    rest = resting(parameters.anti_windup, bounded.limited, inputs.actuation)
    integral = Vec3(
        _integrated(roll, old.x, error_rate.x, rest.x, dt),
        _integrated(pitch, old.y, error_rate.y, rest.y, dt),
        _integrated(yaw, old.z, error_rate.z, rest.z, dt),
    )
    kept = Memory(next_commands(parameters.shaping, commands, inputs.setpoint, dt), integral, measured, omega_b, 1.0)
    internals = surfaceless_internals(goal, error, error_rate, ahead, pid, bounded, rest)
    return Wrench(inputs.setpoint.thrust, bounded.torque), kept, internals


def _acceleration(bandwidth: float, memory: Memory, omega_b: Vec3, dt: float) -> Vec3:
    """Return the low-passed angular acceleration in rad/s^2 from the change of body rates over the last step."""
    if memory.initialised <= 0.0:
        return memory.acceleration
    gain = 1.0 - math.exp(-bandwidth * dt)
    before, last = memory.acceleration, memory.omega_b
    return Vec3(
        before.x + gain * ((omega_b.x - last.x) / dt - before.x),
        before.y + gain * ((omega_b.y - last.y) / dt - before.y),
        before.z + gain * ((omega_b.z - last.z) / dt - before.z),
    )


def _integrated(gains: Gains, part: float, error_rate: float, rests: bool, dt: float) -> float:
    """Return the I part in rad/s^2 after a step of ``dt`` s."""
    if rests:
        return part
    return held(part - gains.integral * error_rate * dt, gains.max_integral)
