"""The last part of the way to zero is a power law of time: eqs. 45, 46, 52 and 53 in continuous time."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quad_attitude_ctrl import sliding_control as law

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
