"""Eqs. 1-17 of the paper: the vehicle. Corrections are named where they are made."""

# ruff: noqa: N816 (the paper's symbols are the names here)

import sympy as sp
from paper_symbols import (
    F_T,
    R1,
    R2,
    R3,
    R4,
    Ixx,
    Iyy,
    Izz,
    U_phi,
    U_psi,
    U_theta,
    U_x,
    U_y,
    U_z,
    d,
    d_phi,
    d_psi,
    d_theta,
    d_x,
    d_y,
    d_z,
    g,
    k_F,
    k_L,
    k_M,
    k_T,
    m,
    p,
    q,
    r,
    t,
    x1,
    x2,
    x3,
    x4,
    x5,
    x6,
    x7,
    x8,
    x9,
    x10,
    x11,
    x12,
)
from sympy import Abs, cos, diag, sec, sin, tan

phi, theta, psi = x1, x3, x5
velocity = sp.Matrix([x8, x10, x12])
omega = sp.Matrix([p, q, r])

# Eq. 4: body to world, Z-Y-X.
EQ4 = sp.Matrix(
    [
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
    ]
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
EQ13_MATRIX = sp.Matrix(
    [
        [1, sin(phi) * tan(theta), cos(phi) * tan(theta)],
        [0, cos(phi), -sin(phi)],
        [0, sin(phi) * sec(theta), cos(phi) * sec(theta)],
    ]
)
EQ13 = EQ13_MATRIX * omega

# Eq. 15: virtual position inputs.
EQ15 = sp.Matrix(
    [
        F_T / m * (cos(x1) * sin(x3) * cos(x5) + sin(x1) * sin(x5)),
        F_T / m * (cos(x1) * sin(x3) * sin(x5) - sin(x1) * cos(x5)),
        F_T / m * cos(x1) * cos(x3) - g,
    ]
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
    return sp.Matrix(
        [
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
        ]
    )


EQ16 = eq16(DAMPING)
EQ16_PRINTED = eq16(DAMPING_PRINTED)
STATES = (x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12)


def dynamics(rates: sp.Matrix = EQ16) -> dict[sp.Expr, sp.Expr]:
    """Return the substitution x_i' -> right-hand side of Eq. 16."""
    return {sp.Derivative(state, t): rate for state, rate in zip(STATES, rates, strict=True)}
