"""ABFNITSM on one axis: a scalar function per equation (eqs. 39-58, 60), then the whole axis.

    sat(x) = tanh(x / (2 width)), width 1 as printed                                                            (39)
    eta_1  = exp(-(|e| + 0.25)^1.4 - (|e| + 0.2)^0.7) + 0.5,    eta_2 = 2 eta_1 / (1 + eta_1)                   (46)

The other equations stand in ``abfnitsm``. Written with the roll axis in mind (x_1, x_2, e_1, s_1); pitch and yaw are
the same law. Controls are angular accelerations b_1 U_phi in rad/s^2; ``force_difference`` makes the paper's U of them.
"""

import math
from enum import IntEnum
from typing import Annotated, NamedTuple

from quad_attitude_ctrl.command import CommandFilter
from quad_core.geometry import clamp
from quad_core.parameters import Real
from quad_core.types import Vec3


def saturation(x: float, width: float) -> float:
    """Return tanh(x / (2 ``width``)); ``width`` = 1 is sat(x) = (e^x - 1)/(e^x + 1) of Eq. 39 without its overflow.

    ``width`` > 0 scales the boundary layer (same unit as x); the slope at 0 is 1/(2 width).
    """
    return math.tanh(0.5 * x / width)


def angle_exponent(error: float) -> float:
    """Return eta_phi1 of e_1 in rad (Eq. 46, first row): between 0.5 and 1.13."""
    size = abs(error)
    outer = size + 0.25
    inner = size + 0.2
    steep = 1.4
    flat = 0.7
    return math.exp(-(outer**steep) - inner**flat) + 0.5


def rate_exponent(exponent: float) -> float:
    """Return eta_phi2 = 2 eta_phi1 / (1 + eta_phi1) (Eq. 46, second row)."""
    return 2.0 * exponent / (1.0 + exponent)


def surface_integrand(
    error: float, error_rate: float, exponent: float, angle_gain: float, rate_gain: float, width: float
) -> float:
    """Return delta_phi1 |e_1|^eta_phi1 sat(e_1) + delta_phi2 |e_1'|^eta_phi2 sat(e_1') in rad/s^2 (Eq. 45).

    ``exponent`` is eta_phi1, ``width`` the layer of both saturations (1 = printed).
    """
    other = rate_exponent(exponent)
    angle_term: float = angle_gain * abs(error) ** exponent * saturation(error, width)
    rate_term: float = rate_gain * abs(error_rate) ** other * saturation(error_rate, width)
    return angle_term + rate_term


def sliding_variable(error_rate: float, integral: float) -> float:
    """Return s_1 = e_1' + integral in rad/s (Eq. 45)."""
    return error_rate + integral


def next_surface_integral(integral: float, integrand: float, max_integral: float, dt: float) -> float:
    """Return the integral of Eq. 45 in rad/s one step later, forward Euler, within +-``max_integral``."""
    return clamp(integral + dt * integrand, -max_integral, max_integral)


class AdaptationForm(IntEnum):
    """Q_hat' in proportion to |s| (assumed printed), or to s sat(s) (Eq. 54)."""

    ABS = 0
    SAT = 1


class Estimates(NamedTuple):
    """Q_hat_phi1 in rad/s^2, Q_hat_phi2 in 1/s^2, Q_hat_phi3 in 1/s, or their derivatives (per s more)."""

    constant: float = 0.0
    angle: float = 0.0
    rate: float = 0.0


def equivalent_control(desired_acceleration: float, model: float, integrand: float, error: float) -> float:
    """Return b_1 U_phi0 in rad/s^2 (Eq. 52).

    ``desired_acceleration`` x_1d'', ``model`` a_1 x_4 x_6 + a_2 x_2^2 (``torque.model_acceleration``),
    ``integrand`` the two delta terms (Eq. 45), all in rad/s^2; ``error`` e_1 in rad.
    """
    return desired_acceleration - model - integrand - error


def uncertainty_bound(estimates: Estimates, angle: float, rate: float) -> float:
    """Return Phi_hat = Q_hat_phi1 + Q_hat_phi2 |x_1| + Q_hat_phi3 |x_2| in rad/s^2 (Eq. 60 with the estimates)."""
    return estimates.constant + estimates.angle * abs(angle) + estimates.rate * abs(rate)


def reaching_control(
    sliding: float, linear_gain: float, power_gain: float, power: float, bound: float, width: float
) -> float:
    """Return b_1 U_phi1 in rad/s^2 (Eq. 53).

    ``linear_gain`` rho_phi1 in 1/s, ``power_gain`` rho_phi2, ``power`` sigma_phi, ``bound`` Phi_hat in rad/s^2,
    ``width`` the layer of sat(s_1) in rad/s (1 = printed).
    """
    layer = saturation(sliding, width)
    powered: float = power_gain * abs(sliding) ** power
    return -(linear_gain * sliding + powered * layer + bound * layer)


def adaptive_rates(
    sliding: float, angle: float, rate: float, gains: Estimates, form: int, dead_zone: float, width: float
) -> Estimates:
    """Return the derivatives of the three estimates (Eq. 54), 0 inside its dead zone |s_1| <= delta (Eq. 55).

    ``gains`` Delta_phi1..3. ``form`` ABS: Delta |s| {1, |x_1|, |x_2|} (assumed printed); SAT: s sat(s) in the place of
    |s|, which makes the cross terms of Eq. 58 cancel.
    """
    size = abs(sliding)
    if size <= dead_zone:
        return Estimates(0.0, 0.0, 0.0)
    drive = size if form == AdaptationForm.ABS else sliding * saturation(sliding, width)
    return Estimates(gains.constant * drive, gains.angle * drive * abs(angle), gains.rate * drive * abs(rate))


def next_estimate(estimate: float, rate: float, max_estimate: float, dt: float) -> float:
    """Return Q_hat one step later, forward Euler, within [0, ``max_estimate``]; ``rate`` >= 0 (Eq. 54)."""
    return clamp(estimate + dt * rate, 0.0, max_estimate)


def lyapunov(error: float, sliding: float) -> float:
    """Return l_phi (Eq. 57) without the estimation-error terms, which are unknown in flight."""
    return 0.5 * (error * error + sliding * sliding)


def lyapunov_rate(
    error: float,
    integral: float,
    sliding: float,
    linear_gain: float,
    power_gain: float,
    power: float,
    bound: float,
    width: float,
) -> float:
    """Return the known part of l_phi' (Eq. 58) for the law as it is.

    -e I - rho1 s^2 - rho2 |s|^sigma s sat(s) - Phi_hat s sat(s). With the true bound Phi and D_A unknown in flight,
    the whole is this - (Phi - Phi_hat) |s| + s D_A for the form ``abs`` of Eq. 54; -e I may be positive.
    """
    pull = sliding * saturation(sliding, width)
    powered: float = power_gain * abs(sliding) ** power
    return -error * integral - linear_gain * sliding * sliding - powered * pull - bound * pull


def force_difference(acceleration: float, inverse_inertia: float) -> float:
    """Return U_phi = U_phi0 + U_phi1 (Eq. 56) from b_1 (U_phi0 + U_phi1).

    ``inverse_inertia`` is b_1 = d/Ixx (b_2 = d/Iyy: U in N, times d it is a torque) or b_3 = 1/Izz (U_psi in N m).
    """
    return acceleration / inverse_inertia


class AxisGains(NamedTuple):
    """Gains of one axis; named after roll (phi, 1), the same on pitch (theta, 3) and yaw (psi, 5)."""

    angle_gain: Annotated[
        float, Real("mixed", "angle's weight in the surface, delta_1; larger: stiffer", 0.0, 1e4, "Table 2, Eq. 45")
    ] = 28.5
    rate_gain: Annotated[
        float, Real("mixed", "rate's weight in the surface, delta_2; larger: more damped", 0.0, 1e4, "Table 2, Eq. 45")
    ] = 6.0
    surface_width: Annotated[
        float, Real("mixed", "width of sat(e), sat(e'); larger: softer; 1: printed", 1e-4, 100.0, "addition to Eq. 45")
    ] = 0.05
    max_surface_integral: Annotated[
        float, Real("rad/s", "bound of the integral in s: the fastest closing rate; 1e9: off", 0.0, 1e9, "addition")
    ] = 10.0
    linear_gain: Annotated[
        float, Real("1/s", "linear reaching gain rho_1; larger: faster; Table 2 (assumed): 3", 0.0, 1e3, "Eq. 53")
    ] = 20.0
    power_gain: Annotated[float, Real("mixed", "power gain rho_2; 0: off", 0.0, 1e3, "Table 2 (assumed), Eq. 53")] = 2.5
    power: Annotated[float, Real("", "exponent sigma of the power reaching term", 0.1, 3.0, "Table 2, Eq. 53")] = 1.7
    reaching_width: Annotated[
        float, Real("rad/s", "layer width of sat(s); larger: smoother; 1: printed", 1e-4, 100.0, "addition to Eq. 53")
    ] = 1.0
    initial_constant: Annotated[
        float, Real("rad/s^2", "estimate Q_hat_1 at the start", 0.0, 1e3, "assumed, Eq. 54")
    ] = 0.0
    initial_angle: Annotated[float, Real("1/s^2", "estimate Q_hat_2 at the start", 0.0, 1e3, "assumed, Eq. 54")] = 0.0
    initial_rate: Annotated[float, Real("1/s", "estimate Q_hat_3 at the start", 0.0, 1e3, "assumed, Eq. 54")] = 0.0
    adaptation_constant: Annotated[
        float, Real("1/s^2", "adaptation rate Delta_1; 0: off", 0.0, 1e3, "assumed, Eq. 54")
    ] = 1.0
    adaptation_angle: Annotated[
        float, Real("1/s^2", "adaptation rate Delta_2; 0: off", 0.0, 1e3, "assumed, Eq. 54")
    ] = 1.0
    adaptation_rate: Annotated[float, Real("1/s^2", "adaptation rate Delta_3; 0: off", 0.0, 1e3, "assumed, Eq. 54")] = (
        1.0
    )
    dead_zone: Annotated[float, Real("rad/s", "delta: no adaptation while |s| <= delta", 0.0, 100.0, "Eq. 55")] = 0.3
    max_estimate: Annotated[
        float, Real("mixed", "bound of each of the three estimates; 1e9: off", 0.0, 1e9, "addition to Eq. 54")
    ] = 10.0
    max_torque: Annotated[float, Real("N m", "largest torque about this body axis; 1e6: off", 0.0, 1e6, "addition")] = (
        0.5
    )
    filter: CommandFilter = CommandFilter()


class AxisMemory(NamedTuple):
    """Integral of Eq. 45 in rad/s, and Q_hat of one axis."""

    surface_integral: float = 0.0
    estimates: Estimates = Estimates()


class AxisState(NamedTuple):
    """One axis of vehicle and command: angle x_1 and error e_1 in rad, rate x_2 and error rate e_1' in rad/s.

    ``desired_acceleration`` x_1d'' and ``model``, the terms a_1 x_4 x_6 + a_2 x_2^2 of Eq. 52, in rad/s^2. The errors
    of roll and yaw are wrapped; rates are Euler rates.
    """

    angle: float
    rate: float
    error: float
    error_rate: float
    desired_acceleration: float
    model: float


class AxisControl(NamedTuple):
    """All that one axis computed in one step; ``in_deadband``: inside a dead zone, Eq. 55.

    ``exponent`` eta_phi1; ``integrand``, ``equivalent``, ``reaching`` and ``control`` = b_1 U_phi in rad/s^2;
    ``sliding`` s_1 in rad/s; ``adaptive`` the derivatives of the estimates.
    """

    exponent: float
    integrand: float
    sliding: float
    equivalent: float
    reaching: float
    control: float
    adaptive: Estimates
    in_deadband: bool
    lyapunov: float
    lyapunov_rate: float


def angle_exponents(states: tuple[AxisState, AxisState, AxisState]) -> Vec3:
    """Return eta of roll, pitch and yaw; before all else, so that the machine can work at several axes at a time."""
    return Vec3(angle_exponent(states[0].error), angle_exponent(states[1].error), angle_exponent(states[2].error))


def axis_control(gains: AxisGains, memory: AxisMemory, state: AxisState, exponent: float, form: int) -> AxisControl:
    """Return eqs. 45-58 of one axis; ``exponent`` eta_phi1 (Eq. 46), ``form`` an ``AdaptationForm`` (Eq. 54)."""
    error, width = state.error, gains.reaching_width
    integrand = surface_integrand(
        error, state.error_rate, exponent, gains.angle_gain, gains.rate_gain, gains.surface_width
    )
    sliding = sliding_variable(state.error_rate, memory.surface_integral)
    bound = uncertainty_bound(memory.estimates, state.angle, state.rate)
    equivalent = equivalent_control(state.desired_acceleration, state.model, integrand, error)
    reaching = reaching_control(sliding, gains.linear_gain, gains.power_gain, gains.power, bound, width)
    adaptation = Estimates(gains.adaptation_constant, gains.adaptation_angle, gains.adaptation_rate)
    return AxisControl(
        exponent=exponent,
        integrand=integrand,
        sliding=sliding,
        equivalent=equivalent,
        reaching=reaching,
        control=equivalent + reaching,
        adaptive=adaptive_rates(sliding, state.angle, state.rate, adaptation, form, gains.dead_zone, width),
        in_deadband=abs(sliding) <= gains.dead_zone,
        lyapunov=lyapunov(error, sliding),
        lyapunov_rate=lyapunov_rate(
            error, memory.surface_integral, sliding, gains.linear_gain, gains.power_gain, gains.power, bound, width
        ),
    )


def next_axis_memory(gains: AxisGains, memory: AxisMemory, control: AxisControl, frozen: bool, dt: float) -> AxisMemory:
    """Return the memory one step of ``dt`` s later: unless ``frozen`` eqs. 45, 54 and 55."""
    if frozen:
        return memory
    old, rates, bound = memory.estimates, control.adaptive, gains.max_estimate
    estimates = Estimates(
        next_estimate(old.constant, rates.constant, bound, dt),
        next_estimate(old.angle, rates.angle, bound, dt),
        next_estimate(old.rate, rates.rate, bound, dt),
    )
    integral = next_surface_integral(memory.surface_integral, control.integrand, gains.max_surface_integral, dt)
    return AxisMemory(integral, estimates)
