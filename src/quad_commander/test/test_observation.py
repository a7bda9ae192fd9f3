"""Numbers for the commander, against values worked out by hand."""

import math

import pytest

from quad_commander.observation import age, position_error, thrust_over_weight, tilt
from quad_core.geometry import quaternion_from_euler
from quad_core.types import Actuation, Quat, TrajectoryPoint, Vec3, VehicleState
from quad_core.vehicle import Vehicle


@pytest.mark.parametrize("degrees", [0.0, 15.0, 60.0, 90.0, 179.0])
def test_tilt_is_the_angle_from_the_vertical_whatever_the_heading(degrees):
    for heading in (0.0, 2.0, -3.0):
        q = quaternion_from_euler(Vec3(math.radians(degrees), 0.0, heading))
        assert tilt(VehicleState(q_wb=q)) == pytest.approx(math.radians(degrees), abs=1e-7)


def test_tilt_at_the_ends_is_no_error():
    assert tilt(VehicleState()) == 0.0
    assert tilt(VehicleState(q_wb=Quat(1.0, 0.0, 0.0, 0.0))) == math.pi


def test_distance_thrust_and_age():
    state, reference = VehicleState(p_w=Vec3(1.0, 2.0, 5.0)), TrajectoryPoint(p_w=Vec3(1.0, 5.0, 1.0))
    assert position_error(state, reference) == 5.0
    assert thrust_over_weight(Vehicle(), Actuation(thrust=0.5 * 0.56 * 9.8)) == pytest.approx(0.5)
    assert age(600, 500, 0, 2_000_000) == 0.2
    assert age(600, -1, 100, 2_000_000) == 1.0
