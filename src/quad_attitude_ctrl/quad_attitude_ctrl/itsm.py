"""ITSM: traditional integral terminal sliding mode, a ``quad.attitude_law`` plug-in; the paper's baseline (sect. 4).

The paper does not print its ITSM. Built here, per axis, with constant exponents and sign() where the paper has its own
exponents and sat():
s = e' + integral of k_1 |e|^a_1 sign(e) + k_2 |e'|^a_2 sign(e'), a_2 = 2 a_1 / (1 + a_1), control = x_d'' - k_1 |e|^a_1
sign(e) - k_2 |e'|^a_2 sign(e') - K sw(s), and exact inverse dynamics to torque. The integrand is the finite-time
stabiliser of the double integrator of Bhat and Bernstein (Geometric homogeneity with applications to finite-time
stability, MCSS 17, 2005); an integral surface around it with the switching term K sign(s) is the form of Zong, Zhao and
Zhang (Higher order sliding mode control with self-tuning law based on integral sliding mode, IET CTA 4(7),
2010), without its self-tuning. ``sw`` is sign(s), or tanh(s / (2 width)) where a layer is chosen.
"""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.abfnitsm import AxisFlags, Internals
from quad_attitude_ctrl.body_torque import body_acceleration, inverse_dynamics
from quad_attitude_ctrl.saturation import saturation
from quad_attitude_ctrl.shaping import (
    Commands,
    Desired,
    HeldTorque,
    Shaping,
    TorqueLimits,
    commands_at,
    desired,
    held,
    held_torque,
    next_commands,
    resting,
)
from quad_core.parameters import Choice, Flag, Real
from quad_core.rotations import euler_from_quaternion, euler_rates, wrap_angle
from quad_core.types import AttitudeInputs, Vec3, Wrench
from quad_core.vehicle import Vehicle

SWITCHING_SIGN = 0
SWITCHING_LAYER = 1


class Axis(NamedTuple):
    """Gains of one axis."""

    angle_gain: Annotated[float, Real("", "k_1", 0.0, 1e4)] = 100.0
    rate_gain: Annotated[float, Real("", "k_2", 0.0, 1e4)] = 20.0
    exponent: Annotated[float, Real("", "a_1; 1: linear surface", 0.1, 1.0)] = 0.7
    switching_gain: Annotated[float, Real("rad/s^2", "K; above the bound of the disturbance", 0.0, 1e4)] = 3.0
    layer: Annotated[float, Real("rad/s", "width of the layer, unused with sign()", 1e-4, 100.0)] = 0.05
    max_integral: Annotated[float, Real("rad/s", "bound of the integral in s; 1e9: off", 0.0, 1e9, "addition")] = 10.0


class Parameters(NamedTuple):
    """Parameters of ITSM."""

    roll: Axis = Axis()
    pitch: Axis = Axis()
    yaw: Axis = Axis()
    switching: Annotated[int, Choice(("sign", "layer"), "switching term: sign(s), or a layer around s = 0")] = (
        SWITCHING_SIGN
    )
    anti_windup: Annotated[
        bool, Flag("the integral of an axis rests while its torque is limited, here or in `actuation`", "addition")
    ] = True
    shaping: Shaping = Shaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filters, and the integrals of the surface in rad/s."""

    commands: Commands = Commands()
    integral: Vec3 = Vec3()
    initialised: float = 0.0


class AxisControl(NamedTuple):
    """One axis: e in rad, e' in rad/s, integrand and control in rad/s^2, s in rad/s."""

    error: float
    error_rate: float
    integrand: float
    sliding: float
    equivalent: float
    reaching: float


def init(parameters: Parameters, vehicle: Vehicle) -> Memory:  # noqa: ARG001 (the contract's signature)
    """Return the memory before the first step."""
    zero = Vec3(0.0, 0.0, 0.0)
    return Memory(commands_at(zero), zero, 0.0)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs."""
    angles = euler_from_quaternion(inputs.state.q_wb)
    omega_b = inputs.state.omega_b
    rates = euler_rates(angles, omega_b)
    commands = memory.commands
    if memory.initialised <= 0.0:
        commands = commands_at(angles)
    goal = desired(parameters.shaping, commands, inputs.setpoint)
    layered = parameters.switching == SWITCHING_LAYER
    old = memory.integral
    a_d, v_d = goal.accelerations, goal.rates
    roll = axis_control(parameters.roll, layered, angles.x - goal.angles.x, rates.x - v_d.x, old.x, a_d.x)
    pitch = axis_control(parameters.pitch, layered, angles.y - goal.angles.y, rates.y - v_d.y, old.y, a_d.y)
    yaw = axis_control(parameters.yaw, layered, wrap_angle(angles.z - goal.angles.z), rates.z - v_d.z, old.z, a_d.z)

    control = Vec3(roll.equivalent + roll.reaching, pitch.equivalent + pitch.reaching, yaw.equivalent + yaw.reaching)
    wanted = inverse_dynamics(vehicle, omega_b, body_acceleration(angles, rates, control), 0)
    bounded = held_torque(wanted, parameters.torque)
    rest = resting(parameters.anti_windup, bounded.limited, inputs.actuation)
    integral = Vec3(
        _integrated(parameters.roll, old.x, roll.integrand, rest.x, dt),
        _integrated(parameters.pitch, old.y, pitch.integrand, rest.y, dt),
        _integrated(parameters.yaw, old.z, yaw.integrand, rest.z, dt),
    )
    kept = Memory(next_commands(parameters.shaping, commands, inputs.setpoint, dt), integral, 1.0)
    internals = _internals(parameters, goal, old, roll, pitch, yaw, bounded, rest)
    return Wrench(inputs.setpoint.thrust, bounded.torque), kept, internals


def signed_power(value: float, exponent: float) -> float:
    """Return |value|^exponent sign(value)."""
    size: float = abs(value) ** exponent
    return size if value >= 0.0 else -size


def switching(sliding: float, layered: bool, width: float) -> float:
    """Return sign(s), 0 at s = 0, or tanh(s / (2 ``width``)) if ``layered``."""
    if layered:
        return saturation(sliding, width)
    if sliding > 0.0:
        return 1.0
    return -1.0 if sliding < 0.0 else 0.0


def axis_control(
    axis: Axis, layered: bool, error: float, error_rate: float, integral: float, acceleration: float
) -> AxisControl:
    """Return the law of one axis.

    ``error`` in rad, ``error_rate`` in rad/s, ``integral`` of the surface in rad/s, ``acceleration`` x_d'' in rad/s^2.
    """
    rate_exponent = 2.0 * axis.exponent / (1.0 + axis.exponent)
    integrand = axis.angle_gain * signed_power(error, axis.exponent) + axis.rate_gain * signed_power(
        error_rate, rate_exponent
    )
    sliding = error_rate + integral
    reaching = -axis.switching_gain * switching(sliding, layered, axis.layer)
    return AxisControl(error, error_rate, integrand, sliding, acceleration - integrand, reaching)


def _integrated(axis: Axis, integral: float, integrand: float, rests: bool, dt: float) -> float:
    """Return the integral of the surface in rad/s after a step of ``dt`` s, forward Euler, bounded."""
    if rests:
        return integral
    return held(integral + dt * integrand, axis.max_integral)


def _internals(
    parameters: Parameters,
    goal: Desired,
    integral: Vec3,
    roll: AxisControl,
    pitch: AxisControl,
    yaw: AxisControl,
    bounded: HeldTorque,
    rest: AxisFlags,
) -> Internals:
    zero = Vec3(0.0, 0.0, 0.0)
    return Internals(
        desired_angles=goal.angles,
        desired_rates=goal.rates,
        desired_accelerations=goal.accelerations,
        angle_error=Vec3(roll.error, pitch.error, yaw.error),
        rate_error=Vec3(roll.error_rate, pitch.error_rate, yaw.error_rate),
        sliding_variable=Vec3(roll.sliding, pitch.sliding, yaw.sliding),
        surface_integral=integral,
        surface_exponent=Vec3(parameters.roll.exponent, parameters.pitch.exponent, parameters.yaw.exponent),
        adaptive_constant=zero,
        adaptive_angle=zero,
        adaptive_rate=zero,
        equivalent_control=Vec3(roll.equivalent, pitch.equivalent, yaw.equivalent),
        reaching_control=Vec3(roll.reaching, pitch.reaching, yaw.reaching),
        lyapunov=zero,
        lyapunov_rate=zero,
        torque_limited=bounded.limited,
        adaptation_frozen=rest,
    )
