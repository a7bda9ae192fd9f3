"""The Runge-Kutta method against the solutions that it must reproduce, each component by itself."""

import pytest

from quad_dynamics.newton_euler import rk4

RATES = (-3.0, -2.5, -2.0, -1.5, -1.0, -0.5, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
START = (1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 7.0, -8.0, 9.0, -10.0, 11.0, -12.0, 13.0)


def growing(rates, _input, s):
    return tuple(rate * x for rate, x in zip(rates, s, strict=True))


def driven(gains, value, _s):
    return tuple(gain * value for gain in gains)


@pytest.mark.parametrize("h", [0.002, 0.3])
def test_growth_has_the_first_five_terms_of_the_exponential(h):
    end = rk4(growing, RATES, 0.0, 0.0, 0.0, START, h)
    for x, rate, found in zip(START, RATES, end, strict=True):
        z = rate * h
        assert found == pytest.approx(x * (1.0 + z + z**2 / 2 + z**3 / 6 + z**4 / 24), rel=1e-14)


def test_an_input_is_integrated_by_simpsons_rule():
    u = (2.0, 7.0, -1.0)
    end = rk4(driven, RATES, *u, START, 0.6)
    for x, gain, found in zip(START, RATES, end, strict=True):
        assert found == pytest.approx(x + gain * 0.6 * (u[0] + 4 * u[1] + u[2]) / 6, rel=1e-14)
