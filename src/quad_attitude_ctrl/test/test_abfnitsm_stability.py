"""What eqs. 45-58 do to one axis in motion: Runge-Kutta on a double integrator, apart from our plants."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from quad_attitude_ctrl import sliding_control as control
from quad_attitude_ctrl.sliding_control import Estimates

ANGLE_GAIN, RATE_GAIN, RHO1, RHO2, SIGMA = 28.5, 6.0, 3.0, 2.5, 1.7
GAINS = Estimates(1.0, 0.7, 0.4)
BOUNDS = Estimates(1.5, 0.5, 0.2)
angles, speeds = st.floats(-1.0, 1.0), st.floats(-3.0, 3.0)


def motion(form, dead_zone, disturbance, width=1.0):
    """Return the right side of (x1, x2, I, Q1, Q2, Q3) for x_1d = 0, d a function of t; Eq. 56 as the law has it."""

    def rate(t, y):
        x1, x2, integral, *q = y
        integrand = control.surface_integrand(x1, x2, control.angle_exponent(x1), ANGLE_GAIN, RATE_GAIN, width)
        s = control.sliding_variable(x2, integral)
        bound = control.uncertainty_bound(Estimates(*q), x1, x2)
        u = control.equivalent_control(0.0, 0.0, integrand, x1)
        u += control.reaching_control(s, RHO1, RHO2, SIGMA, bound, width)
        return [x2, u + disturbance(t), integrand, *control.adaptive_rates(s, x1, x2, GAINS, form, dead_zone, width)]

    return rate


def total(y):
    """Return l_phi of Eq. 57."""
    x1, x2, integral, *q = y
    known = control.lyapunov(x1, control.sliding_variable(x2, integral))
    return known + 0.5 * sum((true - own) ** 2 / gain for true, own, gain in zip(BOUNDS, q, GAINS, strict=True))


def predicted(y, d, form, dead_zone, width=1.0):
    """Return l_phi' (Eq. 58) along the law's own motion, in place of Eq. 59: no estimate moves in its dead zone."""
    x1, x2, integral, *q = y
    s = control.sliding_variable(x2, integral)
    bound = control.uncertainty_bound(Estimates(*q), x1, x2)
    true = control.uncertainty_bound(BOUNDS, x1, x2)
    known = control.lyapunov_rate(x1, integral, s, RHO1, RHO2, SIGMA, bound, width)
    drive = 0.0 if abs(s) <= dead_zone else s * math.tanh(s / (2.0 * width)) if form else abs(s)
    return known + s * d - (true - bound) * drive


@pytest.mark.parametrize(("form", "dead_zone"), [(0, 0.0), (1, 0.0), (0, 0.3)])
@given(e=angles, rate=speeds, integral=speeds, phase=st.floats(0.0, 6.0))
@settings(max_examples=8, deadline=None)
def test_the_function_of_eq_57_moves_by_the_exact_identity(form, dead_zone, e, rate, integral, phase):
    def disturbance(t):
        return 2.0 * math.cos(5.0 * t + phase)

    right = motion(form, dead_zone, disturbance)
    grid = np.linspace(0.0, 0.6, 601)
    path = solve_ivp(right, (0.0, 0.6), [e, rate, integral, 0.2, 0.1, 0.3], t_eval=grid, rtol=1e-9, max_step=2e-3).y.T
    rates = [predicted(y, disturbance(t), form, dead_zone) for t, y in zip(grid, path, strict=True)]
    moved = np.trapezoid(rates, grid)
    assert total(path[-1]) - total(path[0]) == pytest.approx(moved, rel=1e-3, abs=2e-3)


@given(e=angles, rate=speeds, integral=speeds)
@settings(max_examples=8, deadline=None)
def test_dead_zone_freezes_along_a_motion(e, rate, integral):
    """Wide enough for the whole motion: no estimate moves by a bit."""
    right = motion(0, 50.0, lambda t: 1.0)
    path = solve_ivp(right, (0.0, 1.0), [e, rate, integral, 0.2, 0.1, 0.3], rtol=1e-8).y.T
    assert (path[:, 3:] == path[0, 3:]).all()


def test_eq_59_does_not_hold_without_any_disturbance():
    """On the surface (s = 0) with the error closing: e = 0.1, I = -0.1, e' = 0.1; nothing but -e I = +0.01 is left."""
    y = [0.1, 0.1, -0.1, 1.5, 0.5, 0.2]
    assert predicted(y, 0.0, 0, 0.3) == pytest.approx(0.01, abs=1e-12)
    right = motion(0, 0.3, lambda t: 0.0)
    after = solve_ivp(right, (0.0, 0.01), y, rtol=1e-10, atol=1e-14).y[:, -1]
    assert total(after) > total(y)
