"""D_P and D_A of Eqs. 10-12: what the true motion is, less the nominal model. Eq. 11 itself: test/paper."""

import numpy as np
import pytest
from plant_cases import ASYMMETRIC, NONE, WRONG, Reference, flat, motion, under, vector

from quad_core.types import Vec3, Wrench
from quad_dynamics import paper, rigid_body
from quad_dynamics.newton_euler import nominal_body, true_body
from quad_dynamics.parameters import PlantParameters


@pytest.mark.parametrize("plant", [rigid_body, paper])
def test_nominal_model_plus_lumped_terms_is_the_true_motion(plant):
    rng = np.random.default_rng(4)
    state = plant.init(WRONG, ASYMMETRIC)
    wrench, force, torque = Wrench(16.0, Vec3(0.05, -0.04, 0.02)), vector(rng, 2.0), vector(rng, 0.05)
    for _ in range(50):
        state, _ = plant.step(WRONG, ASYMMETRIC, state, wrench, under(force, torque), 0.002)
    lumped = plant.lumped(WRONG, ASYMMETRIC, state, wrench, under(force, torque))
    reference = Reference(ASYMMETRIC, PlantParameters())
    model = reference.rigid_body if plant is rigid_body else reference.paper
    nominal = model(wrench, NONE, NONE)(0.0, motion(state))
    ahead, _ = plant.step(WRONG, ASYMMETRIC, state, wrench, under(force, torque), 1e-5)
    behind, _ = plant.step(WRONG, ASYMMETRIC, state, wrench, under(force, torque), -1e-5)
    flown = (flat(ahead) - flat(behind)) / 2e-5
    linear, angular = ([3, 4, 5], [10, 11, 12]) if plant is rigid_body else ([7, 9, 11], [1, 3, 5])
    np.testing.assert_allclose(nominal[linear] + lumped.lumped_acceleration_w, flown[linear], atol=1e-7)
    np.testing.assert_allclose(nominal[angular] + lumped.lumped_angular_acceleration_b, flown[angular], atol=1e-7)


@pytest.mark.parametrize("plant", [rigid_body, paper])
def test_without_errors_only_the_outer_force_and_torque_remain(plant):
    state = plant.init(PlantParameters(), ASYMMETRIC)
    force, torque = Vec3(1.3, -2.6, 0.65), Vec3(0.011, -0.017, 0.052)
    got = plant.lumped(PlantParameters(), ASYMMETRIC, state, Wrench(14.0, Vec3(0.1, 0.1, 0.05)), under(force, torque))
    np.testing.assert_allclose(got.lumped_acceleration_w, [1.0, -2.0, 0.5], atol=1e-13)
    np.testing.assert_allclose(got.lumped_angular_acceleration_b, [1.0, -1.0, 2.0], atol=1e-13)


def test_true_body_differs_from_the_nominal_one_by_the_errors():
    nominal, truth = nominal_body(WRONG, ASYMMETRIC), true_body(WRONG, ASYMMETRIC, 0.0)
    assert nominal[:5] == (1.3, 9.81, 0.011, 0.017, 0.026)
    assert truth[:5] == pytest.approx((1.61, 9.81, 0.013, 0.014, 0.031), rel=1e-14)
    assert nominal[5:] == (0.37, 2.9e-3, False)
    assert truth[5:] == pytest.approx((0.48, 2.9e-3, False), rel=1e-14)
