"""Attitude kinematics against SciPy, the Runge-Kutta step against what it must reproduce; Eq. 1: test/paper."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_core.geometry import body_z, quaternion_from_euler
from quad_core.types import Vec3
from quad_dynamics import newton_euler as terms
from quad_dynamics.paper import thrust_axis

RATE = st.floats(-50.0, 50.0)
VECTOR = st.tuples(RATE, RATE, RATE)


@settings(deadline=None)
@given(VECTOR, VECTOR)
def test_quaternion_rate_is_the_derivative_of_turning(turn, omega):
    small = 1e-6
    attitude = Rotation.from_rotvec(np.array(turn) / 50.0)
    q = attitude.as_quat()
    w = np.array(omega)
    ahead, behind = attitude * Rotation.from_rotvec(small * w), attitude * Rotation.from_rotvec(-small * w)
    numeric = (_near(ahead.as_quat(), q) - _near(behind.as_quat(), q)) / (2.0 * small)
    np.testing.assert_allclose(terms.quaternion_rate(tuple(q.tolist()), omega), numeric, atol=1e-6)


def _near(q, like):
    return q if np.dot(q, like) > 0.0 else -q


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_both_thrust_axes_are_the_third_column_of_eq_4(phi, theta, psi):
    column = Rotation.from_euler("ZYX", [psi, theta, phi]).as_matrix()[:, 2]
    np.testing.assert_allclose(thrust_axis(phi, theta, psi), column, atol=1e-14)
    np.testing.assert_allclose(body_z(quaternion_from_euler(Vec3(phi, theta, psi))), column, atol=1e-14)


RATES = (-3.0, -2.5, -2.0, -1.5, -1.0, -0.5, 0.25, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
START = (1.0, -2.0, 3.0, -4.0, 5.0, -6.0, 7.0, -8.0, 9.0, -10.0, 11.0, -12.0, 13.0)


def growing(rates, _input, s):
    return tuple(rate * x for rate, x in zip(rates, s, strict=True))


def driven(gains, value, _s):
    return tuple(gain * value for gain in gains)


@pytest.mark.parametrize("h", [0.002, 0.3])
def test_growth_has_the_first_five_terms_of_the_exponential(h):
    end = terms.rk4(growing, RATES, 0.0, 0.0, 0.0, START, h)
    for x, rate, found in zip(START, RATES, end, strict=True):
        z = rate * h
        assert found == pytest.approx(x * (1.0 + z + z**2 / 2 + z**3 / 6 + z**4 / 24), rel=1e-14)


def test_an_input_is_integrated_by_simpsons_rule():
    u = (2.0, 7.0, -1.0)
    end = terms.rk4(driven, RATES, *u, START, 0.6)
    for x, gain, found in zip(START, RATES, end, strict=True):
        assert found == pytest.approx(x + gain * 0.6 * (u[0] + 4 * u[1] + u[2]) / 6, rel=1e-14)
