"""Eqs. 18-38 of the paper: adaptive integral backstepping (AIBS). Corrections are named where they are made."""

import sympy as sp
from model_equations import DAMPING, DAMPING_PRINTED
from paper_symbols import (
    Gamma7,
    Gamma9,
    Gamma11,
    U_x,
    U_y,
    U_z,
    alpha8,
    alpha10,
    alpha12,
    d_x,
    d_y,
    d_z,
    g,
    k7,
    k9,
    k11,
    m,
    t,
    x7,
    x7d,
    x8,
    x9,
    x9d,
    x10,
    x11,
    x11d,
    x12,
    xi7,
    xi8,
    xi8_hat,
    xi9,
    xi10,
    xi10_hat,
    xi11,
    xi12,
    xi12_hat,
)
from sympy import atan, cos, sin, sqrt

psi_d = sp.Function("psi_d", real=True)(t)

# Eqs. 18 and 19.
EQ18 = sp.Matrix([x7 - x7d, x9 - x9d, x11 - x11d])
EQ19 = sp.Matrix([x8 - x7d.diff(t), x10 - x9d.diff(t), x12 - x11d.diff(t)])
e7, e9, e11 = EQ18

# Eq. 20; Eq. 21 as the rates of Gamma.
EQ20 = sp.Matrix([e7**2 + k7 * Gamma7**2, e9**2 + k9 * Gamma9**2, e11**2 + k11 * Gamma11**2]) / 2
EQ21 = {Gamma7.diff(t): e7, Gamma9.diff(t): e9, Gamma11.diff(t): e11}

# Eq. 22, middle and right-hand forms.
EQ22 = sp.Matrix(
    [
        e7 * (x8 - x7d.diff(t)) + k7 * Gamma7 * Gamma7.diff(t),
        e9 * (x10 - x9d.diff(t)) + k9 * Gamma9 * Gamma9.diff(t),
        e11 * (x12 - x11d.diff(t)) + k11 * Gamma11 * Gamma11.diff(t),
    ]
)

# Eq. 23: virtual velocities.
EQ23 = sp.Matrix(
    [
        -xi7 * e7 + x7d.diff(t) - k7 * Gamma7,
        -xi9 * e9 + x9d.diff(t) - k9 * Gamma9,
        -xi11 * e11 + x11d.diff(t) - k11 * Gamma11,
    ]
)
x8d, x10d, x12d = EQ23
EQ24 = sp.Matrix([-xi7 * e7**2, -xi9 * e9**2, -xi11 * e11**2])

# Eq. 25.
EQ25 = sp.Matrix([x8 - x8d, x10 - x10d, x12 - x12d])
e8, e10, e12 = EQ25

# Eq. 26; its second row prints e_8 for e_10.
EQ26 = EQ20 + sp.Matrix([e8**2, e10**2, e12**2]) / 2

# Eqs. 27 and 28.
EQ27 = sp.Matrix(
    [
        e7 * e7.diff(t) + k7 * Gamma7 * Gamma7.diff(t) + e8 * e8.diff(t),
        e9 * e9.diff(t) + k9 * Gamma9 * Gamma9.diff(t) + e10 * e10.diff(t),
        e11 * e11.diff(t) + k11 * Gamma11 * Gamma11.diff(t) + e12 * e12.diff(t),
    ]
)
EQ28 = sp.Matrix(
    [
        -xi7 * e7**2 + e8 * (e7 + e8.diff(t)),
        -xi9 * e9**2 + e10 * (e9 + e10.diff(t)),
        -xi11 * e11**2 + e12 * (e11 + e12.diff(t)),
    ]
)

# Eq. 29: left minus right is zero under the law.
EQ29 = sp.Matrix(
    [
        e7 + e8.diff(t) + xi8_hat * e8,
        e9 + e10.diff(t) + xi10_hat * e10,
        e11 + e12.diff(t) + xi12_hat * e12,
    ]
)


def eq30(damping: tuple[sp.Expr, ...], disturbance: tuple[sp.Expr, ...]) -> sp.Matrix:
    """Eq. 30: U_x, U_y, U_z. ``damping`` holds the drag terms of Eq. 16, ``disturbance`` what stands in for d."""
    return sp.Matrix(
        [
            x7d.diff(t, 2)
            + (xi7**2 - 1 - k7) * e7
            - (xi7 + xi8_hat) * e8
            - damping[3]
            + xi7 * k7 * Gamma7
            - disturbance[0],
            x9d.diff(t, 2)
            + (xi9**2 - 1 - k9) * e9
            - (xi9 + xi10_hat) * e10
            - damping[4]
            + xi9 * k9 * Gamma9
            - disturbance[1],
            x11d.diff(t, 2)
            + (xi11**2 - 1 - k11) * e11
            - (xi11 + xi12_hat) * e12
            - damping[5]
            + xi11 * k11 * Gamma11
            - disturbance[2],
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
