"""The transcription of the paper agrees with itself: every derived equation follows from the ones before it."""

import paper_equations as eq
import pytest
import sympy as sp
from evaluation import evaluator, zero

pytestmark = pytest.mark.unit

DISTURBANCES = {eq.d_x: 0, eq.d_y: 0, eq.d_z: 0, eq.d_phi: 0, eq.d_theta: 0, eq.d_psi: 0}
SECOND_ERRORS = ((eq.e8, eq.xi8, eq.xi8_hat), (eq.e10, eq.xi10, eq.xi10_hat), (eq.e12, eq.xi12, eq.xi12_hat))


def along(expression, law):
    """Put Eq. 16, the integrals of Eqs. 21 and 45 and a law {U: expression} into ``expression``."""
    rates = {**eq.dynamics(), **eq.EQ21, **eq.EQ45_INTEGRAND}
    return expression.xreplace(rates).xreplace(law)


POSITION_LAW = dict(zip((eq.U_x, eq.U_y, eq.U_z), eq.EQ30_KNOWN_DISTURBANCE, strict=True))
POSITION_LAW_BLIND = dict(zip((eq.U_x, eq.U_y, eq.U_z), eq.EQ30, strict=True))
ATTITUDE_LAW = dict(zip((eq.U_phi, eq.U_theta, eq.U_psi), eq.EQ56, strict=True))
EQUIVALENT_CONTROL = dict(zip((eq.U_phi, eq.U_theta, eq.U_psi), eq.EQ52, strict=True))


def test_eq4_is_yaw_times_pitch_times_roll():
    roll = sp.Matrix([[1, 0, 0], [0, sp.cos(eq.x1), -sp.sin(eq.x1)], [0, sp.sin(eq.x1), sp.cos(eq.x1)]])
    pitch = sp.Matrix([[sp.cos(eq.x3), 0, sp.sin(eq.x3)], [0, 1, 0], [-sp.sin(eq.x3), 0, sp.cos(eq.x3)]])
    yaw = sp.Matrix([[sp.cos(eq.x5), -sp.sin(eq.x5), 0], [sp.sin(eq.x5), sp.cos(eq.x5), 0], [0, 0, 1]])
    assert zero(eq.EQ4 - yaw * pitch * roll)


def test_eq12_lemma_1():
    a = sp.Matrix([[3, 1], [0, 2]])
    b, c, d = sp.Matrix([[1, 2, 0], [0, 1, 1]]), sp.Matrix([[1, 0], [2, 1], [0, 3]]), sp.Matrix([[1, 1], [0, 2]])
    product = b * c * d
    right = a.inv() - (sp.eye(2) + a.inv() * product).inv() * a.inv() * product * a.inv()
    assert (a + product).inv() == right


def test_eq11_is_eq10_minus_the_nominal_model():
    true_p, true_a = eq.eq10(eq.EQ5, eq.EQ9)
    nominal_p, nominal_a = eq.eq1(eq.tau, eq.EQ5, eq.EQ9)
    lumped_p, lumped_a = eq.eq11(eq.EQ5, eq.EQ9)
    assert zero(true_p - nominal_p - lumped_p)
    assert zero(true_a - nominal_a - lumped_a)


def test_eq13_follows_from_the_derivative_of_eq4():
    angles = (eq.x1, eq.x3, eq.x5)
    rates = dict(zip((angle.diff(eq.t) for angle in angles), eq.EQ13, strict=True))
    assert zero((eq.EQ4.diff(eq.t).xreplace(rates) - eq.EQ4 * eq.EQ7).applyfunc(sp.trigsimp))


def test_eq16_follows_from_eqs_1_and_15_at_small_angles():
    acceleration, angular = eq.eq1(eq.TORQUE, eq.EQ5, eq.EQ9)
    small = dict(zip((eq.p, eq.q, eq.r), (eq.x2, eq.x4, eq.x6), strict=True))
    virtual = dict(zip((eq.U_x, eq.U_y, eq.U_z), eq.EQ15, strict=True))
    eq16 = eq.EQ16.xreplace(DISTURBANCES).xreplace(virtual)
    assert zero(sp.Matrix([eq16[i] for i in (7, 9, 11)]) - acceleration)
    assert zero(sp.Matrix([eq16[i] for i in (1, 3, 5)]) - angular.xreplace(small))


def test_printed_drag_is_the_negative_of_the_corrected_one_only_for_positive_rates():
    printed, corrected = sp.Matrix(eq.DAMPING_PRINTED), sp.Matrix(eq.DAMPING)
    ups = {state: sp.Symbol(f"u{i}", positive=True) for i, state in enumerate(eq.STATES)}
    assert zero((printed + corrected).xreplace(ups))


def test_eqs_19_and_22_are_derivatives_of_18_and_20():
    kinematics = eq.dynamics()
    assert zero(eq.EQ18.diff(eq.t).xreplace(kinematics) - eq.EQ19)
    assert zero(eq.EQ20.diff(eq.t).xreplace(kinematics) - eq.EQ22)


def test_eq24_follows_from_23():
    virtual = dict(zip((eq.x8, eq.x10, eq.x12), eq.EQ23, strict=True))
    assert zero(eq.EQ22.xreplace(eq.EQ21).xreplace(virtual) - eq.EQ24)


def test_eqs_27_and_28_are_derivatives_of_26():
    assert zero(eq.EQ26.diff(eq.t) - eq.EQ27)
    assert zero(along(eq.EQ27, {}) - along(eq.EQ28, {}))


def test_eq30_makes_29_hold_when_the_disturbance_is_known():
    assert zero(along(eq.EQ29, POSITION_LAW))


def test_eq30_without_the_disturbance_leaves_exactly_d_in_29():
    assert zero(along(eq.EQ29, POSITION_LAW_BLIND) - sp.Matrix([eq.d_x, eq.d_y, eq.d_z]))


def test_eqs_31_to_36_follow_with_the_known_disturbance():
    assert zero(along(eq.EQ31.diff(eq.t), POSITION_LAW) - eq.EQ32)
    assert zero(eq.EQ32.xreplace(eq.EQ37) - eq.EQ34)
    assert zero(along(eq.EQ35.diff(eq.t), POSITION_LAW).xreplace(eq.EQ37) - eq.EQ36)


def test_eq36_gains_e_times_d_when_the_disturbance_is_unknown():
    rate = along(eq.EQ35.diff(eq.t), POSITION_LAW_BLIND).xreplace(eq.EQ37)
    assert zero(rate - eq.EQ36 - eq.e8 * eq.d_x - eq.e10 * eq.d_y - eq.e12 * eq.d_z)


def test_eq38_inverts_eq15():
    forces = eq.EQ15.xreplace({eq.x1: sp.Symbol("phi"), eq.x3: sp.Symbol("theta"), eq.x5: eq.psi_d})
    put = dict(zip((eq.U_x, eq.U_y, eq.U_z), forces, strict=True))
    tan_theta = sp.tan(eq.THETA_D).xreplace(put)
    tan_phi = sp.tan(eq.PHI_D_OF_THETA_D).xreplace(put).xreplace({eq.theta_d: sp.Symbol("theta")})
    assert zero(sp.simplify(tan_theta - sp.tan(sp.Symbol("theta"))))
    assert zero(sp.simplify(tan_phi - sp.tan(sp.Symbol("phi"))))
    assert zero(sp.simplify((eq.F_T_D**2).xreplace(put)) - eq.F_T**2)


def test_eq39_is_the_hyperbolic_tangent_of_half():
    x = sp.Symbol("x", real=True)
    assert zero(eq.eq39(x).rewrite(sp.exp) - sp.tanh(x / 2).rewrite(sp.exp))
    assert sp.diff(eq.eq39(x), x).subs(x, 0) == sp.Rational(1, 2)


def test_eqs_41_43_47_are_derivatives_of_40_42_45():
    kinematics = {eq.x1.diff(eq.t): eq.x2, eq.x3.diff(eq.t): eq.x4, eq.x5.diff(eq.t): eq.x6}
    assert zero(eq.EQ40.diff(eq.t).xreplace(kinematics) - eq.EQ41)
    assert zero(eq.EQ42.diff(eq.t).xreplace(kinematics) - eq.EQ43)
    assert zero(eq.EQ45.diff(eq.t).xreplace(eq.EQ45_INTEGRAND) - eq.EQ47)


def test_eq46_exponent_passes_one_near_zero_error():
    first = evaluator(eq.eta1(eq.PHI))
    assert first({"x1": 0.0, "x1d": 0.0})[0] > 1.0
    assert first({"x1": 0.116, "x1d": 0.0})[0] > 1.0 > first({"x1": 0.118, "x1d": 0.0})[0]


def test_eq49_is_the_derivative_of_48_and_50_follows_only_on_the_virtual_rate():
    kinematics = {eq.x1.diff(eq.t): eq.x2, eq.x3.diff(eq.t): eq.x4, eq.x5.diff(eq.t): eq.x6}
    assert zero(eq.EQ48.diff(eq.t).xreplace(kinematics) - eq.EQ49)
    # x2 = x2d of Eq. 44 asks s_1 = e_1' + xi_1 e_1, which Eq. 45 does not give: 49 - 50 is e (e' + xi e - s).
    for row, axis in enumerate(eq.AXES):
        gap = eq.error(axis) * (eq.error_rate(axis) + axis.xi * eq.error(axis) - eq.surface(axis))
        assert zero(eq.EQ49[row] - eq.EQ50[row] - gap)


def test_eq52_makes_51_hold_without_uncertainty():
    assert zero(along(eq.EQ51, EQUIVALENT_CONTROL).xreplace(DISTURBANCES))


@pytest.mark.parametrize("form", ["abs", "sat"])
def test_exact_rate_of_57_replaces_59(form):
    adaptation = {
        estimate.diff(eq.t): rate
        for axis in eq.AXES
        for estimate, rate in zip(axis.Q_hat, eq.eq54(axis, form), strict=True)
    }
    rate = along(eq.EQ57.diff(eq.t).xreplace(adaptation), ATTITUDE_LAW)
    disturbances = (eq.d_phi, eq.d_theta, eq.d_psi)
    expected = [eq.true_rate(axis, d, form) for axis, d in zip(eq.AXES, disturbances, strict=True)]
    assert zero(rate - sp.Matrix(expected))


def test_eq58_is_the_derivative_of_57():
    kinematics = {eq.x1.diff(eq.t): eq.x2, eq.x3.diff(eq.t): eq.x4, eq.x5.diff(eq.t): eq.x6}
    assert zero(eq.EQ57.diff(eq.t).xreplace(kinematics) - eq.EQ58)


def test_eq59_is_not_what_the_law_gives():
    """At a point with e I > 0 and small s, V' of Eq. 57 is not bounded by Eq. 59 with any positive xi."""
    values = {"x1": 0.5, "x2": -0.5, "x1d": 0.0, "x1d_dot": 0.0, "S1": 0.5, "rho_phi1": 3.0, "rho_phi2": 2.5}
    values |= {"sigma_phi": 1.7, "Q_phi1_hat": 0.0, "Q_phi2_hat": 0.0, "Q_phi3_hat": 0.0}
    assert evaluator(eq.known_rate(eq.PHI))(values)[0] == pytest.approx(-0.25)
    values |= {"x1": -0.5, "x2": -0.5}
    assert evaluator(eq.known_rate(eq.PHI))(values)[0] == pytest.approx(0.25)


def test_hover_is_an_equilibrium_of_eq16():
    rest = dict.fromkeys(eq.STATES, 0) | {eq.U_phi: 0, eq.U_theta: 0, eq.U_psi: 0} | DISTURBANCES
    virtual = dict(zip((eq.U_x, eq.U_y, eq.U_z), eq.EQ15, strict=True))
    assert zero(eq.EQ16.xreplace(virtual).xreplace(rest).subs(eq.F_T.xreplace(rest), eq.m * eq.g))
