"""Steps of the proof of the attitude law, held against the law's own functions: eqs. 42-44, 47, 49-51.

Derivatives are taken of what the functions return, by central differences along a motion that the point gives.
"""

import random

import paper_equations as eq
import pytest
from attitude_points import AXES, attitude_points
from evaluation import evaluator

from quad_attitude_ctrl import sliding_control

pytestmark = pytest.mark.unit

STEP = 1e-4
CHANCE = random.Random(4251)
CLOSE = {"rel": 1e-6, "abs": 1e-6}
SAME = {"rel": 1e-12, "abs": 1e-12}
POINTS = [
    point
    | {f"x{rate}_dot": CHANCE.uniform(-5.0, 5.0) for _, rate, _ in AXES}
    | {f"xi{angle}": CHANCE.uniform(0.5, 3.0) for angle, _, _ in AXES}
    for point in attitude_points(count=30, seed=4251)
]
RATES = {axis.angle.diff(eq.t): axis.rate for axis in eq.AXES} | eq.EQ45_INTEGRAND


def along_motion(expression):
    """Return an evaluator in which x_1' is x_2 and the integral of Eq. 45 moves by its integrand."""
    return evaluator(expression.xreplace(RATES).xreplace(RATES))


eq42, eq43, eq44 = (evaluator(rows) for rows in (eq.EQ42, eq.EQ43, eq.EQ44))
eq47, eq49, eq50, eq51 = (along_motion(rows) for rows in (eq.EQ47, eq.EQ49, eq.EQ50, eq.EQ51))


@pytest.fixture(params=[0, 1, 2], ids=["phi", "theta", "psi"])
def axis(request):
    return request.param


def error(point, axis):
    angle, _, _ = AXES[axis]
    return point[f"x{angle}"] - point[f"x{angle}d"]


def error_rate(point, axis):
    angle, rate, _ = AXES[axis]
    return point[f"x{rate}"] - point[f"x{angle}d_dot"]


def integrand(point, axis):
    e, name = error(point, axis), AXES[axis][2]
    gains = point[f"delta_{name}1"], point[f"delta_{name}2"]
    return sliding_control.surface_integrand(e, error_rate(point, axis), sliding_control.angle_exponent(e), *gains, 1.0)


def sliding(point, axis):
    return sliding_control.sliding_variable(error_rate(point, axis), point[f"S{AXES[axis][0]}"])


def moved(point, axis, time):
    """Return the point ``time`` s later: angle and command by their rates, the integral by the law's integrator."""
    angle, rate, _ = AXES[axis]
    acceleration, rate_d = point[f"x{angle}d_ddot"], point[f"x{angle}d_dot"]
    return point | {
        f"x{angle}": point[f"x{angle}"] + time * point[f"x{rate}"],
        f"x{rate}": point[f"x{rate}"] + time * point[f"x{rate}_dot"],
        f"x{angle}d": point[f"x{angle}d"] + time * rate_d,
        f"x{angle}d_dot": rate_d + time * acceleration,
        f"S{angle}": sliding_control.next_surface_integral(point[f"S{angle}"], integrand(point, axis), 1e9, time),
    }


def slope(function, point, axis):
    return (function(moved(point, axis, STEP), axis) - function(moved(point, axis, -STEP), axis)) / (2.0 * STEP)


def first_function(point, axis):
    return sliding_control.lyapunov(error(point, axis), 0.0)


def second_function(point, axis):
    return sliding_control.lyapunov(error(point, axis), sliding(point, axis))


def test_eqs_42_and_43_first_function_and_its_rate(axis):
    for point in POINTS:
        assert first_function(point, axis) == pytest.approx(eq42(point)[axis], **SAME)
        assert slope(first_function, point, axis) == pytest.approx(eq43(point)[axis], **CLOSE)


def test_eq44_is_missed_by_the_integral_of_the_surface(axis):
    """x_2 - x_2d = xi_1 e_1 - I: what the law has in the place of Eq. 44 is e_1' = s_1 - I."""
    angle, rate, _ = AXES[axis]
    for point in POINTS:
        rate_d, xi, integral = point[f"x{angle}d_dot"], point[f"xi{angle}"], point[f"S{angle}"]
        virtual_rate = sliding(point, axis) + rate_d - xi * error(point, axis)
        assert virtual_rate == pytest.approx(eq44(point)[axis], **SAME)
        assert point[f"x{rate}"] - virtual_rate == pytest.approx(xi * error(point, axis) - integral, **SAME)


def test_eq47_is_the_rate_of_the_sliding_variable(axis):
    for point in POINTS:
        assert slope(sliding, point, axis) == pytest.approx(eq47(point)[axis], **CLOSE)


def test_eq49_is_the_rate_of_the_second_function(axis):
    for point in POINTS:
        assert slope(second_function, point, axis) == pytest.approx(eq49(point)[axis], **CLOSE)


def test_eq50_holds_only_where_the_rate_is_the_virtual_one(axis):
    angle, _, _ = AXES[axis]
    for point in POINTS:
        at_virtual_rate = point | {f"S{angle}": point[f"xi{angle}"] * error(point, axis)}
        assert slope(second_function, at_virtual_rate, axis) == pytest.approx(eq50(at_virtual_rate)[axis], **CLOSE)
    anywhere = [slope(second_function, point, axis) - eq50(point)[axis] for point in POINTS]
    assert max(abs(gap) for gap in anywhere) > 0.1


def test_eq51_holds_under_the_equivalent_control_alone(axis):
    """Model terms, x_1d'' and e_1 of Eq. 52 leave s_1' = -e_1: the plant adds its model terms to b_1 U_phi0."""
    angle, rate, _ = AXES[axis]
    for point in POINTS:
        model = CHANCE.uniform(-4.0, 4.0)
        arguments = point[f"x{angle}d_ddot"], model, integrand(point, axis), error(point, axis)
        driven = point | {f"x{rate}_dot": model + sliding_control.equivalent_control(*arguments)}
        assert eq51(driven)[axis] == pytest.approx(0.0, abs=1e-10)
        assert slope(sliding, driven, axis) == pytest.approx(-error(point, axis), **CLOSE)
