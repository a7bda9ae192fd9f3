"""What eqs. 24-37 do to one axis in motion: Runge-Kutta on a point mass, apart from our plants."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from quad_position_ctrl import backstepping as law

XI7, K7, ALPHA, DRAG = 4.25, 0.01, 2.5, -0.3
positions, velocities, gains = st.floats(-2.0, 2.0), st.floats(-3.0, 3.0), st.floats(0.5, 12.0)


def reference(t):
    return math.sin(0.7 * t), 0.7 * math.cos(0.7 * t), -0.49 * math.sin(0.7 * t)


def errors(t, y):
    p, v, integral, _ = y
    p_d, v_d, _ = reference(t)
    e7 = law.tracking_error(p, p_d)
    e8 = law.tracking_error(v, law.virtual_velocity(law.correction_velocity(XI7, K7, e7, integral), v_d))
    return e7, e8


def flown(start, disturbance, seconds=3.0):
    """Integrate p'' = a_7 p' + U + d with Eq. 30 and Eq. 37 in continuous time; d is a function of t."""

    def rate(t, y):
        _, v, integral, gain = y
        a_d = reference(t)[2]
        e7, e8 = errors(t, y)
        u = law.acceleration_command(XI7, K7, gain, DRAG, e7, e8, integral, v, a_d, 0.0)
        return [v, DRAG * v + u + disturbance(t), e7, law.adaptive_rate(ALPHA, e8)]

    times = np.linspace(0.0, seconds, 1201)
    return times, solve_ivp(rate, (0.0, seconds), start, t_eval=times, rtol=1e-10, atol=1e-12, max_step=0.02).y.T


def total(t, y, true_gain):
    """Return L_Px of Eq. 31 for xi_8 = ``true_gain``."""
    e7, e8 = errors(t, y)
    return law.lyapunov(K7, e7, e8, y[2]) + 0.5 * (true_gain - y[3]) ** 2 / ALPHA


def total_rate(true_gain, e7, e8, d):
    """Return L_Px' = -xi_7 e_7^2 - xi_8 e_8^2 + e_8 d: Eq. 34, which leaves the last term out."""
    return -XI7 * e7 * e7 - true_gain * e8 * e8 + e8 * d


def largest_errors(true_gain, bound):
    """Return the half axes of the ellipse outside which L_Px falls for every d within ``bound``."""
    return bound / math.sqrt(2.0 * XI7 * true_gain), bound / true_gain


@given(p=positions, v=velocities, integral=st.floats(-5.0, 5.0), gain=gains, true_gain=gains)
@settings(max_examples=15, deadline=None)
def test_eqs_34_and_36_without_disturbance_the_function_only_falls(p, v, integral, gain, true_gain):
    """For every xi_8 > 0 that one may compare with, by exactly Eq. 34."""
    times, states = flown([p, v, integral, gain], lambda t: 0.0)
    values = np.array([total(t, y, true_gain) for t, y in zip(times, states, strict=True)])
    assert np.diff(values).max() <= 1e-9
    rates = [total_rate(true_gain, *errors(t, y), 0.0) for t, y in zip(times, states, strict=True)]
    fallen = np.trapezoid(rates, times)
    assert values[-1] - values[0] == pytest.approx(fallen, rel=2e-2, abs=1e-6)


@given(p=positions, v=velocities, gain=gains, true_gain=gains, phase=st.floats(0.0, 6.0), speed=st.floats(0.0, 9.0))
@settings(max_examples=15, deadline=None)
def test_with_disturbance_the_rate_keeps_the_bound_that_replaces_eq_34(p, v, gain, true_gain, phase, speed):
    bound = 1.5

    def disturbance(t):
        return bound * math.cos(speed * t + phase)

    times, states = flown([p, v, 0.0, gain], disturbance)
    values = np.array([total(t, y, true_gain) for t, y in zip(times, states, strict=True)])
    slopes = np.gradient(values, times, edge_order=2)
    for t, y, slope in list(zip(times, states, slopes, strict=True))[2:-2]:
        e7, e8 = errors(t, y)
        exact = total_rate(true_gain, e7, e8, disturbance(t))
        assert slope == pytest.approx(exact, rel=2e-2, abs=2e-2 * (1.0 + abs(values[0])))
        assert exact <= -XI7 * e7 * e7 - 0.5 * true_gain * e8 * e8 + 0.5 * bound * bound / true_gain + 1e-12


@given(e7=positions, e8=velocities, true_gain=gains, share=st.floats(-1.0, 1.0))
def test_outside_the_ellipse_the_function_falls_for_every_disturbance(e7, e8, true_gain, share):
    bound = 1.5
    half7, half8 = largest_errors(true_gain, bound)
    if (e7 / half7) ** 2 + (e8 / half8) ** 2 > 1.0 + 1e-9:
        assert total_rate(true_gain, e7, e8, share * bound) < 0.0


def test_eq_34_is_wrong_next_to_the_reference_in_any_disturbance():
    """e_7 = 0, e_8 = d/(2 xi_8): the function rises at d^2/(4 xi_8), where the paper has it fall."""
    assert total_rate(5.0, 0.0, 0.1, 1.0) == pytest.approx(0.05)
    times, states = flown([0.0, 0.7, 0.0, 5.0], lambda t: 1.0, seconds=0.1)
    values = [total(t, y, 5.0) for t, y in zip(times, states, strict=True)]
    assert values[-1] > values[0] + 1e-4


def test_errors_stay_small_in_the_disturbance_though_the_function_does_not_fall():
    """From rest on the reference, abs(d) <= 1.5 and a gain that starts at 1: the gain grows until the error is held."""
    times, states = flown([0.0, 0.7, 0.0, 1.0], lambda t: 1.5 if t % 4.0 < 2.0 else -1.5, seconds=20.0)
    e7 = np.array([errors(t, y)[0] for t, y in zip(times, states, strict=True)])
    gain = states[:, 3]
    assert np.diff(gain).min() >= 0.0
    assert np.abs(e7[times > 10.0]).max() < np.abs(e7[times < 4.0]).max()
    assert np.abs(e7[times > 10.0]).max() < largest_errors(float(gain[150]), 1.5)[0]


def test_static_error_is_where_the_flight_comes_to_rest():
    """Constant d and the gain held: e_7 = d / (1 + xi_7 xi_hat) after 5 s, as good as untouched by the integral."""
    y = np.array([0.0, 0.0, 0.0])
    dt, d, gain = 1e-3, 1.2, 7.0
    for _ in range(5000):
        p, v, integral = y
        e8 = law.tracking_error(v, law.virtual_velocity(law.correction_velocity(XI7, K7, p, integral), 0.0))
        u = law.acceleration_command(XI7, K7, gain, DRAG, p, e8, integral, v, 0.0, 0.0)
        y = y + dt * np.array([v, DRAG * v + u + d, p])
    assert y[0] == pytest.approx(1.2 / 30.75, rel=2e-2)
