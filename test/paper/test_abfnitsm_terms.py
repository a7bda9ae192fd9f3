"""Every function of the attitude law against its row of the transcribed Eqs. 17 and 39-60, axis by axis."""

import attitude_equations as att
import model_equations as model
import pytest
import sympy as sp
from attitude_points import AXES, attitude_points
from paper_points import VEHICLE, VEHICLE_VALUES
from paper_symbols import evaluator, t

from quad_attitude_ctrl import sliding_control, torque
from quad_attitude_ctrl.sliding_control import Estimates
from quad_core.types import Vec3

pytestmark = pytest.mark.unit

POINTS = attitude_points(count=40, seed=3960)
SAME = {"rel": 1e-11, "abs": 1e-11}
CORRECTED, PRINTED = 0, 1
FORMS = {"abs": 0, "sat": 1}
PLAIN_WIDTH = 1.0

x = sp.Symbol("x", real=True)
eq39 = evaluator(att.eq39(x))
eq40, eq41, eq45, eq46 = (evaluator(rows) for rows in (att.EQ40, att.EQ41, att.EQ45, att.EQ46))
integrand = evaluator(att.rows(att.integrand))
eq52 = {CORRECTED: evaluator(att.EQ52), PRINTED: evaluator(att.EQ52_PRINTED_DRAG)}
eq53, eq56 = evaluator(att.EQ53), evaluator(att.EQ56)
eq55 = {form: evaluator([rate for axis in att.AXES for rate in att.eq55(axis, form)]) for form in FORMS}
eq57_known = evaluator(att.EQ48)
phi_hat = evaluator(att.rows(lambda axis: att.phi_of(axis, axis.Q_hat)))
known_rate = evaluator(att.rows(att.known_rate))
eq17 = evaluator([model.a1, model.A2_PRINTED, model.a3, model.A4_PRINTED, model.a5, model.A6_PRINTED,
                  model.b1, model.b2, model.b3])  # fmt: skip


@pytest.fixture(params=[0, 1, 2], ids=["phi", "theta", "psi"])
def axis(request):
    return request.param


def estimates(point, name, suffix="_hat", stem="Q"):
    return Estimates(*(point[f"{stem}_{name}{index}{suffix}"] for index in (1, 2, 3)))


def test_eq39_saturation():
    for value in (-40.0, -3.0, -0.2, -1e-3, 0.0, 1e-9, 0.7, 2.5, 30.0):
        assert sliding_control.saturation(value, PLAIN_WIDTH) == pytest.approx(eq39({"x": value})[0], rel=1e-14)
        assert sliding_control.saturation(value, 0.1) == pytest.approx(eq39({"x": value / 0.1})[0], rel=1e-14)
    assert sliding_control.saturation(1e6, PLAIN_WIDTH) == 1.0


def test_eq17_coefficients():
    assert torque.coefficients(VEHICLE) == pytest.approx(eq17(VEHICLE_VALUES), rel=1e-14)


def test_eq46_exponents(axis):
    for point in POINTS:
        first = sliding_control.angle_exponent(eq40(point)[axis])
        assert first == pytest.approx(eq46(point)[2 * axis], **SAME)
        assert sliding_control.rate_exponent(first) == pytest.approx(eq46(point)[2 * axis + 1], **SAME)


def surface_integrand(point, axis, width=PLAIN_WIDTH):
    name = AXES[axis][2]
    return sliding_control.surface_integrand(
        error=eq40(point)[axis],
        error_rate=eq41(point)[axis],
        exponent=eq46(point)[2 * axis],
        angle_gain=point[f"delta_{name}1"],
        rate_gain=point[f"delta_{name}2"],
        width=width,
    )


def test_eq45_integrand_and_sliding_variable(axis):
    for point in POINTS:
        assert surface_integrand(point, axis) == pytest.approx(integrand(point)[axis], **SAME)
        value = sliding_control.sliding_variable(error_rate=eq41(point)[axis], integral=point[f"S{AXES[axis][0]}"])
        assert value == pytest.approx(eq45(point)[axis], **SAME)


def test_eq45_narrow_layer_in_both_terms():
    narrow = 0.1
    for point in POINTS[:10]:
        e, e_dot, (eta1, eta2) = eq40(point)[0], eq41(point)[0], eq46(point)[:2]
        expected = (
            point["delta_phi1"] * abs(e) ** eta1 * eq39({"x": e / narrow})[0]
            + point["delta_phi2"] * abs(e_dot) ** eta2 * eq39({"x": e_dot / narrow})[0]
        )
        assert surface_integrand(point, 0, narrow) == pytest.approx(expected, **SAME)


def test_eq45_integral_is_forward_euler():
    assert sliding_control.next_surface_integral(0.5, -3.0, 100.0, 0.01) == pytest.approx(0.47, rel=1e-14)
    assert sliding_control.next_surface_integral(0.5, 3.0, 0.51, 0.01) == 0.51
    assert sliding_control.next_estimate(0.5, 3.0, 2.0, 100.0, 0.01) == pytest.approx(0.52, rel=1e-14)
    assert sliding_control.next_surface_integral(-0.5, -3.0, 0.51, 0.01) == -0.51


def model_terms(point, sign):
    rates = Vec3(point["x2"], point["x4"], point["x6"])
    return torque.model_acceleration(torque.coefficients(VEHICLE), rates, sign)


@pytest.mark.parametrize("sign", [CORRECTED, PRINTED])
def test_eq16_model_terms_in_the_law(axis, sign):
    damping = (model.DAMPING, model.DAMPING_PRINTED)[sign]
    free = model.eq16(damping).xreplace(dict.fromkeys((model.U_phi, model.U_theta, model.U_psi), 0))
    expected = evaluator(free.xreplace(dict.fromkeys((model.d_phi, model.d_theta, model.d_psi), 0))[1:6:2])
    for point in POINTS:
        assert model_terms(point, sign)[axis] == pytest.approx(expected(point)[axis], **SAME)


def equivalent(point, axis, sign):
    return sliding_control.equivalent_control(
        desired_acceleration=point[f"x{AXES[axis][0]}d_ddot"],
        model=model_terms(point, sign)[axis],
        integrand=surface_integrand(point, axis),
        error=eq40(point)[axis],
    )


@pytest.mark.parametrize("sign", [CORRECTED, PRINTED])
def test_eq52_equivalent_control(axis, sign):
    a = torque.coefficients(VEHICLE)
    for point in POINTS:
        value = sliding_control.force_difference(equivalent(point, axis, sign), (a.b1, a.b2, a.b3)[axis])
        assert value == pytest.approx(eq52[sign](point)[axis], **SAME)


def reaching(point, axis, width=PLAIN_WIDTH):
    angle, rate, name = AXES[axis]
    bound = sliding_control.uncertainty_bound(estimates(point, name), point[f"x{angle}"], point[f"x{rate}"])
    return sliding_control.reaching_control(
        sliding=eq45(point)[axis],
        linear_gain=point[f"rho_{name}1"],
        power_gain=point[f"rho_{name}2"],
        power=point[f"sigma_{name}"],
        bound=bound,
        width=width,
    )


def test_eq60_uncertainty_bound(axis):
    angle, rate, name = AXES[axis]
    for point in POINTS:
        value = sliding_control.uncertainty_bound(estimates(point, name), point[f"x{angle}"], point[f"x{rate}"])
        assert value == pytest.approx(phi_hat(point)[axis], **SAME)


def test_eq53_reaching_law(axis):
    a = torque.coefficients(VEHICLE)
    for point in POINTS:
        value = sliding_control.force_difference(reaching(point, axis), (a.b1, a.b2, a.b3)[axis])
        assert value == pytest.approx(eq53(point)[axis], **SAME)


@pytest.mark.parametrize("form", FORMS)
def test_eqs_54_and_55_adaptation_with_dead_zone(axis, form):
    angle, rate, name = AXES[axis]
    inside = 0
    for point in POINTS:
        value = sliding_control.adaptive_rates(
            sliding=eq45(point)[axis],
            angle=point[f"x{angle}"],
            rate=point[f"x{rate}"],
            gains=estimates(point, name, "", "Delta"),
            form=FORMS[form],
            dead_zone=point["delta"],
            width=PLAIN_WIDTH,
        )
        assert value == pytest.approx(eq55[form](point)[3 * axis : 3 * axis + 3], **SAME)
        inside += value == (0.0, 0.0, 0.0)
    assert 0 < inside < len(POINTS)


@pytest.mark.parametrize("form", FORMS.values())
def test_eq55_dead_zone_includes_its_edge(form):
    frozen = sliding_control.adaptive_rates(-0.3, 1.0, 1.0, Estimates(1.0, 1.0, 1.0), form, 0.3, PLAIN_WIDTH)
    assert frozen == (0.0, 0.0, 0.0)
    moving = sliding_control.adaptive_rates(-0.300001, 1.0, 1.0, Estimates(1.0, 1.0, 1.0), form, 0.3, PLAIN_WIDTH)
    assert all(rate > 0.0 for rate in moving)


def test_eq54_estimates_are_forward_euler():
    assert sliding_control.next_estimate(0.5, 3.0, 0.0, 100.0, 0.01) == pytest.approx(0.53, rel=1e-14)
    assert sliding_control.next_estimate(0.5, 3.0, 0.0, 0.51, 0.01) == 0.51


def test_eq56_total_control(axis):
    a = torque.coefficients(VEHICLE)
    for point in POINTS:
        acceleration = equivalent(point, axis, CORRECTED) + reaching(point, axis)
        total = sliding_control.force_difference(acceleration, (a.b1, a.b2, a.b3)[axis])
        assert total == pytest.approx(eq56(point)[axis], **SAME)


def test_eq57_and_58_lyapunov(axis):
    angle, _, name = AXES[axis]
    for point in POINTS:
        e, s = eq40(point)[axis], eq45(point)[axis]
        assert sliding_control.lyapunov(error=e, sliding=s) == pytest.approx(eq57_known(point)[axis], **SAME)
        value = sliding_control.lyapunov_rate(
            error=e,
            integral=point[f"S{angle}"],
            sliding=s,
            linear_gain=point[f"rho_{name}1"],
            power_gain=point[f"rho_{name}2"],
            power=point[f"sigma_{name}"],
            bound=phi_hat(point)[axis],
            width=PLAIN_WIDTH,
        )
        assert value == pytest.approx(known_rate(point)[axis], **SAME)


def test_eqs_13_and_14_exact_body_acceleration():
    """The derivative of the inverse of Eq. 13 along given angle accelerations, differentiated by SymPy."""
    body = model.EQ13_MATRIX.inv() * sp.Matrix([model.x1.diff(t), model.x3.diff(t), model.x5.diff(t)])
    exact = evaluator(body.diff(t))
    for point in POINTS:
        rates = vector(point, "x2", "x4", "x6")
        commanded = vector(point, "x1d_ddot", "x3d_ddot", "x5d_ddot")
        values = point | dict(zip(("x1_dot", "x3_dot", "x5_dot"), rates, strict=True))
        values |= dict(zip(("x1_ddot", "x3_ddot", "x5_ddot"), commanded, strict=True))
        found = torque.body_acceleration(vector(point, "x1", "x3", "x5"), rates, commanded)
        assert found == pytest.approx(exact(values), **SAME)


@pytest.mark.parametrize("sign", [CORRECTED, PRINTED])
def test_eq1_inverse_dynamics(sign):
    drag = model.EQ9 if sign == CORRECTED else model.EQ9_PRINTED
    _, angular = model.eq1(model.tau, model.EQ5, drag)
    forward = evaluator(angular)
    for point in POINTS:
        omega, commanded = vector(point, "x2", "x4", "x6"), vector(point, "x1d_ddot", "x3d_ddot", "x5d_ddot")
        moment = torque.inverse_dynamics(VEHICLE, omega, commanded, sign)
        values = point | dict(zip("pqr", omega, strict=True))
        values |= dict(zip(("tau_x", "tau_y", "tau_z"), moment, strict=True))
        assert forward(values) == pytest.approx(commanded, rel=1e-10, abs=1e-10)


def vector(point, *names):
    return Vec3(*(point[name] for name in names))
