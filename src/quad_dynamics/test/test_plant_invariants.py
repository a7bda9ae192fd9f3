"""What must hold of a free rigid body: energy, angular momentum, unit quaternion, dissipation by drag."""

import numpy as np
import pytest
from plant_cases import ASYMMETRIC, NO_DRAG, NONE, motion, starting
from scipy.spatial.transform import Rotation

from quad_core.types import CALM, Wrench
from quad_core.vehicle import DragSign
from quad_dynamics import rigid_body
from quad_dynamics.parameters import InitialRates, PlantParameters

TUMBLING = PlantParameters(initial=starting((1.0, 2.0, 50.0), (3.0, -2.0, 5.0), (0.3, -0.8, 1.2), (5.0, 0.1, 3.0)))
IDLE = Wrench(0.0, NONE)
INERTIA = np.diag([ASYMMETRIC.inertia_xx, ASYMMETRIC.inertia_yy, ASYMMETRIC.inertia_zz])


def kinetic(y):
    return 0.5 * ASYMMETRIC.mass * y[3:6] @ y[3:6], 0.5 * y[10:] @ INERTIA @ y[10:]


def energy(y):
    return sum(kinetic(y)) + ASYMMETRIC.mass * ASYMMETRIC.gravity * y[2]


def momentum(y):
    return Rotation.from_quat(y[6:10]).as_matrix() @ INERTIA @ y[10:]


def fall(vehicle, parameters, steps):
    state = rigid_body.init(parameters, vehicle)
    history = [motion(state)]
    for _ in range(steps):
        state, _ = rigid_body.step(parameters, vehicle, state, IDLE, CALM, 0.002)
        history.append(motion(state))
    return np.array(history)


def test_energy_and_angular_momentum_are_conserved_without_torque_and_drag():
    history = fall(NO_DRAG, TUMBLING, 2500)
    assert np.ptp([energy(y) for y in history]) < 1e-9 * energy(history[0])
    rotation = np.array([kinetic(y)[1] for y in history])
    assert np.ptp(rotation) < 1e-8 * rotation[0]
    spins = np.array([momentum(y) for y in history])
    assert np.abs(spins - spins[0]).max() < 1e-8 * np.linalg.norm(spins[0])
    # it does tumble: the body rates are far from constant
    assert np.ptp(history[:, 11]) > 3.0
    np.testing.assert_allclose(np.linalg.norm(history[:, 6:10], axis=1), 1.0, atol=4e-16)


def test_free_fall_is_a_parabola():
    history = fall(NO_DRAG, TUMBLING, 500)
    t = 0.002 * np.arange(501)
    start = TUMBLING.initial
    np.testing.assert_allclose(history[:, 0], start.p.x + start.v.x * t, atol=1e-11)
    np.testing.assert_allclose(history[:, 2], start.p.z + start.v.z * t - 0.5 * 9.81 * t * t, atol=1e-11)


def test_drag_takes_energy_and_the_printed_sign_adds_it():
    taken = np.array([energy(y) for y in fall(ASYMMETRIC, TUMBLING, 500)])
    assert np.diff(taken).max() < 0.0
    fast = TUMBLING._replace(drag_sign=DragSign.PRINTED)
    fast = fast._replace(initial=fast.initial._replace(omega=InitialRates(5.0, 4.0, 3.0)))
    added = np.array([energy(y) for y in fall(ASYMMETRIC, fast, 100)])
    assert np.diff(added).min() > 0.0


def test_spin_about_one_axis_decays_as_the_closed_form():
    # Izz r' = -k_T r abs(r)  =>  r = r0 / (1 + r0 k_T t / Izz)
    spin = PlantParameters(initial=starting(omega=(0.0, 0.0, -20.0)))
    history = fall(ASYMMETRIC, spin, 500)
    rate = 20.0 * ASYMMETRIC.drag_torque_coefficient * 1.0 / ASYMMETRIC.inertia_zz
    assert history[-1, 12] == pytest.approx(-20.0 / (1.0 + rate), rel=1e-9)
    decay = ASYMMETRIC.drag_coefficient / ASYMMETRIC.mass
    pushed = PlantParameters(initial=starting(v=(7.0, -3.0, 0.0)))
    assert fall(ASYMMETRIC, pushed, 500)[-1, 3:5] == pytest.approx([7.0 * np.exp(-decay), -3.0 * np.exp(-decay)])
