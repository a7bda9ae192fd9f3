"""Symbols of the paper, each under the paper's own name, all quantities of time as functions of t.

This transcription shares nothing with the code under test: it is typed from the article's text.
"""

# ruff: noqa: N816 (the paper's symbols are the names here)

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mpmath
import sympy as sp

t = sp.Symbol("t", real=True)


def of_time(name: str) -> Any:
    """Return a real quantity that depends on time."""
    return sp.Function(name, real=True)(t)


def positive(names: str) -> Any:
    """Return positive constants."""
    return sp.symbols(names, positive=True)


# States (text before Eq. 15): phi, phi', theta, theta', psi, psi', x, x', y, y', z, z'.
x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12 = (of_time(f"x{i}") for i in range(1, 13))
x1d, x3d, x5d, x7d, x9d, x11d = (of_time(f"x{i}d") for i in (1, 3, 5, 7, 9, 11))
p, q, r = (of_time(name) for name in "pqr")

# Vehicle, Table 1.
m, g, d, Ixx, Iyy, Izz, k_L, k_M, k_F, k_T = positive("m g d I_xx I_yy I_zz k_L k_M k_F k_T")
R1, R2, R3, R4 = (of_time(f"R{i}") for i in range(1, 5))
F_T = of_time("F_T")

# Inputs and disturbances, Eqs. 8, 15, 16.
U_phi, U_theta, U_psi, U_x, U_y, U_z = (of_time(f"U_{n}") for n in ("phi", "theta", "psi", "x", "y", "z"))
d_phi, d_theta, d_psi, d_x, d_y, d_z = (of_time(f"d_{n}") for n in ("phi", "theta", "psi", "x", "y", "z"))

# Position law, Eqs. 18-37.
k7, k9, k11, xi7, xi9, xi11, xi8, xi10, xi12 = positive("k7 k9 k11 xi7 xi9 xi11 xi8 xi10 xi12")
alpha8, alpha10, alpha12 = positive("alpha8 alpha10 alpha12")
Gamma7, Gamma9, Gamma11 = (of_time(f"Gamma{i}") for i in (7, 9, 11))
xi8_hat, xi10_hat, xi12_hat = (of_time(f"xi{i}_hat") for i in (8, 10, 12))

# Attitude law, Eqs. 39-60. The integral of Eq. 45 is S1, S3, S5.
xi1, xi3, xi5 = positive("xi1 xi3 xi5")
delta_phi1, delta_theta1, delta_psi1 = positive("delta_phi1 delta_theta1 delta_psi1")
delta_phi2, delta_theta2, delta_psi2 = positive("delta_phi2 delta_theta2 delta_psi2")
rho_phi1, rho_theta1, rho_psi1 = positive("rho_phi1 rho_theta1 rho_psi1")
rho_phi2, rho_theta2, rho_psi2 = positive("rho_phi2 rho_theta2 rho_psi2")
sigma_phi, sigma_theta, sigma_psi = positive("sigma_phi sigma_theta sigma_psi")
dead_zone = positive("delta")
Delta_phi = positive("Delta_phi1 Delta_phi2 Delta_phi3")
Delta_theta = positive("Delta_theta1 Delta_theta2 Delta_theta3")
Delta_psi = positive("Delta_psi1 Delta_psi2 Delta_psi3")
Q_phi, Q_theta, Q_psi = (positive(f"Q_{n}1 Q_{n}2 Q_{n}3") for n in ("phi", "theta", "psi"))
Q_phi_hat, Q_theta_hat, Q_psi_hat = (
    tuple(of_time(f"Q_{n}{i}_hat") for i in (1, 2, 3)) for n in ("phi", "theta", "psi")
)
S1, S3, S5 = (of_time(f"S{i}") for i in (1, 3, 5))


def plain(expression: Any) -> Any:
    """Return ``expression`` with x(t), x'(t), x''(t) replaced by plain symbols x, x_dot, x_ddot."""
    found = expression.atoms(sp.Derivative) | expression.atoms(sp.core.function.AppliedUndef)
    table = {}
    for item in found:
        if isinstance(item, sp.Derivative):
            order = item.derivative_count
            table[item] = sp.Symbol(f"{item.expr.func.__name__}_{'d' * order}ot", real=True)
        else:
            table[item] = sp.Symbol(item.func.__name__, real=True)
    return expression.xreplace(table)


def evaluator(expression: Any) -> Callable[[Mapping[str, float]], list[float]]:
    """Return a function {name: float} -> values of ``expression`` (row by row), computed with 40 digits."""
    rows = plain(sp.Matrix(expression if isinstance(expression, sp.MatrixBase | Sequence) else [expression]))
    arguments = sorted(rows.free_symbols, key=lambda symbol: symbol.name)
    compute = sp.lambdify(arguments, list(rows), modules="mpmath")

    def evaluate(values: Mapping[str, float]) -> list[float]:
        missing = [argument.name for argument in arguments if argument.name not in values]
        if missing:
            raise KeyError(f"no value for {missing}")
        with mpmath.workdps(40):
            return [float(item) for item in compute(*(mpmath.mpf(values[a.name]) for a in arguments))]

    return evaluate


def zero(expression: Any) -> bool:
    """Say whether ``expression`` (scalar or matrix) vanishes identically."""
    rows = sp.Matrix(expression if isinstance(expression, sp.MatrixBase | Sequence) else [expression])
    return all(sp.expand(item) == 0 or sp.simplify(item) == 0 for item in rows)
