"""The flatness chain against SymPy's derivatives of Eq. 38, and what a setpoint carries with and without it."""

import math

import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

from quad_core import plugins
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Actuation, PositionInputs, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle
from quad_position_ctrl.flatness import angle_derivatives

GRAVITY = 9.81
T = sp.Symbol("t")
PATH = (
    sp.Rational(3) * sp.sin(T * sp.Rational(17, 10) + sp.Rational(2, 5)),
    2 * sp.cos(T * sp.Rational(13, 10)) + sp.Rational(3, 10) * T * T,
    sp.sin(T * sp.Rational(9, 10)) - T * T * T / 20,
)
YAW = sp.Rational(4, 5) * sp.sin(T * sp.Rational(11, 10)) + T / 3


def derivative(expression, order, time):
    return float(sp.diff(expression, T, order).subs(T, time).evalf(30))


def reference(time):
    vectors = [Vec3(*(derivative(axis, order, time) for axis in PATH)) for order in range(5)]
    return TrajectoryPoint(time, *vectors, *(derivative(YAW, order, time) for order in range(3)))


def angles():
    """Return Eq. 38 along the path, as SymPy has it."""
    x, y, z = (sp.diff(axis, T, 2) for axis in PATH)
    lift = z + sp.Rational(981, 100)
    theta = sp.atan((sp.cos(YAW) * x + sp.sin(YAW) * y) / lift)
    phi = sp.atan(sp.cos(theta) * (sp.sin(YAW) * x - sp.cos(YAW) * y) / lift)
    return phi, theta, YAW


@pytest.mark.parametrize("time", [0.0, 0.3, 0.9, 1.7, 2.6])
def test_rates_and_accelerations_are_the_derivatives_of_equation_38(time):
    point = reference(time)
    found = angle_derivatives(point, point.yaw, GRAVITY)
    for place, angle in enumerate(angles()):
        assert found.rates[place] == pytest.approx(derivative(angle, 1, time), rel=1e-10, abs=1e-10)
        assert found.accelerations[place] == pytest.approx(derivative(angle, 2, time), rel=1e-10, abs=1e-10)


def test_a_reference_that_falls_freely_has_no_direction():
    falling = reference(0.3)._replace(a_w=Vec3(1.0, 0.0, -GRAVITY))
    found = angle_derivatives(falling, 0.0, GRAVITY)
    assert found.rates[:2] == (0.0, 0.0)
    assert found.accelerations[:2] == (0.0, 0.0)
    assert found.rates.z == falling.yaw_rate


@pytest.mark.parametrize("name", ["aibs", "ibs", "pid", "se3"])
def test_every_position_law_carries_it_where_it_is_asked_to(name):
    # the derivatives of Eq. 38 leave the drag out
    law, vehicle = plugins.load(plugins.POSITION_LAW, name), Vehicle(drag_coefficient=0.0)
    point = reference(0.9)
    state = VehicleState(point.p_w, point.v_w, quaternion_from_euler(Vec3(0.0, 0.0, point.yaw)), Vec3(0.0, 0.0, 0.0))
    inputs = PositionInputs(state, point, Actuation())
    answers = {}
    for asked in (False, True):
        parameters = law.Parameters()._replace(feed_forward=asked)
        answers[asked], _, _ = law.step(parameters, vehicle, law.init(parameters, vehicle), inputs, 0.01)
    # with the gravity of the vehicle
    phi, theta, _ = (angle.subs(sp.Rational(981, 100), sp.Rational(98, 10)) for angle in angles())
    assert answers[True].rates == pytest.approx(
        (derivative(phi, 1, 0.9), derivative(theta, 1, 0.9), point.yaw_rate), rel=1e-9
    )
    assert answers[False].rates == (0.0, 0.0, point.yaw_rate)
    assert answers[False].accelerations == (0.0, 0.0, point.yaw_acceleration)
    assert Rotation.from_quat(answers[True].q_wb).apply([0, 0, 1]) == pytest.approx(
        Rotation.from_quat(answers[False].q_wb).apply([0, 0, 1]), abs=1e-14
    )
    if name == "se3":  # Lee's axes have another psi than Eq. 38, whose angles the chain differentiates
        assert answers[True].angles == pytest.approx(
            [float(angle.subs(T, 0.9).evalf(30)) for angle in (phi, theta, YAW)], rel=1e-9
        )
    else:
        assert answers[True].angles == answers[False].angles
    assert answers[True].thrust == answers[False].thrust
    assert math.isfinite(sum(answers[True].accelerations))
