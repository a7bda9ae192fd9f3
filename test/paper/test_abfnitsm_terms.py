"""What the whole step of the attitude law does not show: widths, bounds and edges of Eqs. 39, 45, 54 and 55."""

import paper_equations as eq
import pytest
import sympy as sp
from attitude_points import attitude_points
from evaluation import evaluator

from quad_attitude_ctrl import sliding_control
from quad_attitude_ctrl.sliding_control import Estimates

pytestmark = pytest.mark.unit

eq39 = evaluator(eq.eq39(sp.Symbol("x", real=True)))
eq40, eq41, eq46 = (evaluator(rows) for rows in (eq.EQ40, eq.EQ41, eq.EQ46))


def test_eq39_saturation():
    for value in (-40.0, -3.0, -0.2, -1e-3, 0.0, 1e-9, 0.7, 2.5, 30.0):
        for width in (1.0, 0.1):
            found = sliding_control.saturation(value, width)
            assert found == pytest.approx(eq39({"x": value / width})[0], rel=1e-14)
    assert sliding_control.saturation(1e6, 1.0) == 1.0


def test_eq45_narrow_layer_in_both_terms():
    narrow = 0.1
    for point in attitude_points(count=10, seed=3960):
        e, e_dot, (eta1, eta2) = eq40(point)[0], eq41(point)[0], eq46(point)[:2]
        gains = point["delta_phi1"], point["delta_phi2"]
        expected = (
            gains[0] * abs(e) ** eta1 * eq39({"x": e / narrow})[0]
            + gains[1] * abs(e_dot) ** eta2 * eq39({"x": e_dot / narrow})[0]
        )
        found = sliding_control.surface_integrand(e, e_dot, sliding_control.angle_exponent(e), *gains, narrow)
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_integral_and_estimates_of_eqs_45_and_54_are_bounded():
    assert [sliding_control.next_surface_integral(0.5 * sign, 3.0 * sign, 0.51, 0.01) for sign in (-1, 1)] == [
        -0.51,
        0.51,
    ]
    assert sliding_control.next_estimate(0.5, 3.0, 0.51, 0.01) == 0.51
    assert sliding_control.next_estimate(0.5, 3.0, 100.0, 0.01) == pytest.approx(0.53, rel=1e-14)


@pytest.mark.parametrize("form", [0, 1], ids=["abs", "sat"])
def test_eq55_dead_zone_includes_its_edge(form):
    frozen, moving = (
        sliding_control.adaptive_rates(sliding, 1.0, 1.0, Estimates(1.0, 1.0, 1.0), form, 0.3, 1.0)
        for sliding in (-0.3, -0.300001)
    )
    assert frozen == (0.0, 0.0, 0.0)
    assert all(rate > 0.0 for rate in moving)
