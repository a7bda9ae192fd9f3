"""Control and adaptation of ABFNITSM, one scalar function per equation and axis (eqs. 52-58, 60).

Controls are given as angular accelerations b_1 U_phi in rad/s^2; ``force_difference`` turns them into the paper's U.
Written with the roll axis in mind; pitch and yaw are the same law.
"""

from typing import NamedTuple

from quad_attitude_ctrl.saturation import saturation

FORM_ABS = 0


class Estimates(NamedTuple):
    """Q_hat_phi1 in rad/s^2, Q_hat_phi2 in 1/s^2, Q_hat_phi3 in 1/s, or their derivatives (per s more)."""

    constant: float = 0.0
    angle: float = 0.0
    rate: float = 0.0


def equivalent_control(desired_acceleration: float, model: float, integrand: float, error: float) -> float:
    """Return b_1 U_phi0 in rad/s^2 (Eq. 52).

    ``desired_acceleration`` x_1d'', ``model`` a_1 x_4 x_6 + a_2 x_2^2 (``body_torque.model_acceleration``),
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
    """Return the derivatives of the three estimates (Eq. 54), 0 inside the dead zone |s_1| <= delta (Eq. 55).

    ``gains`` Delta_phi1..3. ``form`` 0: Delta |s| {1, |x_1|, |x_2|} (assumed printed); 1: s sat(s) in the place of |s|,
    which makes the cross terms of Eq. 58 cancel.
    """
    size = abs(sliding)
    if size <= dead_zone:
        return Estimates(0.0, 0.0, 0.0)
    drive = size if form == FORM_ABS else sliding * saturation(sliding, width)
    return Estimates(gains.constant * drive, gains.angle * drive * abs(angle), gains.rate * drive * abs(rate))


def next_estimate(estimate: float, rate: float, max_estimate: float, dt: float) -> float:
    """Return Q_hat one step later, forward Euler, kept in [0, ``max_estimate``]."""
    moved = estimate + dt * rate
    if moved > max_estimate:
        return max_estimate
    return moved


def lyapunov(error: float, sliding: float) -> float:
    """Return l_phi (Eq. 57) without the estimation-error terms, which nobody can know in flight."""
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
