"""Vectors against NumPy; quaternions, Euler angles and Eqs. 4 and 13 against SciPy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quad_core import geometry
from quad_core.geometry import ZERO, add, clamp, cross, dot, norm, scale, subtract
from quad_core.types import Quat, Vec3

PART = st.floats(-1e3, 1e3, allow_subnormal=False)
PARTS = st.builds(Vec3, PART, PART, PART)
ANY = st.floats(allow_nan=False)


@given(a=PARTS, b=PARTS, factor=PART)
def test_numpy_says_the_same(a, b, factor):
    u, v = np.array(a), np.array(b)
    assert add(a, b) == tuple(u + v)
    assert subtract(a, b) == tuple(u - v)
    assert scale(factor, a) == tuple(factor * u)
    assert dot(a, b) == pytest.approx(np.dot(u, v), rel=1e-12, abs=1e-9)
    assert cross(a, b) == pytest.approx(np.cross(u, v), rel=1e-12, abs=1e-9)
    assert norm(a) == pytest.approx(np.linalg.norm(u), rel=1e-12)
    assert add(a, ZERO) == a


@given(value=ANY, low=ANY, high=ANY)
def test_clamp_moves_into_the_range_and_no_farther(value, low, high):
    low, high = sorted((low, high))
    found = clamp(value, low, high)
    assert low <= found <= high
    assert found == value or found in (low, high)
    assert (found == value) == (low <= value <= high)


def test_clamp_leaves_a_nan_to_be_seen():
    assert math.isnan(clamp(math.nan, -1.0, 1.0))


ANGLE = st.floats(-3.14, 3.14)
PITCH = st.floats(-1.55, 1.55)
ANGLES = st.builds(Vec3, ANGLE, PITCH, ANGLE)
NUMBER = st.floats(-100.0, 100.0)
VECTOR = st.builds(Vec3, NUMBER, NUMBER, NUMBER)


def scipy_of(angles):
    return Rotation.from_euler("ZYX", [angles.z, angles.y, angles.x])


def eq_4(angles):
    """Eq. 4 as printed."""
    (sf, st_, sp), (cf, ct, cp) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [ct * cp, st_ * sf * cp - cf * sp, cf * st_ * cp + sf * sp],
            [ct * sp, st_ * sf * sp + cf * cp, cf * st_ * sp - sf * cp],
            [-st_, sf * ct, cf * ct],
        ]
    )


@settings(deadline=None)
@given(ANGLES, VECTOR)
def test_quaternion_turns_as_eq_4_and_scipy(angles, vector):
    matrix, q = scipy_of(angles).as_matrix(), geometry.quaternion_from_euler(angles)
    np.testing.assert_allclose(eq_4(angles), matrix, atol=1e-14)
    np.testing.assert_allclose(Rotation.from_quat(q).as_matrix(), matrix, atol=1e-14)
    np.testing.assert_allclose(geometry.rotate(q, vector), matrix @ vector, atol=1e-12)
    np.testing.assert_allclose(geometry.rotate_inverse(q, vector), matrix.T @ vector, atol=1e-12)
    np.testing.assert_allclose(geometry.body_z(q), matrix[:, 2], atol=1e-14)


@settings(deadline=None)
@given(ANGLES, ANGLES, VECTOR)
def test_relative_attitude_and_turned_are_those_of_scipy(base, angles, turn):
    a, b, turn = scipy_of(base), scipy_of(angles), geometry.scale(0.03, turn)
    first, second = (Quat(*each.as_quat().tolist()) for each in (a, b))
    np.testing.assert_allclose(
        Rotation.from_quat(geometry.relative_attitude(first, second)).as_matrix(), (a.inv() * b).as_matrix(), atol=1e-12
    )
    by_turn = (a * Rotation.from_rotvec(turn)).as_matrix()
    np.testing.assert_allclose(
        Rotation.from_quat(geometry.rotated_by_vector(first, turn)).as_matrix(), by_turn, atol=1e-12
    )


@settings(deadline=None)
@given(ANGLES)
def test_angles_come_back_as_scipy_gives_them(angles):
    q = Quat(*scipy_of(angles).as_quat().tolist())
    got = geometry.euler_from_quaternion(q)
    # near theta = 90 deg the arcsine loses half the digits
    loose = 1e-14 / np.cos(angles.y) ** 2 + 1e-13
    np.testing.assert_allclose(Rotation.from_euler("ZYX", got[::-1]).as_matrix(), eq_4(angles), atol=loose)
    np.testing.assert_allclose(got, angles, atol=100 * loose)


@settings(deadline=None)
@given(ANGLES, VECTOR)
def test_eq_13_is_the_derivative_of_the_angles(angles, omega):
    s, c = np.sin(angles), np.cos(angles)
    t, sec = s[1] / c[1], 1.0 / c[1]
    matrix = np.array([[1, s[0] * t, c[0] * t], [0, c[0], -s[0]], [0, s[0] * sec, c[0] * sec]])
    rates = geometry.euler_rates(angles, omega)
    np.testing.assert_allclose(rates, matrix @ omega, rtol=1e-12, atol=1e-12 * sec * 100)
    np.testing.assert_allclose(geometry.body_rates(angles, rates), omega, atol=1e-10 * sec)


@settings(deadline=None)
@given(st.builds(Vec3, ANGLE, st.floats(-1.2, 1.2), ANGLE), st.builds(Vec3, *[st.floats(-5.0, 5.0)] * 3))
def test_body_rates_turn_the_attitude(angles, rates):
    h = 1e-6
    ahead, behind = (scipy_of(Vec3(*(np.array(angles) + t * np.array(rates)).tolist())) for t in (h, -h))
    np.testing.assert_allclose(
        (behind.inv() * ahead).as_rotvec() / (2 * h), geometry.body_rates(angles, rates), atol=1e-7
    )


def test_eq_13_stays_finite_where_it_is_singular():
    for theta in (np.pi / 2, -np.pi / 2):
        assert np.isfinite(geometry.euler_rates(Vec3(0.3, float(theta), 0.1), Vec3(1.0, 2.0, 3.0))).all()


@settings(deadline=None)
@given(st.floats(-1e4, 1e4))
def test_wrapped_angle_is_the_same_direction_in_half_open_turn(angle):
    wrapped = geometry.wrap_angle(angle)
    assert -np.pi - 1e-11 < wrapped <= np.pi + 1e-11
    np.testing.assert_allclose([np.sin(wrapped), np.cos(wrapped)], [np.sin(angle), np.cos(angle)], atol=1e-11)


@settings(deadline=None)
@given(st.builds(Quat, *[st.floats(-10.0, 10.0)] * 4).filter(lambda q: sum(abs(n) for n in q) > 1e-3))
def test_normalized_has_length_one(q):
    unit = np.array(geometry.normalized(q))
    np.testing.assert_allclose(np.linalg.norm(unit), 1.0, atol=1e-15)
    np.testing.assert_allclose(unit * np.linalg.norm(q), q, atol=1e-14)


def test_a_lag_answers_a_step_by_its_exponential_on_each_axis():
    state = Vec3(0.0, 1.0, -2.0)
    for _ in range(5):
        state = geometry.low_passed(state, Vec3(1.0, 3.0, 2.0), 4.0, 0.1)
    left = math.exp(-2.0)
    assert state == pytest.approx((1.0 - left, 3.0 - 2.0 * left, 2.0 - 4.0 * left))
    assert geometry.slope(Vec3(1.0, 2.0, 3.0), Vec3(1.5, 1.0, 3.2), 0.1) == pytest.approx((5.0, -10.0, 2.0))
