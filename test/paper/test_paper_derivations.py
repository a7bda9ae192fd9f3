"""The transcription of the paper agrees with itself: every derived equation follows from the ones before it."""

import attitude_equations as att
import model_equations as model
import position_equations as pos
import pytest
import sympy as sp
from paper_symbols import (
    F_T,
    U_phi,
    U_psi,
    U_theta,
    U_x,
    U_y,
    U_z,
    d_phi,
    d_psi,
    d_theta,
    d_x,
    d_y,
    d_z,
    evaluator,
    g,
    m,
    t,
    x1,
    x2,
    x3,
    x4,
    x5,
    x6,
    xi8,
    xi8_hat,
    xi10,
    xi10_hat,
    xi12,
    xi12_hat,
    zero,
)

pytestmark = pytest.mark.unit

DISTURBANCES = {d_x: 0, d_y: 0, d_z: 0, d_phi: 0, d_theta: 0, d_psi: 0}
SECOND_ERRORS = ((pos.e8, xi8, xi8_hat), (pos.e10, xi10, xi10_hat), (pos.e12, xi12, xi12_hat))


def along(expression, law):
    """Put Eq. 16, the integrals of Eqs. 21 and 45 and a law {U: expression} into ``expression``."""
    rates = {**model.dynamics(), **pos.EQ21, **att.EQ45_INTEGRAND}
    return expression.xreplace(rates).xreplace(law)


POSITION_LAW = dict(zip((U_x, U_y, U_z), pos.EQ30_KNOWN_DISTURBANCE, strict=True))
POSITION_LAW_BLIND = dict(zip((U_x, U_y, U_z), pos.EQ30, strict=True))
ATTITUDE_LAW = dict(zip((U_phi, U_theta, U_psi), att.EQ56, strict=True))
EQUIVALENT_CONTROL = dict(zip((U_phi, U_theta, U_psi), att.EQ52, strict=True))


def test_eq4_is_yaw_times_pitch_times_roll():
    roll = sp.Matrix([[1, 0, 0], [0, sp.cos(x1), -sp.sin(x1)], [0, sp.sin(x1), sp.cos(x1)]])
    pitch = sp.Matrix([[sp.cos(x3), 0, sp.sin(x3)], [0, 1, 0], [-sp.sin(x3), 0, sp.cos(x3)]])
    yaw = sp.Matrix([[sp.cos(x5), -sp.sin(x5), 0], [sp.sin(x5), sp.cos(x5), 0], [0, 0, 1]])
    assert zero(model.EQ4 - yaw * pitch * roll)


def test_eq12_lemma_1():
    a = sp.Matrix([[3, 1], [0, 2]])
    b, c, d = sp.Matrix([[1, 2, 0], [0, 1, 1]]), sp.Matrix([[1, 0], [2, 1], [0, 3]]), sp.Matrix([[1, 1], [0, 2]])
    product = b * c * d
    right = a.inv() - (sp.eye(2) + a.inv() * product).inv() * a.inv() * product * a.inv()
    assert (a + product).inv() == right


def test_eq11_is_eq10_minus_the_nominal_model():
    true_p, true_a = model.eq10(model.EQ5, model.EQ9)
    nominal_p, nominal_a = model.eq1(model.tau, model.EQ5, model.EQ9)
    lumped_p, lumped_a = model.eq11(model.EQ5, model.EQ9)
    assert zero(true_p - nominal_p - lumped_p)
    assert zero(true_a - nominal_a - lumped_a)


def test_eq13_follows_from_the_derivative_of_eq4():
    angles = (x1, x3, x5)
    rates = dict(zip((angle.diff(t) for angle in angles), model.EQ13, strict=True))
    assert zero((model.EQ4.diff(t).xreplace(rates) - model.EQ4 * model.EQ7).applyfunc(sp.trigsimp))


def test_eq16_follows_from_eqs_1_and_15_at_small_angles():
    acceleration, angular = model.eq1(model.TORQUE, model.EQ5, model.EQ9)
    small = dict(zip((model.p, model.q, model.r), (x2, x4, x6), strict=True))
    virtual = dict(zip((U_x, U_y, U_z), model.EQ15, strict=True))
    eq16 = model.EQ16.xreplace(DISTURBANCES).xreplace(virtual)
    assert zero(sp.Matrix([eq16[i] for i in (7, 9, 11)]) - acceleration)
    assert zero(sp.Matrix([eq16[i] for i in (1, 3, 5)]) - angular.xreplace(small))


def test_printed_drag_is_the_negative_of_the_corrected_one_only_for_positive_rates():
    printed, corrected = sp.Matrix(model.DAMPING_PRINTED), sp.Matrix(model.DAMPING)
    ups = {state: sp.Symbol(f"u{i}", positive=True) for i, state in enumerate(model.STATES)}
    assert zero((printed + corrected).xreplace(ups))


def test_eqs_19_and_22_are_derivatives_of_18_and_20():
    kinematics = model.dynamics()
    assert zero(pos.EQ18.diff(t).xreplace(kinematics) - pos.EQ19)
    assert zero(pos.EQ20.diff(t).xreplace(kinematics) - pos.EQ22)


def test_eq24_follows_from_23():
    virtual = dict(zip((model.x8, model.x10, model.x12), pos.EQ23, strict=True))
    assert zero(pos.EQ22.xreplace(pos.EQ21).xreplace(virtual) - pos.EQ24)


def test_eqs_27_and_28_are_derivatives_of_26():
    assert zero(pos.EQ26.diff(t) - pos.EQ27)
    assert zero(along(pos.EQ27, {}) - along(pos.EQ28, {}))


def test_eq30_makes_29_hold_when_the_disturbance_is_known():
    assert zero(along(pos.EQ29, POSITION_LAW))


def test_eq30_without_the_disturbance_leaves_exactly_d_in_29():
    assert zero(along(pos.EQ29, POSITION_LAW_BLIND) - sp.Matrix([d_x, d_y, d_z]))


def test_eqs_31_to_36_follow_with_the_known_disturbance():
    assert zero(along(pos.EQ31.diff(t), POSITION_LAW) - pos.EQ32)
    assert zero(pos.EQ32.xreplace(pos.EQ37) - pos.EQ34)
    assert zero(along(pos.EQ35.diff(t), POSITION_LAW).xreplace(pos.EQ37) - pos.EQ36)


def test_eq36_gains_e_times_d_when_the_disturbance_is_unknown():
    rate = along(pos.EQ35.diff(t), POSITION_LAW_BLIND).xreplace(pos.EQ37)
    assert zero(rate - pos.EQ36 - pos.e8 * d_x - pos.e10 * d_y - pos.e12 * d_z)


def test_eq38_inverts_eq15():
    forces = model.EQ15.xreplace({x1: sp.Symbol("phi"), x3: sp.Symbol("theta"), x5: pos.psi_d})
    put = dict(zip((U_x, U_y, U_z), forces, strict=True))
    tan_theta = sp.tan(pos.THETA_D).xreplace(put)
    tan_phi = sp.tan(pos.PHI_D_OF_THETA_D).xreplace(put).xreplace({pos.theta_d: sp.Symbol("theta")})
    assert zero(sp.simplify(tan_theta - sp.tan(sp.Symbol("theta"))))
    assert zero(sp.simplify(tan_phi - sp.tan(sp.Symbol("phi"))))
    assert zero(sp.simplify((pos.F_T_D**2).xreplace(put)) - F_T**2)


def test_eq39_is_the_hyperbolic_tangent_of_half():
    x = sp.Symbol("x", real=True)
    assert zero(att.eq39(x).rewrite(sp.exp) - sp.tanh(x / 2).rewrite(sp.exp))
    assert sp.diff(att.eq39(x), x).subs(x, 0) == sp.Rational(1, 2)


def test_eqs_41_43_47_are_derivatives_of_40_42_45():
    kinematics = {x1.diff(t): x2, x3.diff(t): x4, x5.diff(t): x6}
    assert zero(att.EQ40.diff(t).xreplace(kinematics) - att.EQ41)
    assert zero(att.EQ42.diff(t).xreplace(kinematics) - att.EQ43)
    assert zero(att.EQ45.diff(t).xreplace(att.EQ45_INTEGRAND) - att.EQ47)


def test_eq46_exponent_passes_one_near_zero_error():
    first = evaluator(att.eta1(att.PHI))
    assert first({"x1": 0.0, "x1d": 0.0})[0] > 1.0
    assert first({"x1": 0.116, "x1d": 0.0})[0] > 1.0 > first({"x1": 0.118, "x1d": 0.0})[0]


def test_eq49_is_the_derivative_of_48_and_50_follows_only_on_the_virtual_rate():
    kinematics = {x1.diff(t): x2, x3.diff(t): x4, x5.diff(t): x6}
    assert zero(att.EQ48.diff(t).xreplace(kinematics) - att.EQ49)
    # x2 = x2d of Eq. 44 asks s_1 = e_1' + xi_1 e_1, which Eq. 45 does not give: 49 - 50 is e (e' + xi e - s).
    for row, axis in enumerate(att.AXES):
        gap = att.error(axis) * (att.error_rate(axis) + axis.xi * att.error(axis) - att.surface(axis))
        assert zero(att.EQ49[row] - att.EQ50[row] - gap)


def test_eq52_makes_51_hold_without_uncertainty():
    assert zero(along(att.EQ51, EQUIVALENT_CONTROL).xreplace(DISTURBANCES))


@pytest.mark.parametrize("form", ["abs", "sat"])
def test_exact_rate_of_57_replaces_59(form):
    adaptation = {
        estimate.diff(t): rate
        for axis in att.AXES
        for estimate, rate in zip(axis.Q_hat, att.eq54(axis, form), strict=True)
    }
    rate = along(att.EQ57.diff(t).xreplace(adaptation), ATTITUDE_LAW)
    disturbances = (d_phi, d_theta, d_psi)
    expected = [att.true_rate(axis, d, form) for axis, d in zip(att.AXES, disturbances, strict=True)]
    assert zero(rate - sp.Matrix(expected))


def test_eq58_is_the_derivative_of_57():
    kinematics = {x1.diff(t): x2, x3.diff(t): x4, x5.diff(t): x6}
    assert zero(att.EQ57.diff(t).xreplace(kinematics) - att.EQ58)


def test_eq59_is_not_what_the_law_gives():
    """At a point with e I > 0 and small s, V' of Eq. 57 is not bounded by Eq. 59 with any positive xi."""
    values = {"x1": 0.5, "x2": -0.5, "x1d": 0.0, "x1d_dot": 0.0, "S1": 0.5, "rho_phi1": 3.0, "rho_phi2": 2.5}
    values |= {"sigma_phi": 1.7, "Q_phi1_hat": 0.0, "Q_phi2_hat": 0.0, "Q_phi3_hat": 0.0}
    assert evaluator(att.known_rate(att.PHI))(values)[0] == pytest.approx(-0.25)
    values |= {"x1": -0.5, "x2": -0.5}
    assert evaluator(att.known_rate(att.PHI))(values)[0] == pytest.approx(0.25)


def test_hover_is_an_equilibrium_of_eq16():
    rest = dict.fromkeys(model.STATES, 0) | {U_phi: 0, U_theta: 0, U_psi: 0} | DISTURBANCES
    virtual = dict(zip((U_x, U_y, U_z), model.EQ15, strict=True))
    assert zero(model.EQ16.xreplace(virtual).xreplace(rest).subs(F_T.xreplace(rest), m * g))
