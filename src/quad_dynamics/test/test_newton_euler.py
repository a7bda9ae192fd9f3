"""Terms of Eq. 1 against numbers by hand and against matrices."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_cases import ASYMMETRIC
from scipy.spatial.transform import Rotation

from quad_core.geometry import body_z, quaternion_from_euler
from quad_core.types import Quat, Vec3
from quad_dynamics import newton_euler as terms
from quad_dynamics.paper import thrust_axis

BODY = terms.Body(2.0, 9.8, 0.1, 0.2, 0.4, 0.5, 0.25, False)
PRINTED = BODY._replace(printed_drag=True)
RATE = st.floats(-50.0, 50.0)
VECTOR = st.tuples(RATE, RATE, RATE)


def test_terms_by_hand():
    assert terms.thrust_force((0.0, 0.6, 0.8), 10.0) == (0.0, 6.0, 8.0)
    assert terms.drag_force(BODY, (1.0, -2.0, 4.0)) == (-0.5, 1.0, -2.0)
    assert terms.drag_force(PRINTED, (1.0, -2.0, 4.0)) == (0.5, -1.0, 2.0)
    assert terms.drag_torque(BODY, (2.0, -4.0, 6.0)) == (-1.0, 4.0, -9.0)
    assert terms.drag_torque(PRINTED, (2.0, -4.0, 6.0)) == (1.0, 4.0, 9.0)
    # (Iyy - Izz) q r, (Izz - Ixx) p r, (Ixx - Iyy) p q
    assert terms.coupling_torque(BODY, (2.0, 3.0, 5.0)) == pytest.approx((-3.0, 3.0, -0.6), rel=1e-14)
    a = terms.linear_acceleration(BODY, (0.0, 0.6, 0.8), 10.0, (1.0, -2.0, 4.0), (3.0, 5.0, 7.0))
    assert a == pytest.approx((1.25, 6.0, 6.5 - 9.8), rel=1e-14)
    alpha = terms.angular_acceleration(BODY, (2.0, 3.0, 5.0), (0.7, 0.8, 0.9))
    assert alpha == pytest.approx(
        ((-3.0 - 1.0 + 0.7) / 0.1, (3.0 - 2.25 + 0.8) / 0.2, (-0.6 - 6.25 + 0.9) / 0.4), rel=1e-13
    )


@settings(deadline=None)
@given(VECTOR)
def test_coupling_is_minus_omega_cross_momentum(omega):
    w = np.array(omega)
    expected = -np.cross(w, np.diag([0.1, 0.2, 0.4]) @ w)
    np.testing.assert_allclose(terms.coupling_torque(BODY, omega), expected, atol=1e-11 * (1.0 + float(w @ w)))
    assert np.dot(terms.coupling_torque(BODY, omega), w) == pytest.approx(0.0, abs=1e-11 * (1.0 + float(w @ w)) ** 1.5)


@settings(deadline=None)
@given(VECTOR)
def test_corrected_drag_opposes_motion(velocity):
    assert np.dot(terms.drag_force(BODY, velocity), velocity) <= 0.0
    assert np.dot(terms.drag_torque(BODY, velocity), velocity) <= 0.0
    assert np.dot(terms.drag_force(PRINTED, velocity), velocity) >= 0.0


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


def test_hover_is_an_equilibrium():
    body = terms.Body(ASYMMETRIC.mass, ASYMMETRIC.gravity, 1.0, 2.0, 3.0, 0.1, 0.1, False)
    a = terms.linear_acceleration(body, body_z(Quat()), body.mass * body.gravity, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert a == pytest.approx((0.0, 0.0, 0.0), abs=1e-14)
