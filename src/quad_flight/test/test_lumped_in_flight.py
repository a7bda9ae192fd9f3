"""D_P and D_A of Eqs. 10-12 as logged in a flight, against what truth's velocities did that the nominal model did not.

Nothing of the plant is used here: Eq. 1 with the nominal vehicle is written out with NumPy and SciPy.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quad_core import plugins
from quad_core.vehicle import Vehicle
from quad_flight.flight import flight_from_parameters, fly

pytestmark = pytest.mark.skipif(
    not plugins.names(plugins.PLANT), reason="plug-ins are not installed: run scripts/setup"
)

PERIOD = 500_000
VEHICLE = Vehicle()._replace(inertia_yy=5.0e-3, drag_coefficient=0.3, drag_torque_coefficient=2.0e-3)
ERRORS = {
    "rigid_body.mass_error": 0.12,
    "rigid_body.inertia_error.xx": 6e-4,
    "rigid_body.inertia_error.yy": -7e-4,
    "rigid_body.inertia_error.zz": 9e-4,
    "rigid_body.effectiveness.thrust": 0.93,
    "rigid_body.effectiveness.roll": 0.85,
    "rigid_body.effectiveness.pitch": 1.1,
    "rigid_body.effectiveness.yaw": 0.8,
}


@pytest.fixture(scope="module")
def topics():
    shared = {"flight.plant_period": PERIOD}
    for name in ("inertia_yy", "drag_coefficient", "drag_torque_coefficient"):
        shared[f"vehicle.{name}"] = getattr(VEHICLE, name)
    flight = flight_from_parameters(
        {
            "/**": shared,
            "trajectory": {"trajectory": "case2", "case2.start": "printed", "case2.duration": 2.5},
            "simulator": ERRORS | {"held_gaussian.hold": 0.5},
        }
    )
    return fly(flight).topics


def between(rows):
    """Return what held in the middle of each step."""
    return 0.5 * (rows[1:] + rows[:-1])


def undisturbed(topics):
    """Return which steps began and ended under the same outer force and torque; ``disturbance`` tells of their end."""
    force, torque = topics["disturbance"]["force_w"], topics["disturbance"]["torque_b"]
    return (force[1:] == force[:-1]).all(axis=1) & (torque[1:] == torque[:-1]).all(axis=1)


def test_the_flight_shows_errors_and_disturbances(topics):
    lumped = topics["disturbance"]["lumped_acceleration_w"]
    assert np.abs(lumped).max() > 1.0
    assert len(np.unique(topics["disturbance"]["force_w"][:, 0])) == 5
    assert undisturbed(topics).sum() > 4000


def test_lumped_acceleration_is_what_the_nominal_model_misses(topics):
    truth, keep = topics["truth"], undisturbed(topics)
    v = truth["v_w"]
    axis = Rotation.from_quat(truth["q_wb"]).as_matrix()[:, :, 2]
    thrust = topics["wrench_setpoint"]["thrust"][: len(v) - 1, None]
    nominal = (between(axis) * thrust - VEHICLE.drag_coefficient * between(v)) / VEHICLE.mass
    nominal[:, 2] -= VEHICLE.gravity
    missed = np.diff(v, axis=0) / (PERIOD * 1e-9) - nominal
    lumped = topics["disturbance"]["lumped_acceleration_w"][1:]
    assert np.abs(missed - lumped)[keep].max() < 0.02
    assert np.median(np.abs(missed - lumped)[keep]) < 1e-3


def test_lumped_angular_acceleration_is_what_the_nominal_model_misses(topics):
    truth, keep = topics["truth"], undisturbed(topics)
    omega = truth["omega_b"]
    inertia = np.array([VEHICLE.inertia_xx, VEHICLE.inertia_yy, VEHICLE.inertia_zz])
    middle, torque = between(omega), topics["wrench_setpoint"]["torque_b"][: len(omega) - 1]
    drag = VEHICLE.drag_torque_coefficient * np.abs(middle) * middle
    nominal = (torque - np.cross(middle, inertia * middle) - drag) / inertia
    missed = np.diff(omega, axis=0) / (PERIOD * 1e-9) - nominal
    lumped = topics["disturbance"]["lumped_angular_acceleration_b"][1:]
    assert np.abs(lumped).max() > 1.0
    assert np.abs(missed - lumped)[keep].max() < 0.05
    assert np.median(np.abs(missed - lumped)[keep]) < 1e-3
