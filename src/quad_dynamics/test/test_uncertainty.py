"""Lemma 1 (Eq. 12), and D_P and D_A of Eq. 11 against the formulas that the lemma gives."""

import numpy as np
import pytest
import sympy
from plant_cases import ASYMMETRIC, NONE, WRONG, Reference, flat, motion, under, vector
from scipy.spatial.transform import Rotation

from quad_core.types import NO_PAYLOAD, Quat, Vec3, VehicleState, Wrench
from quad_dynamics import paper, rigid_body
from quad_dynamics.newton_euler import nominal_body, true_body
from quad_dynamics.parameters import PlantParameters
from quad_dynamics.rotors import allocate


def test_lemma_1_holds_for_random_matrices():
    # as printed it is right; it leaves out that A and A + BCD must be invertible
    rng = np.random.default_rng(12)
    for m, n, p in ((1, 1, 1), (3, 3, 3), (3, 2, 4), (4, 1, 2), (2, 5, 3)):
        a = rng.normal(size=(m, m)) + 3.0 * np.eye(m)
        bcd = rng.normal(size=(m, n)) @ rng.normal(size=(n, p)) @ rng.normal(size=(p, m))
        inverse = np.linalg.inv(a)
        right = inverse - np.linalg.inv(np.eye(m) + inverse @ bcd) @ inverse @ bcd @ inverse
        np.testing.assert_allclose(np.linalg.inv(a + bcd), right, atol=1e-9 * max(1.0, np.abs(right).max()))


def test_lemma_1_holds_exactly():
    a = sympy.Matrix([[3, 1, 0], [2, 5, -1], [0, 1, 4]])
    b, c, d = (
        sympy.Matrix([[1, 2], [0, -1], [3, 1]]),
        sympy.Matrix([[2, 1], [1, -3]]),
        sympy.Matrix([[1, 0, 2], [-1, 4, 1]]),
    )
    x = a.inv() * b * c * d
    assert (a + b * c * d).inv() == a.inv() - (sympy.eye(3) + x).inv() * x * a.inv()


def formulas(rotation, v, rates, wrench, force, torque):
    """D_P and D_A by Eq. 11 of the derivation, drag corrected, with what the rotors make of ``wrench``."""
    made = allocate(ASYMMETRIC, wrench)
    factor = np.array(WRONG.effectiveness)
    m, dm = ASYMMETRIC.mass, WRONG.mass_error
    inertia = np.diag([ASYMMETRIC.inertia_xx, ASYMMETRIC.inertia_yy, ASYMMETRIC.inertia_zz])
    d_inertia = np.diag(WRONG.inertia_error)
    f_a = rotation @ [0, 0, wrench.thrust]
    df_a = rotation @ [0, 0, factor[0] * made.thrust - wrench.thrust]
    down = np.array([0, 0, -ASYMMETRIC.gravity])
    f_d = -ASYMMETRIC.drag_coefficient * v
    tau_a = np.array(wrench.torque_b)
    dtau_a = factor[1:] * made.torque_b - tau_a
    tau_d = -ASYMMETRIC.drag_torque_coefficient * np.abs(rates) * rates
    d_p = (df_a + dm * down + force) / (m + dm) - dm / m / (1 + dm / m) * (f_a + m * down + f_d) / m
    x = np.linalg.inv(inertia) @ d_inertia
    nominal = np.linalg.inv(inertia) @ (-np.cross(rates, inertia @ rates) + tau_a + tau_d)
    d_a = np.linalg.inv(inertia + d_inertia) @ (-np.cross(rates, d_inertia @ rates) + dtau_a + torque)
    return d_p, d_a - np.linalg.inv(np.eye(3) + x) @ x @ nominal


@pytest.mark.parametrize("size", [0.1, 30.0])
def test_lumped_terms_are_those_of_eq_11(size):
    rng = np.random.default_rng(11)
    for _ in range(50):
        wrench = Wrench(float(rng.uniform(0.0, 80.0)), vector(rng, size))
        v, rates, angles = vector(rng, 5.0), vector(rng, 5.0), vector(rng, 1.2)
        force, torque = vector(rng, 2.0), vector(rng, 0.1)
        rotation = Rotation.from_euler("ZYX", [angles.z, angles.y, angles.x])
        d_p, d_a = formulas(rotation.as_matrix(), np.array(v), np.array(rates), wrench, force, torque)
        rigid = rigid_body.State(VehicleState(NONE, v, Quat(*rotation.as_quat().tolist()), rates))
        euler = paper.State(angles.x, rates.x, angles.y, rates.y, angles.z, rates.z, 0.0, v.x, 0.0, v.y, 0.0, v.z)
        for plant, state in ((rigid_body, rigid), (paper, euler)):
            got = plant.lumped(WRONG, ASYMMETRIC, state, wrench, under(force, torque))
            assert (got.force_w, got.torque_b) == (force, torque)
            np.testing.assert_allclose(got.lumped_acceleration_w, d_p, atol=1e-11)
            np.testing.assert_allclose(got.lumped_angular_acceleration_b, d_a, atol=1e-9 * max(1.0, size))


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
    nominal, truth = nominal_body(WRONG, ASYMMETRIC), true_body(WRONG, ASYMMETRIC, NO_PAYLOAD)
    assert nominal[:5] == (1.3, 9.81, 0.011, 0.017, 0.026)
    assert truth[:5] == pytest.approx((1.61, 9.81, 0.013, 0.014, 0.031), rel=1e-14)
    assert nominal[5:] == truth[5:] == (0.37, 2.9e-3, False)
