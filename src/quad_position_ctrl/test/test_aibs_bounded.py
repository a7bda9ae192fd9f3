"""The whole step far from the reference: bounded virtual velocity and its derivative, thrust that is not enough.

The bound is written out again with NumPy and differentiated numerically; gains, limits and errors differ on every axis.
"""

import math
import random

import numpy as np
import pytest

from quad_core.geometry import body_z, quaternion_from_euler
from quad_core.parameters import build
from quad_core.types import Actuation, PositionInputs, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle, max_thrust
from quad_position_ctrl import aibs

VEHICLE = Vehicle(mass=1.3, gravity=9.81, drag_coefficient=0.37, thrust_to_weight=2.2)
XI, K = np.array([2.1, 3.4, 4.6]), np.array([0.3, 0.2, 0.4])
OPEN = {
    "limits.acceleration_xy": 1e6,
    "limits.acceleration_z": 1e6,
    "limits.min_lift": -1e6,
    "limits.tilt": 1.58,
    "limits.thrust": 1e6,
    "limits.min_thrust": 0.0,
    "observer.bandwidth": 0.0,
    "thrust_form": "norm",
    "tilt_heading": "reference",
}
BOUNDS = {"speed.braking_xy": 2.5, "speed.braking_z": 1.7, "speed.max_xy": 9.0, "speed.max_z": 6.0}


def parameters(**other):
    values = OPEN | BOUNDS | other
    for axis, name in enumerate("xyz"):
        values |= {f"{name}.position_gain": float(XI[axis]), f"{name}.integral_gain": float(K[axis])}
    return build(aibs.Parameters, values)


def stepped(law, error, velocity, integral, gain, acceleration=(0.0, 0.0, 0.0)):
    """Return the law's step at ``error`` = position - reference with the reference at velocity (0.4, -0.3, 0.2)."""
    state = VehicleState(Vec3(*error), Vec3(*velocity), quaternion_from_euler(Vec3(0.1, -0.2, 0.7)), Vec3())
    reference = TrajectoryPoint(v_w=Vec3(0.4, -0.3, 0.2), a_w=Vec3(*acceleration), yaw=0.7)
    memory = aibs.init(law, VEHICLE)._replace(
        error_integral=Vec3(*integral), adaptive_gain=Vec3(*gain), initialised=True
    )
    return aibs.step(law, VEHICLE, memory, PositionInputs(state, reference, Actuation()), 0.01)


def bounded(length, gain, braking, max_speed):
    linear = braking / gain
    return min(math.sqrt(linear * (2.0 * length - linear)), max_speed) if length > linear else min(length, max_speed)


def correction(error, integral):
    """Return the bounded correction of Eq. 23 and by how much it was shortened, per axis."""
    unbounded = -XI * error - K * integral
    horizontal, vertical = float(np.linalg.norm(unbounded[:2])), abs(float(unbounded[2]))
    scale_xy = bounded(horizontal, max(XI[0], XI[1]), BOUNDS["speed.braking_xy"], BOUNDS["speed.max_xy"]) / horizontal
    scale_z = bounded(vertical, XI[2], BOUNDS["speed.braking_z"], BOUNDS["speed.max_z"]) / vertical
    scale = np.array([scale_xy, scale_xy, scale_z])
    return unbounded * scale, scale


@pytest.mark.parametrize("far", [4.0, 60.0], ids=["braking", "at the largest speed"])
def test_virtual_velocity_and_command_are_those_of_the_bound(far):
    chance = random.Random(23)
    for _ in range(30):
        error = np.array([chance.choice((-1.0, 1.0)) * chance.uniform(0.6, 1.0) * far for _ in range(3)])
        velocity, integral = (np.array([chance.uniform(-2.0, 2.0) for _ in range(3)]) for _ in range(2))
        gain, acceleration = (np.array([chance.uniform(0.5, 5.0) for _ in range(3)]) for _ in range(2))
        _, memory, internals = stepped(parameters(), error, velocity, integral, gain, acceleration)
        reference_velocity = np.array([0.4, -0.3, 0.2])
        shortened, scale = correction(error, integral)
        virtual = reference_velocity + shortened
        assert internals.velocity_limited
        assert internals.virtual_velocity == pytest.approx(virtual, rel=1e-12)
        ahead, behind = (correction(error + h * (velocity - reference_velocity), integral)[0] for h in (1e-6, -1e-6))
        velocity_error = velocity - virtual
        drag = -VEHICLE.drag_coefficient / VEHICLE.mass
        command = acceleration + (ahead - behind) / 2e-6 - scale * error - gain * velocity_error - drag * velocity
        assert internals.acceleration_command == pytest.approx(command, rel=1e-6, abs=1e-6)
        assert memory.error_integral == tuple(integral)


def test_the_bound_of_one_direction_leaves_the_other_alone():
    zero, near, far = (0.0, 0.0, 0.0), 0.01, 20.0
    _, _, internals = stepped(parameters(), (far, 0.0, near), zero, zero, (1.0, 1.0, 1.0))
    assert internals.virtual_velocity.z == pytest.approx(0.2 - XI[2] * near, rel=1e-12)
    _, _, internals = stepped(parameters(), (near, 0.0, far), zero, zero, (1.0, 1.0, 1.0))
    assert internals.virtual_velocity.x == pytest.approx(0.4 - XI[0] * near, rel=1e-12)
    assert internals.virtual_velocity.z > -BOUNDS["speed.max_z"]


def test_thrust_that_is_not_enough_is_taken_from_the_horizontal_part():
    """All the thrust, tilted just so far that the vertical command stays what it was."""
    law = parameters(**{"limits.thrust": 0.8})
    setpoint, _, internals = stepped(law, (9.0, -9.0, 0.0), (3.0, 0.0, 0.0), (0.0, 0.0, 0.0), (9.0, 9.0, 1.0))
    assert internals.thrust_limited
    assert setpoint.thrust == pytest.approx(0.8 * max_thrust(VEHICLE), rel=1e-12)
    vertical = setpoint.thrust * body_z(setpoint.q_wb).z
    commanded = VEHICLE.mass * (VEHICLE.gravity + internals.acceleration_command.z)
    assert vertical == pytest.approx(commanded, rel=1e-12)


def test_what_is_kept_for_the_observer():
    _, memory, _ = stepped(parameters(), (0.1, 0.2, -0.3), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (2.0, 3.0, 4.0))
    assert memory.velocity == (1.0, 2.0, 3.0)
    assert memory.thrust_axis == body_z(quaternion_from_euler(Vec3(0.1, -0.2, 0.7)))
    assert memory.initialised is True
