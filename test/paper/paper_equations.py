"""Eqs. 1-60 of the paper, each symbol under the paper's own name, all quantities of time as functions of t.

This transcription shares nothing with the code under test: it is typed from the article's text. Corrections are named
where they are made.
"""

# ruff: noqa: N816 (the paper's symbols are the names here)

from typing import Any, NamedTuple

import sympy as sp
from sympy import Abs, Piecewise, Rational, atan, cos, diag, exp, sec, sin, sqrt, tan

t = sp.Symbol("t", real=True)


def matrix(*rows: sp.Expr | list[sp.Expr]) -> sp.Matrix:
    """Return the matrix with these rows."""
    return sp.Matrix(rows)


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


# The vehicle: Eqs. 1-17.
phi, theta, psi = x1, x3, x5
velocity = sp.Matrix([x8, x10, x12])
omega = sp.Matrix([p, q, r])

# Eq. 4: body to world, Z-Y-X.
EQ4 = matrix(
    [
        cos(theta) * cos(psi),
        sin(theta) * sin(phi) * cos(psi) - cos(phi) * sin(psi),
        cos(phi) * sin(theta) * cos(psi) + sin(phi) * sin(psi),
    ],
    [
        cos(theta) * sin(psi),
        sin(theta) * sin(phi) * sin(psi) + cos(phi) * cos(psi),
        cos(phi) * sin(theta) * sin(psi) - sin(phi) * cos(psi),
    ],
    [-sin(theta), sin(phi) * cos(theta), cos(phi) * cos(theta)],
)

# Eq. 2: thrust in the world frame; Eq. 3: collective thrust of the rotors.
EQ2 = EQ4 * sp.Matrix([0, 0, F_T])
lift = [k_L * speed**2 for speed in (R1, R2, R3, R4)]
EQ3 = sum(lift)

# Text after Eq. 4: F_G, along -z of the world.
F_G = sp.Matrix([0, 0, -m * g])

# Eq. 5. Printed +k_F v feeds energy in; drag opposes the velocity.
EQ5_PRINTED = k_F * velocity
EQ5 = -k_F * velocity

# Eqs. 6 and 7.
EQ6 = diag(Ixx, Iyy, Izz)
EQ7 = sp.Matrix([[0, -r, q], [r, 0, -p], [-q, p, 0]])

# Eq. 8: U_phi, U_theta are force differences (N), U_psi a torque (N m).
EQ8 = sp.Matrix([lift[3] - lift[1], lift[0] - lift[2], k_M * (R1**2 - R2**2 + R3**2 - R4**2)])
# What Eq. 17 makes of them: physical torque about the body axes in N m (b1 = d / Ixx).
TORQUE = sp.Matrix([d * U_phi, d * U_theta, U_psi])

# Eq. 9. Printed +k_T omega^2 loses the direction; drag torque opposes the rate.
EQ9_PRINTED = k_T * omega.applyfunc(lambda rate: rate**2)
EQ9 = -k_T * omega.applyfunc(lambda rate: Abs(rate) * rate)


def eq1(torque: sp.Matrix, drag_force: sp.Matrix, drag_torque: sp.Matrix) -> tuple[sp.Matrix, sp.Matrix]:
    """Eq. 1 solved for P'' (world) and Omega' (body); tau_G of the rotors is 0 in the paper's eq. 16."""
    acceleration = (EQ2 + F_G + drag_force) / m
    angular = EQ6.inv() * (-EQ7 * EQ6 * omega + torque + drag_torque)
    return acceleration, angular


# Eq. 10 (the text calls it a rewrite of (2); it rewrites (1)). Effectiveness loss and mass error enter
# as dF_A, dF_G, dtau_A; solved for the accelerations.
dm = sp.Symbol("dm", real=True)
dF_A = sp.Matrix(sp.symbols("dF_A_x dF_A_y dF_A_z", real=True))
dF_G = sp.Matrix([0, 0, -dm * g])
dtau_A = sp.Matrix(sp.symbols("dtau_A_x dtau_A_y dtau_A_z", real=True))
dI = diag(*sp.symbols("dI_xx dI_yy dI_zz", real=True))
tau = sp.Matrix(sp.symbols("tau_x tau_y tau_z", real=True))


def eq10(drag_force: sp.Matrix, drag_torque: sp.Matrix) -> tuple[sp.Matrix, sp.Matrix]:
    """Eq. 10 solved for P'' and Omega' with torque ``tau`` in N m."""
    inertia = EQ6 + dI
    acceleration = (EQ2 + dF_A + F_G + dF_G + drag_force) / (m + dm)
    angular = inertia.inv() * (-EQ7 * inertia * omega + tau + dtau_A + drag_torque)
    return acceleration, angular


def eq11(drag_force: sp.Matrix, drag_torque: sp.Matrix) -> tuple[sp.Matrix, sp.Matrix]:
    """Eq. 11 (lost): D_P and D_A, so that eq. 10 reads eq. 1 + D; from Lemma 1 with A = m (I), BCD = dm (dI)."""
    force = EQ2 + dF_A + F_G + dF_G + drag_force
    lumped_p = (dF_A + dF_G) / m - (1 + dm / m) ** -1 * dm / m**2 * force
    moment = -EQ7 * (EQ6 + dI) * omega + tau + dtau_A + drag_torque
    inverse = EQ6.inv()
    lumped_a = (
        inverse * (dtau_A - EQ7 * dI * omega) - (sp.eye(3) + inverse * dI).inv() * inverse * dI * inverse * moment
    )
    return lumped_p, lumped_a


# Eq. 13: Euler rates from body rates; the printed vector has lost r.
EQ13_MATRIX = matrix(
    [1, sin(phi) * tan(theta), cos(phi) * tan(theta)],
    [0, cos(phi), -sin(phi)],
    [0, sin(phi) * sec(theta), cos(phi) * sec(theta)],
)
EQ13 = EQ13_MATRIX * omega

# Eq. 15: virtual position inputs.
EQ15 = matrix(
    F_T / m * (cos(x1) * sin(x3) * cos(x5) + sin(x1) * sin(x5)),
    F_T / m * (cos(x1) * sin(x3) * sin(x5) - sin(x1) * cos(x5)),
    F_T / m * cos(x1) * cos(x3) - g,
)

# Eq. 17.
a1, a3, a5 = (Iyy - Izz) / Ixx, (Izz - Ixx) / Iyy, (Ixx - Iyy) / Izz
b1, b2, b3 = d / Ixx, d / Iyy, 1 / Izz
A2_PRINTED, A4_PRINTED, A6_PRINTED = k_T / Ixx, k_T / Iyy, k_T / Izz
A7_PRINTED = A8_PRINTED = A9_PRINTED = k_F / m

# Damping terms of Eq. 16: a2 x2^2, a4 x4^2, a6 x6^2, a7 x8, a8 x10, a9 x12.
DAMPING_PRINTED = (
    A2_PRINTED * x2**2,
    A4_PRINTED * x4**2,
    A6_PRINTED * x6**2,
    A7_PRINTED * x8,
    A8_PRINTED * x10,
    A9_PRINTED * x12,
)
DAMPING = (
    -(k_T / Ixx) * Abs(x2) * x2,
    -(k_T / Iyy) * Abs(x4) * x4,
    -(k_T / Izz) * Abs(x6) * x6,
    -(k_F / m) * x8,
    -(k_F / m) * x10,
    -(k_F / m) * x12,
)


def eq16(damping: tuple[sp.Expr, ...]) -> sp.Matrix:
    """Eq. 16: x1'..x12' (the printed vector repeats the rows of x4, x6; they stand once here)."""
    return matrix(
        x2,
        a1 * x4 * x6 + damping[0] + b1 * U_phi + d_phi,
        x4,
        a3 * x2 * x6 + damping[1] + b2 * U_theta + d_theta,
        x6,
        a5 * x2 * x4 + damping[2] + b3 * U_psi + d_psi,
        x8,
        damping[3] + U_x + d_x,
        x10,
        damping[4] + U_y + d_y,
        x12,
        damping[5] + U_z + d_z,
    )


EQ16 = eq16(DAMPING)
EQ16_PRINTED = eq16(DAMPING_PRINTED)
STATES = (x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12)


def dynamics(rates: sp.Matrix = EQ16) -> dict[sp.Expr, sp.Expr]:
    """Return the substitution x_i' -> right-hand side of Eq. 16."""
    return {sp.Derivative(state, t): rate for state, rate in zip(STATES, rates, strict=True)}


# The position law, adaptive integral backstepping (AIBS): Eqs. 18-38.
psi_d = sp.Function("psi_d", real=True)(t)

# Eqs. 18 and 19.
EQ18 = sp.Matrix([x7 - x7d, x9 - x9d, x11 - x11d])
EQ19 = sp.Matrix([x8 - x7d.diff(t), x10 - x9d.diff(t), x12 - x11d.diff(t)])
e7, e9, e11 = EQ18

# Eq. 20; Eq. 21 as the rates of Gamma.
EQ20 = sp.Matrix([e7**2 + k7 * Gamma7**2, e9**2 + k9 * Gamma9**2, e11**2 + k11 * Gamma11**2]) / 2
EQ21 = {Gamma7.diff(t): e7, Gamma9.diff(t): e9, Gamma11.diff(t): e11}

# Eq. 22, middle and right-hand forms.
EQ22 = matrix(
    e7 * (x8 - x7d.diff(t)) + k7 * Gamma7 * Gamma7.diff(t),
    e9 * (x10 - x9d.diff(t)) + k9 * Gamma9 * Gamma9.diff(t),
    e11 * (x12 - x11d.diff(t)) + k11 * Gamma11 * Gamma11.diff(t),
)

# Eq. 23: virtual velocities.
EQ23 = matrix(
    -xi7 * e7 + x7d.diff(t) - k7 * Gamma7,
    -xi9 * e9 + x9d.diff(t) - k9 * Gamma9,
    -xi11 * e11 + x11d.diff(t) - k11 * Gamma11,
)
x8d, x10d, x12d = EQ23
EQ24 = sp.Matrix([-xi7 * e7**2, -xi9 * e9**2, -xi11 * e11**2])

# Eq. 25.
EQ25 = sp.Matrix([x8 - x8d, x10 - x10d, x12 - x12d])
e8, e10, e12 = EQ25

# Eq. 26; its second row prints e_8 for e_10.
EQ26 = EQ20 + sp.Matrix([e8**2, e10**2, e12**2]) / 2

# Eqs. 27 and 28.
EQ27 = matrix(
    e7 * e7.diff(t) + k7 * Gamma7 * Gamma7.diff(t) + e8 * e8.diff(t),
    e9 * e9.diff(t) + k9 * Gamma9 * Gamma9.diff(t) + e10 * e10.diff(t),
    e11 * e11.diff(t) + k11 * Gamma11 * Gamma11.diff(t) + e12 * e12.diff(t),
)
EQ28 = matrix(
    -xi7 * e7**2 + e8 * (e7 + e8.diff(t)),
    -xi9 * e9**2 + e10 * (e9 + e10.diff(t)),
    -xi11 * e11**2 + e12 * (e11 + e12.diff(t)),
)

# Eq. 29: left minus right is zero under the law.
EQ29 = matrix(e7 + e8.diff(t) + xi8_hat * e8, e9 + e10.diff(t) + xi10_hat * e10, e11 + e12.diff(t) + xi12_hat * e12)


def eq30(damping: tuple[sp.Expr, ...], disturbance: tuple[sp.Expr, ...]) -> sp.Matrix:
    """Eq. 30: U_x, U_y, U_z. ``damping`` holds the drag terms of Eq. 16, ``disturbance`` what stands in for d."""
    axes = (
        (x7d, xi7, xi8_hat, k7, Gamma7, e7, e8),
        (x9d, xi9, xi10_hat, k9, Gamma9, e9, e10),
        (x11d, xi11, xi12_hat, k11, Gamma11, e11, e12),
    )
    return sp.Matrix(
        [
            xd.diff(t, 2) + (xi**2 - 1 - k) * e - (xi + xi_hat) * e_v - drag + xi * k * gamma - d
            for (xd, xi, xi_hat, k, gamma, e, e_v), drag, d in zip(axes, damping[3:], disturbance, strict=True)
        ]
    )


# Eq. 30 prints -d_x, -d_y, -d_z, which a controller cannot know: they are left out.
EQ30 = eq30(DAMPING, (0, 0, 0))
EQ30_PRINTED_DRAG = eq30(DAMPING_PRINTED, (0, 0, 0))
EQ30_KNOWN_DISTURBANCE = eq30(DAMPING, (d_x, d_y, d_z))

# Eqs. 31 and 35; 31 prints alpha_9 for alpha_8. The estimation error is xi - xi_hat.
EQ31 = (e7**2 + k7 * Gamma7**2 + e8**2 + (xi8 - xi8_hat) ** 2 / alpha8) / 2
EQ35 = (
    EQ31
    + (e9**2 + k9 * Gamma9**2 + e10**2 + (xi10 - xi10_hat) ** 2 / alpha10) / 2
    + (e11**2 + k11 * Gamma11**2 + e12**2 + (xi12 - xi12_hat) ** 2 / alpha12) / 2
)
# Eq. 32; prints alpha_9 and drops the hat of xi_8'.
EQ32 = -xi7 * e7**2 - xi8 * e8**2 + (xi8 - xi8_hat) * (e8**2 - xi8_hat.diff(t) / alpha8)
# Eqs. 33 and 37 as the rates of the adaptive gains.
EQ37 = {xi8_hat.diff(t): alpha8 * e8**2, xi10_hat.diff(t): alpha10 * e10**2, xi12_hat.diff(t): alpha12 * e12**2}
EQ34 = -xi7 * e7**2 - xi8 * e8**2
EQ36 = EQ34 - xi9 * e9**2 - xi10 * e10**2 - xi11 * e11**2 - xi12 * e12**2

# Eq. 38; its third line prints psi_d for phi_d. As functions of U and the desired yaw.
F_T_D = m * sqrt(U_x**2 + U_y**2 + (U_z + g) ** 2)
THETA_D = atan((cos(psi_d) * U_x + sin(psi_d) * U_y) / (U_z + g))
theta_d = sp.Function("theta_d", real=True)(t)
PHI_D_OF_THETA_D = atan(cos(theta_d) * (sin(psi_d) * U_x - cos(psi_d) * U_y) / (U_z + g))
PHI_D = PHI_D_OF_THETA_D.subs(theta_d, THETA_D)
EQ38 = sp.Matrix([F_T_D, PHI_D, THETA_D])


# The attitude law (ABFNITSM): Eqs. 39-60.
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
EQ50 = rows(lambda axis: -axis.xi * error(axis) ** 2 + surface(axis) * (surface(axis).diff(t) + error(axis)))
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
