"""ITSM: traditional integral terminal sliding mode, a ``quad.attitude_law`` plug-in; the paper's baseline (sect. 4).

Per axis, e = x - x_d, constant exponents and sign() where the paper's own law has variable ones and sat():

    I'      = k_1 |e|^a_1 sign(e) + k_2 |e'|^a_2 sign(e'),   a_2 = 2 a_1 / (1 + a_1)
    s       = e' + I                                                 surface, rad/s
    control = x_d'' - I' - K sw(s)                                   Euler acceleration, rad/s^2
    torque  = exact inverse dynamics of control                      N m

``sw`` is sign(s), or tanh(s / (2 width)) where a layer is chosen. The paper does not print its ITSM. The integrand is
the finite-time stabiliser of the double integrator of Bhat and Bernstein (Geometric homogeneity with applications to
finite-time stability, MCSS 17, 2005); an integral surface around it with the switching term K sign(s) is the form of
Zong, Zhao and Zhang (Higher order sliding mode control with self-tuning law based on integral sliding mode, IET CTA
4(7), 2010), without its self-tuning.
"""

from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import FilterStates, Shaping, desired, filters_at_rest, next_filters
from quad_attitude_ctrl.sliding_control import next_surface_integral, saturation
from quad_attitude_ctrl.torque import (
    AntiWindup,
    TorqueLimits,
    body_acceleration,
    integrals_frozen,
    internals_of,
    inverse_dynamics,
    limited_torque,
)
from quad_core.geometry import ZERO, euler_from_quaternion, euler_rates, wrap_angle
from quad_core.parameters import Choice, Real
from quad_core.types import AttitudeInputs, AttitudeInternals, Vec3, Wrench
from quad_core.vehicle import DragSign, Vehicle

Internals = AttitudeInternals


class Switching(IntEnum):
    """Switching term: sign(s), or a layer around s = 0."""

    SIGN = 0
    LAYER = 1


class Gains(NamedTuple):
    """Gains of one axis."""

    angle_gain: Annotated[
        float, Real("mixed", "weight of the angle error in the surface, k_1; larger: stiffer", 0.0, 1e4)
    ] = 100.0
    rate_gain: Annotated[
        float, Real("mixed", "weight of the rate error in the surface, k_2; larger: more damped", 0.0, 1e4)
    ] = 20.0
    exponent: Annotated[float, Real("", "exponent a_1 of the surface; 1: linear", 0.1, 1.0)] = 0.7
    switching_gain: Annotated[
        float, Real("rad/s^2", "switching gain K, above the disturbance's bound; larger: more chattering", 0.0, 1e4)
    ] = 3.0
    layer: Annotated[float, Real("rad/s", "layer width; larger: smoother; unused with sign()", 1e-4, 100.0)] = 0.05
    max_integral: Annotated[float, Real("rad/s", "bound of the integral in s; 1e9: off", 0.0, 1e9, "addition")] = 10.0


class Parameters(NamedTuple):
    """Parameters of ITSM."""

    roll: Gains = Gains()
    pitch: Gains = Gains()
    yaw: Gains = Gains()
    switching: Annotated[int, Choice(Switching, "switching term: sign(s), or a layer around s = 0")] = (
        Switching.SIGN.value
    )
    anti_windup: AntiWindup = True
    shaping: Shaping = Shaping()
    torque: TorqueLimits = TorqueLimits()


class Memory(NamedTuple):
    """Command filters, and the integrals of the surface in rad/s; ``initialised``: the filters started somewhere."""

    filters: FilterStates = FilterStates()
    integral: Vec3 = Vec3()
    initialised: bool = False


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
    return Memory(filters=filters_at_rest(ZERO), integral=ZERO, initialised=False)


def step(
    parameters: Parameters, vehicle: Vehicle, memory: Memory, inputs: AttitudeInputs, dt: float
) -> tuple[Wrench, Memory, Internals]:
    """Return wrench, memory and internals of one step of ``dt`` s. Raises nothing on flyable inputs."""
    angles = euler_from_quaternion(inputs.state.q_wb)
    omega_b = inputs.state.omega_b
    rates = euler_rates(angles, omega_b)
    filters = memory.filters if memory.initialised else filters_at_rest(angles)
    goal = desired(parameters.shaping.command, filters, inputs.setpoint)
    layered = parameters.switching == Switching.LAYER
    old = memory.integral
    a_d, v_d = goal.accelerations, goal.rates
    roll = axis_control(parameters.roll, layered, wrap_angle(angles.x - goal.angles.x), rates.x - v_d.x, old.x, a_d.x)
    pitch = axis_control(parameters.pitch, layered, angles.y - goal.angles.y, rates.y - v_d.y, old.y, a_d.y)
    yaw = axis_control(parameters.yaw, layered, wrap_angle(angles.z - goal.angles.z), rates.z - v_d.z, old.z, a_d.z)

    control = Vec3(roll.equivalent + roll.reaching, pitch.equivalent + pitch.reaching, yaw.equivalent + yaw.reaching)
    acceleration_b = body_acceleration(angles, rates, control)
    torque_command = inverse_dynamics(vehicle, omega_b, acceleration_b, DragSign.CORRECTED)
    torque = limited_torque(torque_command, parameters.torque)
    rest = integrals_frozen(parameters.anti_windup, torque.limited, inputs.actuation)
    integral = Vec3(
        old.x if rest.x else next_surface_integral(old.x, roll.integrand, parameters.roll.max_integral, dt),
        old.y if rest.y else next_surface_integral(old.y, pitch.integrand, parameters.pitch.max_integral, dt),
        old.z if rest.z else next_surface_integral(old.z, yaw.integrand, parameters.yaw.max_integral, dt),
    )
    next_states = next_filters(parameters.shaping, filters, inputs.setpoint, dt)
    next_memory = Memory(filters=next_states, integral=integral, initialised=True)
    internals = internals_of(
        goal,
        Vec3(roll.error, pitch.error, yaw.error),
        Vec3(roll.error_rate, pitch.error_rate, yaw.error_rate),
        Vec3(roll.equivalent, pitch.equivalent, yaw.equivalent),
        Vec3(roll.reaching, pitch.reaching, yaw.reaching),
        torque,
        rest,
        Vec3(roll.sliding, pitch.sliding, yaw.sliding),
        old,
        Vec3(parameters.roll.exponent, parameters.pitch.exponent, parameters.yaw.exponent),
    )
    return Wrench(inputs.setpoint.thrust, torque.torque), next_memory, internals


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
    gains: Gains, layered: bool, error: float, error_rate: float, integral: float, acceleration: float
) -> AxisControl:
    """Return the law of one axis.

    ``error`` in rad, ``error_rate`` in rad/s, ``integral`` of the surface in rad/s, ``acceleration`` x_d'' in rad/s^2.
    """
    rate_exponent = 2.0 * gains.exponent / (1.0 + gains.exponent)
    integrand = gains.angle_gain * signed_power(error, gains.exponent) + gains.rate_gain * signed_power(
        error_rate, rate_exponent
    )
    sliding = error_rate + integral
    reaching = -gains.switching_gain * switching(sliding, layered, gains.layer)
    return AxisControl(error, error_rate, integrand, sliding, acceleration - integrand, reaching)
