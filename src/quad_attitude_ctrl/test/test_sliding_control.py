"""The sliding law of an axis: its certificate, the last part of the way to zero, its estimates under noise."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from quad_attitude_ctrl import sliding_control as law
from quad_attitude_ctrl.sliding_control import (
    AdaptationForm,
    AxisGains,
    AxisMemory,
    AxisState,
    Estimates,
    angle_exponent,
    axis_control,
    next_axis_memory,
)

ANGLE_GAIN, RATE_GAIN, RHO1, RHO2, SIGMA = 28.5, 6.0, 3.0, 2.5, 1.7
GAINS = Estimates(1.0, 0.7, 0.4)
BOUNDS = Estimates(1.5, 0.5, 0.2)
angles, speeds = st.floats(-1.0, 1.0), st.floats(-3.0, 3.0)


def motion(form, dead_zone, disturbance, width=1.0):
    """Return the right side of (x1, x2, I, Q1, Q2, Q3) for x_1d = 0, d a function of t; Eq. 56 as the law has it."""

    def rate(t, y):
        x1, x2, integral, *q = y
        integrand = law.surface_integrand(x1, x2, law.angle_exponent(x1), ANGLE_GAIN, RATE_GAIN, width)
        s = law.sliding_variable(x2, integral)
        bound = law.uncertainty_bound(Estimates(*q), x1, x2)
        u = law.equivalent_control(0.0, 0.0, integrand, x1)
        u += law.reaching_control(s, RHO1, RHO2, SIGMA, bound, width)
        return [x2, u + disturbance(t), integrand, *law.adaptive_rates(s, x1, x2, GAINS, form, dead_zone, width)]

    return rate


def total(y):
    """Return l_phi of Eq. 57."""
    x1, x2, integral, *q = y
    known = law.lyapunov(x1, law.sliding_variable(x2, integral))
    return known + 0.5 * sum((true - own) ** 2 / gain for true, own, gain in zip(BOUNDS, q, GAINS, strict=True))


def predicted(y, d, form, dead_zone, width=1.0):
    """Return l_phi' (Eq. 58) along the law's own motion, in place of Eq. 59: no estimate moves in its dead zone."""
    x1, x2, integral, *q = y
    s = law.sliding_variable(x2, integral)
    bound = law.uncertainty_bound(Estimates(*q), x1, x2)
    true = law.uncertainty_bound(BOUNDS, x1, x2)
    known = law.lyapunov_rate(x1, integral, s, RHO1, RHO2, SIGMA, bound, width)
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


ETA = 0.5 + math.exp(-(0.25**1.4) - 0.2**0.7)
"""eta_1 of Eq. 46 at e = 0."""


def tail(linear_gain, width, angle_gain=28.5, rate_gain=6.0):
    """Return times and errors of one axis from 0.05 rad at rest, without disturbance, Q_hat = 0."""

    def rate(t, y):
        e, e_rate, integral = y
        integrand = law.surface_integrand(e, e_rate, law.angle_exponent(e), angle_gain, rate_gain, width)
        s = law.sliding_variable(e_rate, integral)
        control = law.equivalent_control(0.0, 0.0, integrand, e)
        control += law.reaching_control(s, linear_gain, 2.5, 1.7, 0.0, 1.0)
        return [e_rate, control, integrand]

    times = np.geomspace(1.0, 1e6, 60)
    return times, solve_ivp(rate, (0.0, 1e6), [0.05, 0.0, 0.0], "LSODA", times, rtol=1e-9, atol=1e-15).y[0]


@pytest.mark.parametrize(("linear_gain", "width"), [(3.0, 1.0), (20.0, 1.0), (3.0, 0.05)])
def test_the_tail_is_the_power_law_that_the_slow_motion_gives(linear_gain, width):
    """s creeps at -e / rho_1, so e' = -rho_1 delta_1 / (2 width) abs(e)^eta_1 e and e -> (c t)^(-1/eta_1)."""
    times, errors = tail(linear_gain, width)
    late = times > 1e5
    slope = np.polyfit(np.log(times[late]), np.log(np.abs(errors[late])), 1)[0]
    assert slope == pytest.approx(-1.0 / ETA, abs=0.02)
    pace = ETA * linear_gain * 28.5 / (2.0 * width)
    assert abs(errors[-1]) == pytest.approx((pace * times[-1]) ** (-1.0 / ETA), rel=0.15)


DT, SECONDS, RATE = 0.002, 20.0, 1.5


def estimate_after(noise_sd, dead_zone):
    """Return Q_hat of an axis at rest whose rate error is white noise; without a surface integral."""
    gains = AxisGains(dead_zone=dead_zone, adaptation_constant=RATE, max_estimate=1e9, max_surface_integral=0.0)
    rng, memory = random.Random(3), AxisMemory(0.0, Estimates(0.0, 0.0, 0.0))
    for _ in range(round(SECONDS / DT)):
        state = AxisState(0.2, 0.0, 0.0, rng.gauss(0.0, noise_sd), 0.0, 0.0)
        control = axis_control(gains, memory, state, angle_exponent(state.error), AdaptationForm.ABS)
        memory = next_axis_memory(gains, memory, control, False, DT)
    return memory.estimates.constant


@pytest.mark.parametrize("noise_sd", [0.1, 0.4])
def test_eq54_is_pumped_up_by_the_mean_size_of_the_noise(noise_sd):
    """Without a dead zone by Delta E abs(n) = Delta sd sqrt(2 / pi) a second."""
    grown = estimate_after(noise_sd, 0.0)
    assert grown == pytest.approx(RATE * noise_sd * math.sqrt(2.0 / math.pi) * SECONDS, rel=0.03)


def test_the_printed_dead_zone_holds_only_noise_that_is_smaller():
    assert estimate_after(0.05, 0.3) == 0.0
    assert estimate_after(0.4, 0.3) > 5.0
