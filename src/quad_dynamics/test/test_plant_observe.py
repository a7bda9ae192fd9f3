"""What the plants publish, where they start, and what they refuse."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_cases import ASYMMETRIC
from scipy.spatial.transform import Rotation

from quad_core.geometry import euler_from_quaternion, euler_rates, wrap_angle
from quad_core.parameters import ParameterError, build, flatten
from quad_core.types import Vec3
from quad_core.vehicle import DragSign
from quad_dynamics import paper, rigid_body
from quad_dynamics.parameters import InertiaError, PlantParameters

ANGLE = st.floats(-3.1, 3.1)
PITCH = st.floats(-1.45, 1.45)
RATE = st.floats(-20.0, 20.0)
START = {
    "initial.p.x": 1.0,
    "initial.p.y": 2.0,
    "initial.p.z": 3.0,
    "initial.v.x": 4.0,
    "initial.v.y": 5.0,
    "initial.v.z": 6.0,
    "initial.angles.phi": 0.1,
    "initial.angles.theta": -0.2,
    "initial.angles.psi": 0.3,
    "initial.omega.x": 0.4,
    "initial.omega.y": 0.5,
    "initial.omega.z": 0.6,
}


@settings(deadline=None)
@given(st.tuples(ANGLE, PITCH, st.floats(-10.0, 10.0)), st.tuples(RATE, RATE, RATE))
def test_paper_publishes_the_omega_that_makes_its_euler_rates_exact(angles, rates):
    state = paper.State(angles[0], rates[0], angles[1], rates[1], angles[2], rates[2], 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    seen = paper.observe(PlantParameters(), ASYMMETRIC, state)
    np.testing.assert_allclose(euler_rates(Vec3(*angles), seen.omega_b), rates, atol=1e-12)
    through_quaternion = euler_from_quaternion(seen.q_wb)
    for got, true in zip(through_quaternion, angles, strict=True):
        assert wrap_angle(got - true) == pytest.approx(0.0, abs=1e-13)
    np.testing.assert_allclose(euler_rates(through_quaternion, seen.omega_b), rates, atol=1e-10)
    assert (seen.p_w, seen.v_w) == ((1.0, 3.0, 5.0), (2.0, 4.0, 6.0))


@settings(deadline=None)
@given(st.tuples(ANGLE, PITCH, ANGLE), st.tuples(RATE, RATE, RATE))
def test_published_omega_turns_the_published_attitude(angles, rates):
    h = 1e-5

    def attitude(t):
        state = paper.State(
            *(v for pair in zip(np.array(angles) + t * np.array(rates), rates, strict=True) for v in pair)
        )
        seen = paper.observe(PlantParameters(), ASYMMETRIC, state)
        return Rotation.from_quat(seen.q_wb), seen.omega_b

    turned = (attitude(-h)[0].inv() * attitude(h)[0]).as_rotvec() / (2.0 * h)
    np.testing.assert_allclose(turned, attitude(0.0)[1], atol=1e-5)


def test_both_plants_start_where_they_are_told():
    parameters = build(PlantParameters, START)
    for plant in (paper, rigid_body):
        seen = plant.observe(parameters, ASYMMETRIC, plant.init(parameters, ASYMMETRIC))
        np.testing.assert_allclose(seen.p_w, [1, 2, 3])
        np.testing.assert_allclose(seen.v_w, [4, 5, 6])
        np.testing.assert_allclose(euler_from_quaternion(seen.q_wb), [0.1, -0.2, 0.3], atol=1e-15)
        np.testing.assert_allclose(seen.omega_b, [0.4, 0.5, 0.6], atol=1e-15)


def test_parameters_are_named_and_checked():
    built = build(PlantParameters, {"drag_sign": "printed", "effectiveness.yaw": 0.5, "inertia_error.zz": 1e-3})
    assert (built.drag_sign, built.effectiveness.yaw, built.inertia_error.zz) == (DragSign.PRINTED, 0.5, 1e-3)
    assert flatten(PlantParameters())["drag_sign"] == "corrected"
    wrong = {"substeps": 0, "initial.angles.theta": math.pi, "effectiveness.thrust": -0.1, "inital.p.x": 1.0}
    for name, value in wrong.items():
        with pytest.raises(ParameterError, match=name):
            build(PlantParameters, {name: value})


@pytest.mark.parametrize("plant", [paper, rigid_body])
@pytest.mark.parametrize(("wrong", "named"), [
    (PlantParameters(mass_error=-1.3), "mass_error"),
    (PlantParameters(drag_error=-0.38), "drag_error"),
    (PlantParameters(lag_error=-0.01), "lag_error"),
    (PlantParameters(inertia_error=InertiaError(xx=-0.02)), "inertia_error.xx"),
    (PlantParameters(inertia_error=InertiaError(yy=-0.02)), "inertia_error.yy"),
    (PlantParameters(inertia_error=InertiaError(zz=-0.03)), "inertia_error.zz"),
])  # fmt: skip
def test_errors_that_leave_nothing_physical_are_refused_by_name(plant, wrong, named):
    with pytest.raises(ValueError, match=named):
        plant.init(wrong, ASYMMETRIC)
