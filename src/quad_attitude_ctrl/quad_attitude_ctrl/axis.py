"""ABFNITSM on one axis: parameters, memory, control (eqs. 40-56) and update (eqs. 45, 54, 55)."""

from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command_filter import Command, next_command
from quad_attitude_ctrl.sliding_control import (
    Estimates,
    adaptive_rates,
    equivalent_control,
    lyapunov,
    lyapunov_rate,
    next_estimate,
    reaching_control,
    uncertainty_bound,
)
from quad_attitude_ctrl.surface import angle_exponent, next_surface_integral, sliding_variable, surface_integrand
from quad_core.parameters import Real

COMMAND_FILTER = 0
COMMAND_FEED_FORWARD = 1


class Filter(NamedTuple):
    """Command filter of one axis."""

    bandwidth: Annotated[float, Real("rad/s", "three poles here", 0.1, 1e3, "addition")] = 40.0
    max_rate: Annotated[float, Real("rad/s", "largest rate of its input; 1e6: off", 0.01, 1e6, "addition")] = 1e6


class Axis(NamedTuple):
    """Gains of one axis; named after roll (phi, 1), the same on pitch (theta, 3) and yaw (psi, 5)."""

    angle_gain: Annotated[float, Real("", "delta_phi1", 0.0, 1e4, "Table 2, Eq. 45")] = 28.5
    rate_gain: Annotated[float, Real("", "delta_phi2", 0.0, 1e4, "Table 2, Eq. 45")] = 6.0
    surface_width: Annotated[
        float, Real("", "layer of sat(e) and sat(e'); 1: printed", 1e-4, 100.0, "addition to Eq. 45")
    ] = 0.05
    max_surface_integral: Annotated[
        float, Real("rad/s", "bound of the integral in s: the fastest closing rate; 1e9: off", 0.0, 1e9, "addition")
    ] = 10.0
    linear_gain: Annotated[float, Real("1/s", "rho_phi1; Table 2 (assumed): 3", 0.0, 1e3, "Eq. 53")] = 20.0
    power_gain: Annotated[float, Real("", "rho_phi2", 0.0, 1e3, "Table 2 (assumed), Eq. 53")] = 2.5
    power: Annotated[float, Real("", "sigma_phi", 0.1, 3.0, "Table 2, Eq. 53")] = 1.7
    reaching_width: Annotated[
        float, Real("rad/s", "layer of sat(s); 1: printed", 1e-4, 100.0, "addition to Eq. 53")
    ] = 1.0
    initial_constant: Annotated[float, Real("rad/s^2", "Q_hat_phi1(0)", 0.0, 1e3, "assumed, Eq. 54")] = 0.0
    initial_angle: Annotated[float, Real("1/s^2", "Q_hat_phi2(0)", 0.0, 1e3, "assumed, Eq. 54")] = 0.0
    initial_rate: Annotated[float, Real("1/s", "Q_hat_phi3(0)", 0.0, 1e3, "assumed, Eq. 54")] = 0.0
    adaptation_constant: Annotated[float, Real("1/s^2", "Delta_phi1", 0.0, 1e3, "assumed, Eq. 54")] = 1.0
    adaptation_angle: Annotated[float, Real("1/s^2", "Delta_phi2", 0.0, 1e3, "assumed, Eq. 54")] = 1.0
    adaptation_rate: Annotated[float, Real("1/s^2", "Delta_phi3", 0.0, 1e3, "assumed, Eq. 54")] = 1.0
    dead_zone: Annotated[float, Real("rad/s", "delta: no adaptation while |s| <= delta", 0.0, 100.0, "Eq. 55")] = 0.3
    max_estimate: Annotated[
        float, Real("", "bound of each of the three estimates; 1e9: off", 0.0, 1e9, "addition to Eq. 54")
    ] = 10.0
    max_torque: Annotated[float, Real("N m", "largest torque about this body axis; 1e6: off", 0.0, 1e6, "addition")] = (
        0.5
    )
    filter: Filter = Filter()


class AxisMemory(NamedTuple):
    """Command filter, integral of Eq. 45 in rad/s, and Q_hat of one axis."""

    command: Command = Command()
    surface_integral: float = 0.0
    estimates: Estimates = Estimates()


class AxisControl(NamedTuple):
    """All that one axis computed in one step; ``control`` = b_1 U_phi in rad/s^2, ``dead``: inside the dead zone."""

    command: Command
    error: float
    error_rate: float
    exponent: float
    integrand: float
    sliding: float
    equivalent: float
    reaching: float
    control: float
    adaptive: Estimates
    dead: bool
    lyapunov: float
    lyapunov_rate: float


def axis_command(mode: int, memory: AxisMemory, angle: float, rate: float, acceleration: float) -> Command:
    """Return x_1d, x_1d', x_1d'' from the command filter, from the setpoint given, or its angle alone."""
    if mode == COMMAND_FILTER:
        return memory.command
    if mode == COMMAND_FEED_FORWARD:
        return Command(angle, rate, acceleration, angle)
    return Command(angle, 0.0, 0.0, angle)


def axis_control(
    axis: Axis, memory: AxisMemory, command: Command, error: float, angle: float, rate: float, model: float, form: int
) -> AxisControl:
    """Return eqs. 41-58 of one axis.

    ``error`` e_1 in rad (Eq. 40, yaw wrapped), ``angle`` x_1, ``rate`` x_2 (Euler rate), ``model`` the terms
    a_1 x_4 x_6 + a_2 x_2^2 of Eq. 52 in rad/s^2, ``form`` that of Eq. 54.
    """
    error_rate = rate - command.rate
    exponent = angle_exponent(error)
    integrand = surface_integrand(error, error_rate, exponent, axis.angle_gain, axis.rate_gain, axis.surface_width)
    sliding = sliding_variable(error_rate, memory.surface_integral)
    bound = uncertainty_bound(memory.estimates, angle, rate)
    equivalent = equivalent_control(command.acceleration, model, integrand, error)
    reaching = reaching_control(sliding, axis.linear_gain, axis.power_gain, axis.power, bound, axis.reaching_width)
    gains = Estimates(axis.adaptation_constant, axis.adaptation_angle, axis.adaptation_rate)
    adaptive = adaptive_rates(sliding, angle, rate, gains, form, axis.dead_zone, axis.reaching_width)
    return AxisControl(
        command,
        error,
        error_rate,
        exponent,
        integrand,
        sliding,
        equivalent,
        reaching,
        equivalent + reaching,
        adaptive,
        abs(sliding) <= axis.dead_zone,
        lyapunov(error, sliding),
        lyapunov_rate(
            error,
            memory.surface_integral,
            sliding,
            axis.linear_gain,
            axis.power_gain,
            axis.power,
            bound,
            axis.reaching_width,
        ),
    )


def axis_memory(
    axis: Axis, memory: AxisMemory, control: AxisControl, raw: float, resting: bool, dt: float
) -> AxisMemory:
    """Return the memory one step of ``dt`` s later: command filter, and unless ``resting`` eqs. 45, 54 and 55."""
    command = next_command(memory.command, raw, axis.filter.bandwidth, axis.filter.max_rate, dt)
    if resting:
        return AxisMemory(command, memory.surface_integral, memory.estimates)
    old = memory.estimates
    estimates = Estimates(
        next_estimate(old.constant, control.adaptive.constant, axis.max_estimate, dt),
        next_estimate(old.angle, control.adaptive.angle, axis.max_estimate, dt),
        next_estimate(old.rate, control.adaptive.rate, axis.max_estimate, dt),
    )
    integral = next_surface_integral(memory.surface_integral, control.integrand, axis.max_surface_integral, dt)
    return AxisMemory(command, integral, estimates)
