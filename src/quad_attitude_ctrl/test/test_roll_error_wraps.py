"""Rolled over: the error of roll is the short way round, as that of yaw is."""

import math

import pytest
from attitude_cases import DT, VEHICLE

from quad_attitude_ctrl import abfnitsm, itsm, pid
from quad_core.geometry import ZERO, quaternion_from_euler
from quad_core.types import Actuation, AttitudeInputs, AttitudeThrust, Vec3, VehicleState


@pytest.mark.parametrize("law", [abfnitsm, itsm, pid])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_two_degrees_across_half_a_turn_are_two_degrees(law, side):
    roll, goal = side * math.radians(179.0), side * math.radians(-179.0)
    state = VehicleState(ZERO, ZERO, quaternion_from_euler(Vec3(roll, 0.0, 0.0)), ZERO)
    angles = Vec3(goal, 0.0, 0.0)
    setpoint = AttitudeThrust(angles, ZERO, ZERO, quaternion_from_euler(angles), 5.0, 0.3)
    parameters = law.Parameters()
    memory = law.init(parameters, VEHICLE)
    for _ in range(300):  # 0.6 s: the command filter has arrived
        wrench, memory, internals = law.step(
            parameters, VEHICLE, memory, AttitudeInputs(state, setpoint, Actuation()), DT
        )
    assert internals.angle_error.x == pytest.approx(-side * math.radians(2.0), rel=0.01)
    assert wrench.torque_b.x * side > 0.0
