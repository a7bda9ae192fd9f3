"""Eqs. 39-60 of the paper: the attitude law (ABFNITSM). Corrections are named where they are made."""

from typing import Any, NamedTuple

import sympy as sp
from model_equations import DAMPING, DAMPING_PRINTED, a1, a3, a5, b1, b2, b3
from paper_symbols import (
    S1,
    S3,
    S5,
    Delta_phi,
    Delta_psi,
    Delta_theta,
    Q_phi,
    Q_phi_hat,
    Q_psi,
    Q_psi_hat,
    Q_theta,
    Q_theta_hat,
    dead_zone,
    delta_phi1,
    delta_phi2,
    delta_psi1,
    delta_psi2,
    delta_theta1,
    delta_theta2,
    rho_phi1,
    rho_phi2,
    rho_psi1,
    rho_psi2,
    rho_theta1,
    rho_theta2,
    sigma_phi,
    sigma_psi,
    sigma_theta,
    t,
    x1,
    x1d,
    x2,
    x3,
    x3d,
    x4,
    x5,
    x5d,
    x6,
    xi1,
    xi3,
    xi5,
)
from sympy import Abs, Piecewise, Rational, exp


def eq39(x: Any) -> Any:
    """Eq. 39: the saturation function as printed."""
    return (exp(x) - 1) / (exp(x) + 1)


class Axis(NamedTuple):
    """Rows of Eqs. 40-60 for one axis, and what they are made of."""

    angle: Any
    rate: Any
    angle_d: Any
    integral: Any
    xi: Any
    delta1: Any
    delta2: Any
    rho1: Any
    rho2: Any
    sigma: Any
    Q: tuple[Any, Any, Any]
    Q_hat: tuple[Any, Any, Any]
    Delta: tuple[Any, Any, Any]


PHI = Axis(
    x1, x2, x1d, S1, xi1, delta_phi1, delta_phi2, rho_phi1, rho_phi2, sigma_phi, Q_phi, Q_phi_hat, Delta_phi
)  # fmt: skip
THETA = Axis(
    x3, x4, x3d, S3, xi3, delta_theta1, delta_theta2, rho_theta1, rho_theta2, sigma_theta, Q_theta, Q_theta_hat,
    Delta_theta,
)  # fmt: skip
PSI = Axis(
    x5, x6, x5d, S5, xi5, delta_psi1, delta_psi2, rho_psi1, rho_psi2, sigma_psi, Q_psi, Q_psi_hat, Delta_psi
)  # fmt: skip
AXES = (PHI, THETA, PSI)


def rows(term: Any) -> sp.Matrix:
    """Stack ``term(axis)`` for phi, theta, psi."""
    return sp.Matrix([term(axis) for axis in AXES])


def error(axis: Axis) -> Any:
    """Eq. 40."""
    return axis.angle - axis.angle_d


def error_rate(axis: Axis) -> Any:
    """Eq. 41."""
    return axis.rate - axis.angle_d.diff(t)


def virtual_rate(axis: Axis) -> Any:
    """Eq. 44: x_2d, x_4d, x_6d."""
    return surface(axis) + axis.angle_d.diff(t) - axis.xi * error(axis)


def eta1(axis: Axis) -> Any:
    """Eq. 46, first of each pair."""
    size = Abs(error(axis))
    quarter, fifth = Rational(1, 4), Rational(1, 5)
    return exp(-((size + quarter) ** Rational(7, 5)) - (size + fifth) ** Rational(7, 10)) + Rational(1, 2)


def eta2(axis: Axis) -> Any:
    """Eq. 46, second of each pair; the last row prints eta_theta1 for eta_psi1."""
    return 2 * eta1(axis) / (1 + eta1(axis))


def integrand(axis: Axis) -> Any:
    """Integrand of Eq. 45."""
    e, e_dot = error(axis), error_rate(axis)
    return axis.delta1 * Abs(e) ** eta1(axis) * eq39(e) + axis.delta2 * Abs(e_dot) ** eta2(axis) * eq39(e_dot)


def surface(axis: Axis) -> Any:
    """Eq. 45 with the integral as a state."""
    return error_rate(axis) + axis.integral


EQ40, EQ41, EQ44, EQ45 = rows(error), rows(error_rate), rows(virtual_rate), rows(surface)
EQ42 = rows(lambda axis: error(axis) ** 2 / 2)
EQ43 = rows(lambda axis: error(axis) * (axis.rate - axis.angle_d.diff(t)))
EQ46 = sp.Matrix([eta(axis) for axis in AXES for eta in (eta1, eta2)])
EQ45_INTEGRAND = {axis.integral.diff(t): integrand(axis) for axis in AXES}
EQ47 = rows(lambda axis: axis.rate.diff(t) - axis.angle_d.diff(t, 2) + integrand(axis))
EQ48 = rows(lambda axis: (error(axis) ** 2 + surface(axis) ** 2) / 2)
# Eq. 49 (lost): the derivative of Eq. 48 by the chain rule.
EQ49 = rows(lambda axis: error(axis) * error_rate(axis) + surface(axis) * surface(axis).diff(t))
EQ50 = rows(
    lambda axis: -axis.xi * error(axis) ** 2 + surface(axis) * (surface(axis).diff(t) + error(axis)),
)
EQ51 = rows(lambda axis: surface(axis).diff(t) + error(axis))


def eq52(damping: tuple[Any, ...]) -> sp.Matrix:
    """Eq. 52: equivalent control (U_phi0, U_theta0 in N, U_psi0 in N m); prints a_2, a_3 for a_3, a_5."""
    model = (a1 * x4 * x6 + damping[0], a3 * x2 * x6 + damping[1], a5 * x2 * x4 + damping[2])
    return sp.Matrix(
        [
            (axis.angle_d.diff(t, 2) - known - integrand(axis) - error(axis)) / b
            for axis, known, b in zip(AXES, model, (b1, b2, b3), strict=True)
        ]
    )


EQ52 = eq52(DAMPING)
EQ52_PRINTED_DRAG = eq52(DAMPING_PRINTED)


def phi_of(axis: Axis, gains: tuple[Any, Any, Any]) -> Any:
    """Eq. 60: Phi of one axis with ``gains`` Q or Q_hat."""
    return gains[0] + gains[1] * Abs(axis.angle) + gains[2] * Abs(axis.rate)


def eq53(axis: Axis, b: Any, s: Any) -> Any:
    """Eq. 53: reaching law of one axis at sliding variable ``s``."""
    push = axis.rho1 * s + axis.rho2 * Abs(s) ** axis.sigma * eq39(s) + phi_of(axis, axis.Q_hat) * eq39(s)
    return -push / b


EQ53 = sp.Matrix([eq53(axis, b, surface(axis)) for axis, b in zip(AXES, (b1, b2, b3), strict=True)])


def eq54(axis: Axis, form: str) -> tuple[Any, Any, Any]:
    """Eq. 54 (lost): Q_hat_1', Q_hat_2', Q_hat_3'; ``form`` "abs" follows from 57-59, "sat" cancels with 53."""
    s = surface(axis)
    push = Abs(s) if form == "abs" else s * eq39(s)
    return axis.Delta[0] * push, axis.Delta[1] * push * Abs(axis.angle), axis.Delta[2] * push * Abs(axis.rate)


def eq55(axis: Axis, form: str) -> tuple[Any, ...]:
    """Eq. 55 (lost): Eq. 54 with the dead zone abs(s) <= delta in which nothing moves."""
    return tuple(Piecewise((0, Abs(surface(axis)) <= dead_zone), (rate, True)) for rate in eq54(axis, form))


EQ56 = EQ52 + EQ53
EQ56_PRINTED_DRAG = EQ52_PRINTED_DRAG + EQ53


def lyapunov(axis: Axis) -> Any:
    """Eq. 57 with the estimation error Q - Q_hat."""
    estimation = sum((axis.Q[i] - axis.Q_hat[i]) ** 2 / axis.Delta[i] for i in range(3))
    return (error(axis) ** 2 + surface(axis) ** 2 + estimation) / 2


EQ57 = rows(lyapunov)
EQ58 = rows(
    lambda axis: (
        error(axis) * error_rate(axis)
        + surface(axis) * surface(axis).diff(t)
        - sum((axis.Q[i] - axis.Q_hat[i]) * axis.Q_hat[i].diff(t) / axis.Delta[i] for i in range(3))
    )
)
EQ59 = rows(
    lambda axis: (
        -axis.xi * error(axis) ** 2
        - axis.rho1 * surface(axis) ** 2
        - axis.rho2 * Abs(surface(axis)) ** (axis.sigma + 1)
        - phi_of(axis, axis.Q) * Abs(surface(axis))
    )
)
EQ60 = rows(lambda axis: phi_of(axis, axis.Q))


def known_rate(axis: Axis) -> Any:
    """The part of V' (Eq. 57) that the law knows: -e I - rho1 s^2 - rho2 abs(s)^sigma s sat(s) - Phi_hat s sat(s)."""
    e, s = error(axis), surface(axis)
    return (
        -e * axis.integral
        - axis.rho1 * s**2
        - axis.rho2 * Abs(s) ** axis.sigma * s * eq39(s)
        - phi_of(axis, axis.Q_hat) * s * eq39(s)
    )


def true_rate(axis: Axis, disturbance: Any, form: str) -> Any:
    """What V' of Eq. 57 really is under the law (it replaces Eq. 59), with angular acceleration ``disturbance``."""
    s = surface(axis)
    push = Abs(s) if form == "abs" else s * eq39(s)
    gap = phi_of(axis, axis.Q) - phi_of(axis, axis.Q_hat)
    return known_rate(axis) - gap * push + s * disturbance
