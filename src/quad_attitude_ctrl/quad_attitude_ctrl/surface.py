"""The fast nonsingular integral terminal sliding surface, one scalar function per equation and axis (eqs. 40-46).

Written with the roll axis in mind (e_1, s_1, delta_phi1, eta_phi1); pitch and yaw are the same law.
"""

import math

from quad_attitude_ctrl.saturation import saturation


def angle_exponent(error: float) -> float:
    """Return eta_phi1 of e_1 in rad (Eq. 46, first row): between 0.5 and 1.12."""
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
    """Return the integral of Eq. 45 in rad/s one step later, forward Euler, kept within +-``max_integral``."""
    moved = integral + dt * integrand
    if moved > max_integral:
        return max_integral
    if moved < -max_integral:
        return -max_integral
    return moved
